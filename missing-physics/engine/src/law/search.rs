//! The search for a law, the simplest kind first.

use crate::law::describe::extended;
use crate::law::extended::Extended;
use crate::law::found::{Found, LEAST_GAIN};
use crate::law::sparse::sparse;
use crate::model::PredictError;
use crate::noise::rule::NoiseRule;
use crate::problem::Problem;
use crate::selection::candidate::Candidate;
use crate::selection::held_out::HeldOut;

/// Looks for a law beyond the mechanisms of `start`, whose prediction of unseen data is `seen`.
pub(crate) fn find(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    start: &Candidate,
    seen: &HeldOut,
) -> Result<Option<Found>, PredictError> {
    let mut best: Option<Found> = None;
    let mut consider = |found: Option<Found>| {
        if let Some(found) = found
            // A more general kind must be clearly better than a simpler one.
            && best.as_ref().is_none_or(|b| found.held_out.log_score > b.held_out.log_score + LEAST_GAIN)
        {
            best = Some(found);
        }
    };
    consider(sparse(problem, rule, start, seen)?);
    let places = || {
        let variables = 0..problem.recording.variables.len();
        (0..problem.channels())
            .flat_map(move |channel| variables.clone().map(move |variable| (channel, variable)))
    };
    for (channel, variable) in places() {
        if let Some(power) = Extended::power(problem, channel, variable) {
            consider(extended(problem, rule, start, seen, &power)?);
        }
    }
    if let Some(periodic) = Extended::periodic(problem, &start.fit)? {
        consider(extended(problem, rule, start, seen, &periodic)?);
    }
    for (channel, variable) in places() {
        if let Some(smooth) = Extended::smooth(problem, channel, variable) {
            consider(extended(problem, rule, start, seen, &smooth)?);
        }
    }
    Ok(best)
}
