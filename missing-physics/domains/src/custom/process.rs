//! A simulator in a process of its own: one line of JSON in, one line of JSON out.

use std::collections::{BTreeMap, VecDeque};
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel, sync_channel};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde::Serialize;

use super::answer::{Failure, read_answer, read_batch};
use super::machine::JointForce;
use super::simulator::{Questions, Simulator};
use crate::recording::quoted;

/// The longest line that a simulator may answer, bytes.
const LONGEST_LINE: u64 = 64 << 20;
/// How many lines it may answer before they are read.
const AHEAD: usize = 1;
/// How many of its last words on stderr are kept, and how many bytes of each.
const LAST_WORDS: usize = 3;
const LONGEST_WORDS: u64 = 1 << 12;
/// How long a simulator has for its first answer beyond the time limit: programs take their time to start.
const START: Duration = Duration::from_secs(30);
/// How long a simulator that is no longer needed has for its own end.
const FAREWELL: Duration = Duration::from_millis(200);

/// What is asked.
#[derive(Debug, Serialize)]
struct Request<'a> {
    id: u64,
    run: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    parameters: Option<Values<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    batch: Option<Vec<Values<'a>>>,
    inputs: BTreeMap<&'a str, &'a [f64]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    forces: Option<Forces<'a>>,
}

/// Parameters by name.
type Values<'a> = BTreeMap<&'a str, f64>;

/// What acts on the joints by name, for one set of parameters or for each of a batch.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum Forces<'a> {
    One(BTreeMap<&'a str, &'a JointForce>),
    Batch(Vec<BTreeMap<&'a str, &'a JointForce>>),
}

fn by_joint<'a>(joints: &'a [String], forces: &'a [JointForce]) -> BTreeMap<&'a str, &'a JointForce> {
    joints.iter().map(String::as_str).zip(forces).collect()
}

/// How a simulator is started.
#[derive(Debug, Clone)]
pub(super) struct Start {
    /// Program and arguments.
    pub(super) command: Vec<String>,
    /// The folder in which it runs.
    pub(super) folder: PathBuf,
    /// The longest wait for one answer.
    pub(super) limit: Duration,
    /// How many may run at once, at least 1.
    pub(super) processes: usize,
    /// How many sets of parameters it takes in one line.
    pub(super) batch: usize,
}

/// Simulators that wait for work.
#[derive(Debug)]
pub(super) struct Pool {
    start: Start,
    state: Mutex<State>,
    freed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    idle: Vec<Process>,
    running: usize,
    asked: u64,
    fault: Option<String>,
}

impl Pool {
    pub(super) fn new(start: Start) -> Self {
        Self { start, state: Mutex::default(), freed: Condvar::new() }
    }

    /// Asks one question: what is read of the line that answers it, which may take so long.
    fn ask<'a, R>(
        &self,
        request: impl FnOnce(u64) -> Request<'a>,
        limit: Duration,
        read: impl Fn(&str, u64) -> Result<R, Failure>,
    ) -> Result<R, Failure> {
        let (mut process, id) = self.take()?;
        let request = request(id);
        let ask = |process: &mut Process| process.ask(&request, limit).and_then(|line| read(&line, id));
        let mut answer = ask(&mut process);
        // One that has answered before is asked once more, afresh: a slow answer does not lose all that was worked out.
        if process.hung
            && process.answered
            && let Ok(other) = Process::start(&self.start.command, &self.start.folder)
        {
            process = other;
            answer = ask(&mut process).or(answer);
        }
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        match &answer {
            Err(Failure::Fatal(why)) => {
                state.fault.get_or_insert_with(|| why.clone());
                state.running -= 1;
            }
            _ => state.idle.push(process),
        }
        drop(state);
        if matches!(answer, Err(Failure::Fatal(_))) {
            // There will be no answer any more: nobody has anything to wait for.
            self.freed.notify_all();
        } else {
            self.freed.notify_one();
        }
        answer
    }

    /// A simulator that is idle, or a new one, or the first to be free; with the number of the question.
    fn take(&self) -> Result<(Process, u64), Failure> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if let Some(fault) = &state.fault {
                return Err(Failure::Fatal(fault.clone()));
            }
            state.asked += 1;
            let id = state.asked;
            if let Some(process) = state.idle.pop() {
                return Ok((process, id));
            }
            if state.running < self.start.processes {
                return match Process::start(&self.start.command, &self.start.folder) {
                    Ok(process) => {
                        state.running += 1;
                        Ok((process, id))
                    }
                    Err(why) => {
                        state.fault = Some(why.clone());
                        self.freed.notify_all();
                        Err(Failure::Fatal(why))
                    }
                };
            }
            state = self.freed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

