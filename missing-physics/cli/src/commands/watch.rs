//! `watch`: a recording that grows, looked at after each run.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use missing_physics::data::{Recording, Run};
use missing_physics::engine::stream::{Changed, Look, Watch, What};
use missing_physics::engine::{Options, diagnose};
use missing_physics::model::Model;
use missing_physics::observer::Silent;
use missing_physics_domains as domains;
use missing_physics_report::{self as report, ReportContext};

use super::error::CommandError;

/// How often files are looked at.
const PAUSE: Duration = Duration::from_millis(100);

/// What `watch` is asked for.
#[derive(Debug, Clone)]
pub struct WatchArguments {
    /// The recording's folder, whose files grow.
    pub folder: PathBuf,
    /// The first so many runs are those in which all was well.
    pub reference: usize,
    /// Seed of the diagnosis, and the rate of false alarms.
    pub options: Options,
    /// A last run is whole once its files have not changed for so long, s.
    pub settle_s: f64,
    /// Ends once nothing has come for so long, s; never without.
    pub end_after_s: Option<f64>,
    /// Rows of `data.csv` come on standard input, and are kept there.
    pub pipe: bool,
}

/// Watches a recording until nothing more comes; what is found is said line by line, as it is found.
///
/// # Errors
/// [`CommandError`]; what cannot be read for as long as a run needs to settle is an error.
pub fn watch(arguments: &WatchArguments, say: &mut dyn FnMut(&str)) -> Result<(), CommandError> {
    let piped = arguments.pipe.then(|| pipe(&arguments.folder));
    let ended = || piped.as_ref().is_none_or(std::thread::JoinHandle::is_finished);
    let mut files = Growing::new(arguments);
    let first = loop {
        let state = files.wait();
        let enough = arguments.reference.max(1);
        match domains::load(&arguments.folder) {
            Ok((domain, loaded))
                if loaded.recording.runs.len() > enough
                    || (files.settled() && loaded.recording.runs.len() == enough) =>
            {
                break (domain, loaded);
            }
            Ok((_, loaded)) if state == State::Ended && ended() => {
                let got = loaded.recording.runs.len();
                say(&format!("{got} runs came, the reference wants {enough}"));
                return Ok(());
            }
            Err(error) if files.settled() && ended() => return Err(error.into()),
            _ => {}
        }
    };
    let (domain, loaded) = first;
    let reference = Recording {
        runs: loaded.recording.runs.iter().take(arguments.reference).cloned().collect(),
        ..loaded.recording.clone()
    };
    let context = ReportContext {
        domain: domain.id().to_owned(),
        recording: arguments.folder.display().to_string(),
        words: domain.words(),
        ..ReportContext::default()
    };
    let judged = diagnose(&*loaded.model, &reference, &[], &arguments.options, &Silent)?;
    say(&format!(
        "the reference, {} runs: {}",
        reference.runs.len(),
        headline(&report::text(&judged, &context))
    ));
    let mut watch = Watch::new(&*loaded.model, &reference, arguments.options.alpha)?;
    let mut seen = reference.runs.len();
    let mut newest = loaded.recording.runs.clone();
    loop {
        // The last run may still be growing.
        let whole = newest.len() - usize::from(!(files.settled() && ended()));
        for number in seen..whole {
            let look = watch.add(&newest[number])?;
            say(&line(&newest[number], &look));
            if let (Some(_), Some(changed)) = (look.alarm, &look.changed) {
                let since = &newest[changed.first.0.min(number)..=number];
                say(&format!(
                    "    {}",
                    since_then(&*loaded.model, &reference, since, &arguments.options, &context)
                ));
            }
        }
        seen = seen.max(whole);
        if files.wait() == State::Ended && ended() && seen >= newest.len() {
            return Ok(());
        }
        match domains::load(&arguments.folder) {
            Ok((_, grown)) => newest = grown.recording.runs,
            Err(error) if files.settled() && ended() => return Err(error.into()),
            Err(_) => {}
        }
    }
}

