//! Work in threads of its own, while Python goes on: progress is told, an interruption stops it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use missing_physics::observer::{Observer, Progress};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use crate::errors::Failed;
use crate::function::Function;

/// How often a signal is looked for.
const EVERY: Duration = Duration::from_millis(50);

/// Hands progress on, and stops where it is told to.
struct Relay<'a> {
    stages: Mutex<Sender<(String, f64)>>,
    stop: &'a AtomicBool,
}

impl Observer for Relay<'_> {
    fn progress(&self, progress: Progress<'_>) -> bool {
        let stages = self.stages.lock().unwrap_or_else(PoisonError::into_inner);
        // Nobody listens any more where the work was stopped.
        let _ = stages.send((progress.stage.to_owned(), progress.done));
        !self.stop.load(Ordering::Relaxed)
    }
}

/// Does `work` in a pool of `threads` (0: all cores) without holding the interpreter; `progress` is called from this thread with a stage
/// and how much of it is done, and what it raises stops the work, as a signal does.
///
/// # Errors
/// What `progress` or the function behind `simulator` raised, `KeyboardInterrupt`, or [`Failed`] of the work.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    threads: usize,
    progress: Option<&Py<PyAny>>,
    simulator: Option<&Arc<Function>>,
    work: impl FnOnce(&dyn Observer) -> Result<T, Failed> + Send,
) -> PyResult<T> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| Failed::new("DiagnosisError", format!("no pool of {threads} threads: {error}")))?;
    let stop = &AtomicBool::new(false);
    let (stages, heard) = channel();
    let relay = Relay { stages: Mutex::new(stages), stop };
    let (done, raised) = py.detach(move || {
        std::thread::scope(move |scope| {
            let worker = scope.spawn(move || pool.install(|| work(&relay)));
            let mut raised: Option<PyErr> = None;
            loop {
                let news = heard.recv_timeout(EVERY);
                if matches!(news, Err(RecvTimeoutError::Disconnected)) {
                    break;
                }
                if raised.is_some() {
                    continue;
                }
                let listened = Python::attach(|py| {
                    if let (Ok((stage, done)), Some(progress)) = (&news, progress) {
                        progress.call1(py, (stage, done))?;
                    }
                    py.check_signals()
                });
                if let Err(error) = listened {
                    raised = Some(error);
                    stop.store(true, Ordering::Relaxed);
                    if let Some(simulator) = simulator {
                        simulator.stop();
                    }
                }
            }
            (worker.join(), raised)
        })
    });
    if let Some(error) = raised.or_else(|| simulator.and_then(|simulator| simulator.raised())) {
        return Err(error);
    }
    let done = done.map_err(|_| PyRuntimeError::new_err("the engine stopped in the middle of its work"))?;
    Ok(done?)
}
