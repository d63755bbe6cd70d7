//! A law that was found, and what it must achieve.

use crate::diagnosis::Law;
use crate::fit::optimum::Fit;
use crate::problem::Problem;
use crate::repaired::Repaired;
use crate::selection::candidate::Candidate;
use crate::selection::held_out::HeldOut;

/// A law must gain this much log score on unseen data.
pub(crate) const LEAST_GAIN: f64 = 5.0;
/// A law must lower the error on some channel at least by this factor.
const LEAST_IMPROVEMENT: f64 = 0.9;

/// A law and the model that holds it.
pub(crate) struct Found {
    pub(crate) law: Law,
    /// Predictions with the law, `[run][channel][row]`.
    pub(crate) predictions: Vec<Vec<Vec<f64>>>,
    pub(crate) held_out: HeldOut,
    pub(crate) fit: Fit,
    pub(crate) repaired: Repaired,
    /// The model with it, where it is of the model's own terms.
    pub(crate) of_terms: Option<Candidate>,
}

/// Whether a law predicts unseen data well enough better.
pub(crate) fn improves(seen: &HeldOut, law: &HeldOut) -> bool {
    law.log_score - seen.log_score >= LEAST_GAIN
        && law.rmse.iter().zip(&seen.rmse).any(|(with, without)| *with < LEAST_IMPROVEMENT * without)
        && law.rmse.iter().zip(&seen.rmse).all(|(with, without)| *with < 1.1 * without)
}

/// Errors on unseen data by channel: name, without the law, with it.
pub(crate) fn compared(problem: &Problem<'_>, before: &HeldOut, after: &HeldOut) -> Vec<(String, f64, f64)> {
    let names = problem.recording.channels.iter().map(|c| c.name.clone());
    names.zip(before.rmse.iter().zip(&after.rmse)).map(|(n, (b, a))| (n, *b, *a)).collect()
}