/// What the runs since the change are explained by, or why that cannot be said yet.
fn since_then(
    model: &dyn Model,
    reference: &Recording,
    runs: &[Run],
    options: &Options,
    context: &ReportContext,
) -> String {
    let recording = Recording { runs: runs.to_vec(), ..reference.clone() };
    let begin = format!("runs since then, {}:", runs.len());
    match diagnose(model, &recording, &[], options, &Silent) {
        Ok(found) => format!("{begin} {}", headline(&report::text(&found, context))),
        Err(error) => format!("{begin} they cannot be diagnosed yet: {error}"),
    }
}

/// The first sentence of a report, on one line.
fn headline(text: &str) -> String {
    text.split("\n\n").next().unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ")
}

fn line(run: &Run, look: &Look) -> String {
    // From twenty on it is an alarm; how many powers of ten it has is enough of a large one.
    let e = if look.e_value < 1e4 { format!("{:.3}", look.e_value) } else { format!("{:.0e}", look.e_value) };
    let begin = format!("run {}: e = {e}", run.label);
    let Some(changed) = look.changed.as_ref().filter(|_| look.alarm.is_some()) else { return begin };
    format!("{begin}; something has changed from run {} on: {}", changed.first.1, what(changed))
}

fn what(changed: &Changed) -> String {
    let Some((most, share)) = changed.what.first() else { return "nothing that is listed".into() };
    let one = changed.by.first().filter(|_| changed.by.len() == 1);
    let by = one.map(|(by, error)| format!(" by {by:+.4} +- {error:.4}")).unwrap_or_default();
    let words = match most {
        What::Parameter { name, before, .. } => format!("{name} was {before:.5}, and differs{by}"),
        What::Mechanism { name, .. } => format!("{name}{by}"),
        What::Curve { channel } => format!("{channel} follows another curve"),
    };
    format!("{words} (probability {share:.2})")
}

/// Rows from standard input, written behind those that are there.
fn pipe(folder: &Path) -> std::thread::JoinHandle<()> {
    let path = folder.join("data.csv");
    std::thread::spawn(move || {
        let header = std::fs::read_to_string(&path).ok().and_then(|t| t.lines().next().map(str::to_owned));
        for row in std::io::stdin().lines().map_while(Result::ok) {
            // A header comes once, wherever it comes.
            if Some(&row) == header.as_ref() || row.trim().is_empty() {
                continue;
            }
            let file = std::fs::OpenOptions::new().append(true).create(true).open(&path);
            if file.and_then(|mut file| writeln!(file, "{row}")).is_err() {
                // What cannot be kept cannot be read either: the watch ends with what it has.
                return;
            }
        }
    })
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Changed,
    Ended,
}

/// The files of a recording as they grow.
struct Growing<'a> {
    arguments: &'a WatchArguments,
    seen: Vec<(PathBuf, u64, Option<SystemTime>)>,
    since: Instant,
}

impl<'a> Growing<'a> {
    fn new(arguments: &'a WatchArguments) -> Self {
        Self { arguments, seen: Vec::new(), since: Instant::now() }
    }

    /// Whether nothing has changed for as long as a run needs to settle.
    fn settled(&self) -> bool {
        self.since.elapsed().as_secs_f64() >= self.arguments.settle_s
    }

    /// Waits for a change, for what has come to settle, or for the end.
    fn wait(&mut self) -> State {
        let before = self.settled();
        loop {
            let now: Vec<_> = domains::recording::files_of(&self.arguments.folder)
                .into_iter()
                .map(|path| {
                    let known = std::fs::metadata(&path).ok();
                    (
                        path,
                        known.as_ref().map_or(0, std::fs::Metadata::len),
                        known.and_then(|m| m.modified().ok()),
                    )
                })
                .collect();
            if now != self.seen {
                (self.seen, self.since) = (now, Instant::now());
                return State::Changed;
            }
            let quiet_s = self.since.elapsed().as_secs_f64();
            if self.arguments.end_after_s.is_some_and(|end| quiet_s >= end.max(self.arguments.settle_s)) {
                return State::Ended;
            }
            if self.settled() && !before {
                return State::Changed;
            }
            std::thread::sleep(PAUSE);
        }
    }
}
