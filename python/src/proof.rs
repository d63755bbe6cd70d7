//! Concealed effects: worlds drawn, sealed, diagnosed and scored.

use missing_physics_prove::{ProveArguments, ProveError};
use pyo3::prelude::*;

use crate::errors::Failed;
use crate::watch::watched;

impl From<ProveError> for Failed {
    fn from(error: ProveError) -> Self {
        Self::new("DiagnosisError", error.to_string())
    }
}

/// A proof: its folder, one domain or all, worlds of each, one kind or all in turns, and the seed of the worlds.
#[pyclass(frozen, module = "missing_physics._engine")]
pub(crate) struct Proof(ProveArguments);

#[pymethods]
impl Proof {
    #[new]
    #[pyo3(signature = (folder, domain, worlds, kind, seed, threads))]
    fn new(
        folder: std::path::PathBuf,
        domain: Option<String>,
        worlds: usize,
        kind: Option<String>,
        seed: u64,
        threads: usize,
    ) -> Self {
        Self(ProveArguments { domain, worlds, kind, seed, runs: None, folder, threads })
    }

    /// Draws, seals, diagnoses and scores; goes on where it was stopped.
    #[pyo3(signature = (progress))]
    fn prove(&self, py: Python<'_>, progress: Option<Py<PyAny>>) -> PyResult<String> {
        watched(py, self.0.threads, progress.as_ref(), None, |observer| {
            Ok(missing_physics_prove::prove(&self.0, observer)?)
        })
    }

    /// Draws and seals: the names of the worlds.
    fn seal(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        watched(py, self.0.threads, None, None, |observer| {
            Ok(missing_physics_prove::seal_worlds(&self.0, observer)?)
        })
    }

    /// Diagnoses one world.
    fn world(&self, py: Python<'_>, name: &str) -> PyResult<()> {
        watched(py, self.0.threads, None, None, |_| Ok(missing_physics_prove::prove_world(&self.0, name)?))
    }
}