impl Simulator for Pool {
    fn predict(&self, questions: &Questions<'_>) -> Result<Vec<Vec<f64>>, Failure> {
        let Questions { run, parameters, sets, inputs, joints, forces, channels, rows } = *questions;
        let named = |values: &Vec<f64>| -> Values<'_> {
            parameters.iter().copied().zip(values.iter().copied()).collect()
        };
        let inputs: BTreeMap<&str, &[f64]> = inputs.iter().copied().collect();
        let numbers = rows * channels.len();
        let answer = |(sets, forces): (&[Vec<f64>], &[Vec<JointForce>])| -> Result<Vec<Vec<f64>>, Failure> {
            let limit = self.start.limit;
            if let ([alone], [acts]) = (sets, forces) {
                let forces = (!joints.is_empty()).then(|| Forces::One(by_joint(joints, acts)));
                let parameters = Some(named(alone));
                let request =
                    |id| Request { id, run, parameters, batch: None, inputs: inputs.clone(), forces };
                let read = |line: &str, id| {
                    let mut out = vec![0.0; numbers];
                    read_answer(line, id, channels, &mut out).map(|()| out)
                };
                return Ok(vec![self.ask(request, limit, read)?]);
            }
            let forces = (!joints.is_empty())
                .then(|| Forces::Batch(forces.iter().map(|acts| by_joint(joints, acts)).collect()));
            let batch = Some(sets.iter().map(named).collect());
            let request = |id| Request { id, run, parameters: None, batch, inputs: inputs.clone(), forces };
            let limit = limit.saturating_mul(u32::try_from(sets.len()).unwrap_or(u32::MAX));
            let read = |line: &str, id| read_batch(line, id, channels, numbers, sets.len());
            self.ask(request, limit, read)?.into_iter().collect()
        };
        let most = self.start.batch.max(1);
        let answers: Result<Vec<_>, Failure> =
            sets.chunks(most).zip(forces.chunks(most)).map(answer).collect();
        Ok(answers?.concat())
    }

    fn batches(&self) -> bool {
        self.start.batch > 1
    }

    fn fault(&self) -> Option<String> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).fault.clone()
    }

    fn give_up(&self, why: String) -> Failure {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let why = state.fault.get_or_insert(why).clone();
        drop(state);
        self.freed.notify_all();
        Failure::Fatal(why)
    }
}

/// A simulator that runs.
#[derive(Debug)]
struct Process {
    child: Child,
    questions: Option<Sender<String>>,
    answers: Receiver<Vec<u8>>,
    errors: Arc<Mutex<VecDeque<String>>>,
    fresh: bool,
    /// Whether it has answered a question, and whether it gave no answer in time.
    answered: bool,
    hung: bool,
}

impl Process {
    fn start(command: &[String], folder: &Path) -> Result<Self, String> {
        let (program, arguments) = command.split_first().ok_or("no command to start")?;
        let mut start = Command::new(program);
        start.args(arguments).current_dir(folder);
        start.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        // A group of its own: what it starts ends with it.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut start, 0);
        let mut child =
            start.spawn().map_err(|e| format!("the simulator {} cannot be started: {e}", quoted(program)))?;
        running().push(child.id());
        let pipes = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let (Some(mut stdin), Some(stdout), Some(stderr)) = pipes else {
            return Err(format!("the simulator {} has no pipes", quoted(program)));
        };
        let (questions, to_write) = channel::<String>();
        // Threads of its own write and read: a simulator that does neither cannot hold anybody up.
        std::thread::spawn(move || {
            for line in to_write {
                if stdin.write_all(line.as_bytes()).and_then(|()| stdin.flush()).is_err() {
                    break;
                }
            }
        });
        // One that answers more than it is asked waits: what nobody has asked for is not kept.
        let (found, answers) = sync_channel(AHEAD);
        std::thread::spawn(move || {
            let mut stdout = BufReader::new(stdout);
            loop {
                let mut line = Vec::new();
                match stdout.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line) {
                    Ok(n) if n > 0 && found.send(line).is_ok() => {}
                    _ => break,
                }
            }
        });
        let errors = Arc::new(Mutex::new(VecDeque::new()));
        let kept = Arc::clone(&errors);
        std::thread::spawn(move || {
            let mut stderr = BufReader::new(stderr);
            loop {
                // What comes without an end of line is taken piece by piece.
                let mut line = Vec::new();
                match stderr.by_ref().take(LONGEST_WORDS).read_until(b'\n', &mut line) {
                    Ok(n) if n > 0 => {}
                    _ => break,
                }
                let line = String::from_utf8_lossy(&line).trim().to_owned();
                let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
                if !line.is_empty() {
                    kept.push_back(line);
                }
                if kept.len() > LAST_WORDS {
                    kept.pop_front();
                }
            }
        });
        Ok(Self {
            child,
            questions: Some(questions),
            answers,
            errors,
            fresh: true,
            answered: false,
            hung: false,
        })
    }

    /// The line that answers a question.
    fn ask(&mut self, request: &Request<'_>, limit: Duration) -> Result<String, Failure> {
        let mut line = serde_json::to_string(request)
            .map_err(|e| Failure::NoPrediction(format!("the question cannot be written: {e}")))?;
        line.push('\n');
        let limit = if std::mem::take(&mut self.fresh) { limit + START } else { limit };
        if self.questions.as_ref().is_none_or(|q| q.send(line).is_err()) {
            return Err(self.ended());
        }
        match self.answers.recv_timeout(limit) {
            Ok(line) => {
                self.answered = true;
                String::from_utf8(line).map_err(|e| {
                    let got = String::from_utf8_lossy(e.as_bytes()).into_owned();
                    Failure::Fatal(format!("the simulator answered {}, which is no text", quoted(&got)))
                })
            }
            Err(RecvTimeoutError::Timeout) => {
                self.hung = true;
                end_group(self.child.id());
                let _ = self.child.kill();
                let limit = limit.as_secs_f64();
                Err(Failure::Fatal(format!(
                    "the simulator gave no answer within {limit} s{}",
                    self.last_words()
                )))
            }
            Err(RecvTimeoutError::Disconnected) => Err(self.ended()),
        }
    }

    /// What became of a simulator that answers no more.
    fn ended(&mut self) -> Failure {
        let how = match wait(&mut self.child, FAREWELL) {
            Some(status) => format!("ended ({status})"),
            None => "closed its output".into(),
        };
        Failure::Fatal(format!("the simulator {how} before it answered{}", self.last_words()))
    }

    fn last_words(&self) -> String {
        // The thread that reads them may still be at it.
        std::thread::sleep(Duration::from_millis(50));
        let errors = self.errors.lock().unwrap_or_else(PoisonError::into_inner);
        match errors.back() {
            Some(last) => format!("; its last words: {}", quoted(last)),
            None => String::new(),
        }
    }
}

