//! How far the work is: a bar on a terminal, a line every some seconds elsewhere.

use std::io::{IsTerminal as _, Write as _};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use missing_physics::observer::{Observer, Progress};

/// Time between two lines.
const EVERY: Duration = Duration::from_secs(10);
/// Time between two looks of a bar.
const TICK: Duration = Duration::from_millis(200);
/// What is done before the first step is told.
const FIRST: &str = "reading";

/// How much is said of the work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Loudness {
    /// Nothing.
    Quiet,
    /// A bar, or a line every ten seconds.
    Usual,
    /// A line for each step.
    Verbose,
}

/// Shows steps on standard error.
pub(crate) struct Steps {
    loudness: Loudness,
    bar: Option<ProgressBar>,
    begin: Instant,
    state: Arc<Mutex<State>>,
    /// Where there is no terminal: a thread that says a line now and then, whatever a step takes, and what ends it.
    lines: Option<(Sender<()>, JoinHandle<()>)>,
}

struct State {
    step: String,
    done: f64,
    step_begin: Instant,
}

impl State {
    fn said(&self) -> String {
        format!("{}{}", self.step, far(self.done, self.step_begin.elapsed().as_secs_f64()))
    }
}

impl Steps {
    pub(crate) fn new(loudness: Loudness) -> Self {
        let begin = Instant::now();
        let (usual, terminal) = (loudness == Loudness::Usual, std::io::stderr().is_terminal());
        let bar = (usual && terminal).then(|| {
            let bar = ProgressBar::new(100).with_message(FIRST);
            if let Ok(style) = ProgressStyle::with_template("{bar:30} {msg}") {
                bar.set_style(style);
            }
            bar.enable_steady_tick(TICK);
            bar
        });
        let state = State { step: FIRST.into(), done: 0.0, step_begin: begin };
        let state = Arc::new(Mutex::new(state));
        let lines = (usual && !terminal).then(|| said_now_and_then(&state, begin));
        if loudness == Loudness::Verbose {
            line(&format!("{FIRST} …"));
        }
        Self { loudness, bar, begin, state, lines }
    }

    fn end_of_step(state: &State) {
        line(&format!("{}: {:.2} s", state.step, state.step_begin.elapsed().as_secs_f64()));
    }
}

/// Says every ten seconds how far the work is.
fn said_now_and_then(state: &Arc<Mutex<State>>, begin: Instant) -> (Sender<()>, JoinHandle<()>) {
    let (end, ended) = channel();
    let state = Arc::clone(state);
    let speaker = std::thread::spawn(move || {
        while ended.recv_timeout(EVERY) == Err(RecvTimeoutError::Timeout) {
            let said = state.lock().unwrap_or_else(PoisonError::into_inner).said();
            line(&format!("{:.0} s so far, {said}", begin.elapsed().as_secs_f64()));
        }
    });
    (end, speaker)
}

/// How far a step is that began `spent` seconds ago, and what of it is expected to remain; nothing where its share is not known.
fn far(done: f64, spent: f64) -> String {
    if !(done > 0.02 && done < 1.0) {
        return String::new();
    }
    let share = format!(": {:.0} %", 100.0 * done);
    match spent * (1.0 - done) / done {
        _ if spent < 2.0 => share,
        s if s < 90.0 => format!("{share}, about {s:.0} s of it left"),
        s if s < 5400.0 => format!("{share}, about {:.0} min of it left", s / 60.0),
        s => format!("{share}, about {:.1} h of it left", s / 3600.0),
    }
}

/// A line on standard error; that it cannot be written changes nothing.
pub(crate) fn line(text: &str) {
    let text = crate::shown(text, std::io::stderr().is_terminal());
    let _ = writeln!(std::io::stderr(), "missing-physics: {text}");
}

impl Observer for Steps {
    fn progress(&self, progress: Progress<'_>) -> bool {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if state.step != progress.stage {
            if self.loudness == Loudness::Verbose {
                Self::end_of_step(&state);
                line(&format!("{} …", progress.stage));
            }
            state.step = progress.stage.to_owned();
            state.step_begin = Instant::now();
        }
        state.done = progress.done;
        if let Some(bar) = &self.bar {
            bar.set_message(state.said());
            bar.set_position((100.0 * progress.done) as u64);
        }
        true
    }
}

impl Drop for Steps {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
        if let Some((end, speaker)) = self.lines.take() {
            drop(end);
            // It says lines and nothing else: there is nothing to hear from it.
            let _ = speaker.join();
        }
        if self.loudness == Loudness::Verbose {
            Self::end_of_step(&self.state.lock().unwrap_or_else(PoisonError::into_inner));
            let memory = missing_physics_cli::commands::most_memory();
            let memory =
                memory.map_or_else(String::new, |bytes| format!(", {} MB of memory at most", bytes >> 20));
            line(&format!("{:.2} s in all{memory}", self.begin.elapsed().as_secs_f64()));
        }
    }
}
