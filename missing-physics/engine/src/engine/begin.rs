//! The beginning of every diagnosis.

use crate::adequacy::outliers::{Aside, Place, set_aside};
use crate::data::Recording;
use crate::diagnosis::Outlier;
use crate::engine::input::{DiagnoseError, Options, check};
use crate::fit::alternate::fit;
use crate::fit::gauss_newton::solve;
use crate::fit::optimum::Fit;
use crate::fit::prediction::predictions;
use crate::model::{Model, PredictError};
use crate::noise::rule::{NoiseRule, NoiseState, noise_rule};
use crate::problem::Problem;
use crate::selection::candidate::{Candidate, candidate};
use crate::statistics::median;

/// A reading within so many sigmas of what a fit of all others predicts is none that is wild.
const FORETOLD: f64 = 3.0;

/// A recording without its wild readings, and its baseline.
pub(crate) struct Begun<'a> {
    /// The recording without its wild readings.
    pub(crate) problem: Problem<'a>,
    /// These.
    pub(crate) aside: Vec<Aside>,
    pub(crate) rule: NoiseRule,
    pub(crate) baseline: Candidate,
    /// The first fit of the baseline.
    start: Fit,
}

/// Sets wild readings aside, but for those to be kept, finds what is known of the noise, and fits the baseline.
pub(crate) fn begin<'a>(
    model: &'a dyn Model,
    recording: &Recording,
    options: &Options,
    kept: &[Place],
) -> Result<Begun<'a>, DiagnoseError> {
    model.spec().check()?;
    check(recording, options)?;
    let problem = Problem::new(model, recording.clone());
    enough_rows(&problem)?;
    let (cleaned, aside) = set_aside(&problem, kept)?;
    let problem = Problem::new(model, cleaned);
    let rule = noise_rule(&problem);
    enough_rows(&problem)?;
    let selection = problem.select(&[], &[]);
    let start = fit(&problem, &selection, &rule, (&problem.shared.start, &problem.nuisance_start), None)?;
    let baseline = candidate(&problem, &rule, &[], &[], &start, &[])?;
    Ok(Begun { problem, aside, rule, baseline, start })
}

impl Begun<'_> {
    /// The readings that were set aside, as they are listed.
    pub(super) fn outliers(&self) -> Vec<Outlier> {
        let Recording { runs, channels, .. } = &self.problem.recording;
        let listed = |Aside { place: (run, channel, row), z, .. }: &Aside| Outlier {
            run: runs[*run].label.clone(),
            row: *row,
            channel: channels[*channel].name.clone(),
            z: *z,
        };
        self.aside.iter().map(listed).collect()
    }

    /// Those of them that a fit of all others foretells.
    pub(super) fn foretold(&self, fit: &Fit) -> Result<Vec<Place>, PredictError> {
        if self.aside.is_empty() {
            return Ok(Vec::new());
        }
        let predicted = predictions(&self.problem, fit)?;
        let near = |aside: &&Aside| {
            let (run, channel, row) = aside.place;
            (aside.reading - predicted[run][channel][row]).abs() < FORETOLD * fit.noise.sigma[channel]
        };
        Ok(self.aside.iter().filter(near).map(|aside| aside.place).collect())
    }
}

fn enough_rows(problem: &Problem<'_>) -> Result<(), DiagnoseError> {
    let (rows, parameters) = problem.size();
    if rows <= parameters { Err(DiagnoseError::TooFewRows { rows, parameters }) } else { Ok(()) }
}

/// What a plain least-squares simulation looks like beside the data: drawn, located and counted as "before".
pub(super) fn least_squares_baseline(begun: &Begun<'_>) -> Result<Candidate, PredictError> {
    let Begun { problem, rule, baseline, start, .. } = begun;
    let white = NoiseState { shape: vec![0; problem.channels()], sigma: rough_sigmas(problem, rule, start) };
    let fit = solve(problem, &baseline.selection, &white, &start.shared, &start.nuisance)?;
    Ok(Candidate { fit, ..baseline.clone() })
}

/// Sigma of each channel's rough part, whatever the model: what is left once everything smooth is taken away.
pub(super) fn rough_sigmas(problem: &Problem<'_>, rule: &NoiseRule, fallback: &Fit) -> Vec<f64> {
    (0..problem.channels())
        .map(|c| {
            rule.fixed_sigma[c]
                .or_else(|| median(&mut problem.rough_sigmas(c)))
                .map_or(fallback.noise.sigma[c], |s| s.max(rule.floor[c]))
        })
        .collect()
}
