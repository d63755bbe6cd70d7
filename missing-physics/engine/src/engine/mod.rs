//! The diagnosis from end to end.

pub(crate) mod begin;
mod between_runs;
mod conclusion;
mod course;
mod input;
mod local;
pub mod stream;
mod windows;

use crate::adequacy::outliers::Place;
use crate::data::Recording;
use crate::diagnosis::{Contradiction, Diagnosis, Verdict};
use crate::model::{Experiment, Model};
use crate::observer::Observer;
use crate::runs::contradicting::Contradicting;
use begin::{begin, least_squares_baseline};
use course::{Course, End, Outcome, tell};
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
    experiments.iter().try_for_each(|e| check_experiment(model.spec(), recording, e))?;
    let Outcome { mut diagnosis, contradicting, .. } =
        outcome(model, recording, experiments, options, observer)?;
    if let Some(Contradicting { runs, share }) = contradicting {
        tell(observer, "the answer without the runs that contradict the rest", 0.0)?;
        let mut rest = recording.clone();
        let mut contradicting = Vec::new();
        for run in runs.iter().rev() {
            contradicting.insert(0, rest.runs.remove(*run).label);
        }
        // Without those runs nothing may be left to tell, which is no failure of the whole.
        let without = match outcome(model, &rest, &[], options, observer) {
            Err(DiagnoseError::Stopped) => return Err(DiagnoseError::Stopped),
            without => without.ok().map(|without| without.diagnosis),
        };
        diagnosis.contradiction = without
            .filter(|without| says(without.verdict) > says(diagnosis.verdict))
            .map(|without| contradiction(contradicting, share, without));
    }
    if let Some(windowed) = model.extensions().windows {
        windows::join(&mut diagnosis, recording, windowed);
    }
    tell(observer, "done", 1.0)?;
    Ok(diagnosis)
}

/// How often a recording is diagnosed again with readings that its answer foretells.
const KEPT_ANEW: usize = 2;

/// One diagnosis of all runs of a recording.
fn outcome(
    model: &dyn Model,
    recording: &Recording,
    experiments: &[Experiment],
    options: &Options,
    observer: &dyn Observer,
) -> Result<Outcome, DiagnoseError> {
    // What is wild beside the baseline may be no more than what an explanation says it should be.
    let mut kept: Vec<Place> = Vec::new();
    let mut again = 0;
    loop {
        tell(observer, "reading the noise", 0.0)?;
        let begun = begin(model, recording, options, &kept)?;
        let least_squares = &least_squares_baseline(&begun)?;
        let may_keep = again < KEPT_ANEW;
        match (Course { begun: &begun, least_squares, experiments, options, observer, may_keep }).run()? {
            End::Answer(outcome) => return Ok(*outcome),
            End::Foretold(readings) => kept.extend(readings),
        }
        again += 1;
    }
}

/// How much a verdict says.
fn says(verdict: Verdict) -> usize {
    match verdict {
        Verdict::Unexplained => 0,
        Verdict::Partly => 1,
        Verdict::Ambiguous => 2,
        Verdict::Explained | Verdict::Adequate => 3,
    }
}

fn contradiction(runs: Vec<String>, share: f64, without: Diagnosis) -> Contradiction {
    let Diagnosis { verdict, chosen, confused_with, mechanisms, .. } = without;
    let of_chosen = mechanisms.into_iter().filter(|m| chosen.contains(&m.id));
    let parameters = of_chosen.flat_map(|m| m.parameters).collect();
    Contradiction { runs, share, verdict, chosen, confused_with, parameters }
}