/// The simulators that run, by the number of their process and group.
static RUNNING: Mutex<Vec<u32>> = Mutex::new(Vec::new());

fn running() -> std::sync::MutexGuard<'static, Vec<u32>> {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Ends all simulators that run and what they have started, before a program ends that was interrupted.
pub fn end_all() {
    running().iter().for_each(|id| end_group(*id));
}

/// Ends a process with all that it has started; of what is gone already nothing is left to end.
fn end_group(id: u32) {
    #[cfg(unix)]
    if let Some(group) = i32::try_from(id).ok().and_then(rustix::process::Pid::from_raw) {
        let _ = rustix::process::kill_process_group(group, rustix::process::Signal::KILL);
    }
    #[cfg(not(unix))]
    let _ = id;
}

/// How a process ended, if it does in time.
fn wait(child: &mut Child, patience: Duration) -> Option<std::process::ExitStatus> {
    let begin = Instant::now();
    loop {
        match child.try_wait() {
            Ok(Some(status)) => return Some(status),
            Ok(None) if begin.elapsed() < patience => std::thread::sleep(Duration::from_millis(5)),
            _ => return None,
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // The end of its input tells a simulator to end; one that does not is ended.
        self.questions = None;
        let ended = wait(&mut self.child, FAREWELL).is_some();
        // What it has started, too.
        end_group(self.child.id());
        if !ended {
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
        running().retain(|id| *id != self.child.id());
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    /// What a simulator says beyond what it is asked is not kept, however much it is: it comes to no end of it.
    #[test]
    fn a_simulator_that_says_too_much_waits() {
        let folder = tempfile::tempdir().unwrap();
        let script = "read l; echo '{\"id\": 1, \"channels\": {}}'; yes yes | head -c 5000000; touch said";
        let pool = Pool::new(Start {
            command: ["sh", "-c", script].map(str::to_owned).into(),
            folder: folder.path().into(),
            limit: Duration::from_secs(60),
            processes: 1,
            batch: 1,
        });
        let alone = [vec![]];
        let (run, parameters, sets, inputs) = ("a", &[][..], &alone[..], &[][..]);
        let forces = &[Vec::new()];
        let asked = Questions { run, parameters, sets, inputs, joints: &[], forces, channels: &[], rows: 0 };
        assert_eq!(pool.predict(&asked).ok(), Some(vec![vec![]]));
        std::thread::sleep(Duration::from_secs(2));
        assert!(!folder.path().join("said").exists());
    }

    /// The only simulator there may be dies while many wait for it: each of them is told.
    #[test]
    fn a_simulator_that_dies_leaves_nobody_waiting() {
        let script = "read l; sleep 0.3; exit 1";
        let pool = Arc::new(Pool::new(Start {
            command: ["sh", "-c", script].map(str::to_owned).into(),
            folder: std::env::temp_dir(),
            limit: Duration::from_secs(60),
            processes: 1,
            batch: 1,
        }));
        let (done, all) = channel();
        for _ in 0..16 {
            let (pool, done) = (Arc::clone(&pool), done.clone());
            std::thread::spawn(move || {
                let alone = [vec![]];
                let (run, parameters, sets, inputs) = ("a", &[][..], &alone[..], &[][..]);
                let forces = &[Vec::new()];
                let asked =
                    Questions { run, parameters, sets, inputs, joints: &[], forces, channels: &[], rows: 0 };
                let _ = done.send(pool.predict(&asked));
            });
        }
        for _ in 0..16 {
            let answer = all.recv_timeout(Duration::from_secs(20)).unwrap();
            assert!(matches!(answer, Err(Failure::Fatal(_))));
        }
    }
}
