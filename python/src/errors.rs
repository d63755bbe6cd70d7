//! Errors of the crates as exceptions of the package, in the same words.

use missing_physics::engine::DiagnoseError;
use missing_physics_domains::recording::ReadError;
use missing_physics_domains::repair::RepairError;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// Why there is no answer, as a class of `missing_physics.errors` and a line of words.
#[derive(Debug)]
pub(crate) struct Failed {
    class: &'static str,
    words: String,
}

impl Failed {
    /// A failure of a class of the package.
    pub(crate) fn new(class: &'static str, words: impl Into<String>) -> Self {
        Self { class, words: words.into() }
    }
}

/// What a chapter's crate refuses, as `ChapterError`.
pub(crate) fn refused(error: impl std::fmt::Display) -> PyErr {
    Failed::new("ChapterError", error.to_string()).into()
}

impl From<ReadError> for Failed {
    fn from(error: ReadError) -> Self {
        Self::new("RecordingError", error.to_string())
    }
}

impl From<DiagnoseError> for Failed {
    fn from(error: DiagnoseError) -> Self {
        let class = match error {
            DiagnoseError::Predict(_) => "SimulatorError",
            DiagnoseError::Recording(_) | DiagnoseError::TooFewRows { .. } => "RecordingError",
            _ => "DiagnosisError",
        };
        Self::new(class, error.to_string())
    }
}

impl From<RepairError> for Failed {
    fn from(error: RepairError) -> Self {
        let class = if matches!(error, RepairError::Read(_)) { "RecordingError" } else { "RepairError" };
        Self::new(class, error.to_string())
    }
}

impl From<Failed> for PyErr {
    fn from(Failed { class, words }: Failed) -> Self {
        Python::attach(|py| {
            let raised = py.import("missing_physics.errors").and_then(|m| m.getattr(class)?.call1((&words,)));
            raised.map_or_else(|_| PyRuntimeError::new_err(words.clone()), PyErr::from_value)
        })
    }
}
