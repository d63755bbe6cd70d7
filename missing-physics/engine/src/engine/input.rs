//! What goes into a diagnosis, and why there is none.

use crate::adequacy::test::p_floor;
use crate::data::{Recording, RecordingError};
use crate::model::{Experiment, PredictError, Scope, Spec, SpecError};

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

/// Most replicates that a rate of false alarms gets.
const MOST_REPLICATES: f64 = 99_999.0;

impl Options {
    /// As by default, with a rate of false alarms, in (0, 0.5), and replicates enough to show it: at least fifty times its inverse, and at
    /// most 99,999.
    pub fn with_alpha(alpha: f64) -> Self {
        let default = Self::default();
        let enough = (50.0 / alpha).ceil() - 1.0;
        let replicates = if alpha > 0.0 { enough.min(MOST_REPLICATES) as usize } else { 0 };
        Self { alpha, replicates: replicates.max(default.replicates), ..default }
    }
}

/// Why there is no diagnosis.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DiagnoseError {
    /// The model's specification makes no sense.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// The recording is not sound.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// There are too few rows for the baseline's nuisance parameters.
    #[error(
        "{rows} measured values are too few for the {parameters} parameters of the baseline and its noise"
    )]
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
    /// An experiment that the model cannot predict.
    #[error("experiment \"{words}\": {got} {what}, expected {expected}")]
    Experiment {
        /// The action in words.
        words: String,
        /// What is miscounted.
        what: &'static str,
        /// Number found.
        got: usize,
        /// Number expected.
        expected: usize,
    },
    /// A mechanism that the model has not.
    #[error("the model has no mechanism {id}")]
    Unknown {
        /// The identifier.
        id: String,
    },
    /// The observer stopped the work.
    #[error("stopped")]
    Stopped,
}

/// A recording and options that make sense.
pub(super) fn check(recording: &Recording, options: &Options) -> Result<(), DiagnoseError> {
    recording.check()?;
    if !(options.alpha > 0.0 && options.alpha < 0.5) {
        return Err(DiagnoseError::Option {
            name: "alpha",
            value: options.alpha,
            expected: "above 0 and below 0.5",
        });
    }
    if options.replicates < 19 {
        let value = options.replicates as f64;
        return Err(DiagnoseError::Option { name: "replicates", value, expected: "at least 19" });
    }
    if options.alpha < p_floor(options.replicates) {
        let expected = "at least 1 / (replicates + 1), the smallest p value that so many replicates can show";
        return Err(DiagnoseError::Option { name: "alpha", value: options.alpha, expected });
    }
    Ok(())
}

/// An experiment's runs have the recording's inputs, and values for the model's nuisance parameters.
pub(super) fn check_experiment(
    spec: &Spec,
    recording: &Recording,
    experiment: &Experiment,
) -> Result<(), DiagnoseError> {
    let equal = |what, got: usize, expected: usize| {
        if got == expected {
            return Ok(());
        }
        Err(DiagnoseError::Experiment { words: experiment.words.clone(), what, got, expected })
    };
    equal("lists of nuisance parameters", experiment.nuisance.len(), experiment.runs.len())?;
    let unknowns = spec.count(Scope::PerRun);
    experiment.nuisance.iter().try_for_each(|n| equal("nuisance parameters of a run", n.len(), unknowns))?;
    for run in &experiment.runs {
        equal("inputs of a run", run.inputs.len(), recording.variables.len())?;
        run.inputs.iter().try_for_each(|column| equal("rows of an input", column.len(), run.len()))?;
    }
    Ok(())
}
