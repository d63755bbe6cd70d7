//! The diagnosis from end to end.

pub(crate) mod begin;
mod course;
mod input;

use crate::data::Recording;
use crate::diagnosis::Diagnosis;
use crate::model::{Experiment, Model};
use crate::observer::Observer;
use begin::{begin, least_squares_baseline};
use course::{Course, tell};
use input::check_experiment;

pub use input::{DiagnoseError, Options};

/// Diagnoses a recording: is the baseline adequate; if not, where does it miss, and which mechanisms explain it?
///
/// The same recording, options and machine give the same bits on any number of threads; work runs in rayon's current
/// pool. `experiments` are what the rig could do next.
///
/// # Errors
/// [`DiagnoseError`]; a verdict, whichever it is, is no error.
pub fn diagnose(
    model: &dyn Model,
    recording: &Recording,
    experiments: &[Experiment],
    options: &Options,
    observer: &dyn Observer,
) -> Result<Diagnosis, DiagnoseError> {
    let diagnosis = diagnose_with(model, recording, experiments, options, observer);
    // A simulation that broke half way leaves an answer that may rest on what it did not say.
    match model.extensions().program.and_then(|program| program.fatal_error()) {
        Some(error) => Err(error.into()),
        None => diagnosis,
    }
}

fn diagnose_with(
    model: &dyn Model,
    recording: &Recording,
    experiments: &[Experiment],
    options: &Options,
    observer: &dyn Observer,
) -> Result<Diagnosis, DiagnoseError> {
    tell(observer, "reading the noise", 0.0)?;
    experiments.iter().try_for_each(|e| check_experiment(model.spec(), recording, e))?;
    let begun = begin(model, recording, options)?;
    let least_squares = least_squares_baseline(&begun)?;
    Course { begun: &begun, least_squares: &least_squares, experiments, options, observer }.run()
}
