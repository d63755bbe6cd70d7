//! How far the work is: a bar on a terminal, a line every some seconds elsewhere.

use std::io::{IsTerminal as _, Write as _};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use missing_physics::observer::{Observer, Progress};

/// Time between two lines.
const EVERY: Duration = Duration::from_secs(10);

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
    state: Mutex<State>,
}

struct State {
    said: Instant,
    step: String,
    step_begin: Instant,
}

impl Steps {
    pub(crate) fn new(loudness: Loudness) -> Self {
        let begin = Instant::now();
        let bar = (loudness == Loudness::Usual && std::io::stderr().is_terminal()).then(|| {
            let bar = ProgressBar::new(100);
            if let Ok(style) = ProgressStyle::with_template("{bar:30} {msg}") {
                bar.set_style(style);
            }
            bar
        });
        let state = State { said: begin, step: String::new(), step_begin: begin };
        Self { loudness, bar, begin, state: Mutex::new(state) }
    }
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
fn line(text: &str) {
    let _ = writeln!(std::io::stderr(), "missing-physics: {text}");
}

impl Observer for Steps {
    fn progress(&self, progress: Progress<'_>) -> bool {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if state.step != progress.stage {
            if self.loudness == Loudness::Verbose {
                if !state.step.is_empty() {
                    line(&format!("{}: {:.2} s", state.step, state.step_begin.elapsed().as_secs_f64()));
                }
                line(&format!("{} …", progress.stage));
            }
            state.step = progress.stage.to_owned();
            state.step_begin = Instant::now();
        }
        let said =
            format!("{}{}", progress.stage, far(progress.done, state.step_begin.elapsed().as_secs_f64()));
        if let Some(bar) = &self.bar {
            bar.set_message(said);
            bar.set_position((100.0 * progress.done) as u64);
        } else if self.loudness != Loudness::Quiet && state.said.elapsed() >= EVERY {
            state.said = Instant::now();
            line(&format!("{:.0} s so far, {said}", self.begin.elapsed().as_secs_f64()));
        }
        true
    }
}

impl Drop for Steps {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
        if self.loudness == Loudness::Verbose {
            let state = self.state.get_mut().unwrap_or_else(PoisonError::into_inner);
            if !state.step.is_empty() {
                line(&format!("{}: {:.2} s", state.step, state.step_begin.elapsed().as_secs_f64()));
            }
            line(&format!("{:.2} s in all", self.begin.elapsed().as_secs_f64()));
        }
    }
}
