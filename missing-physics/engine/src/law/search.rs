//! The search for a law, the simplest kind first.

use rayon::prelude::*;

use crate::fit::prediction::predictions;
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
    let places = || {
        let variables = 0..problem.recording.variables.len();
        (0..problem.channels())
            .flat_map(move |channel| variables.clone().map(move |variable| (channel, variable)))
    };
    let mut terms: Vec<Extended<'_>> =
        places().filter_map(|(channel, variable)| Extended::power(problem, channel, variable)).collect();
    let simulated = predictions(problem, &start.fit)?;
    terms.extend(
        (0..problem.channels()).filter_map(|channel| Extended::reading(problem, channel, &simulated)),
    );
    terms.extend(Extended::periodic(problem, &start.fit)?);
    terms.extend(places().filter_map(|(channel, variable)| Extended::smooth(problem, channel, variable)));
    let (of_terms, extended) = rayon::join(
        || sparse(problem, rule, start, seen),
        || -> Vec<_> { terms.par_iter().map(|term| extended(problem, rule, start, seen, term)).collect() },
    );
    let mut best: Option<Found> = None;
    for found in std::iter::once(of_terms).chain(extended) {
        // A more general kind must be clearly better than a simpler one.
        best = match (best, found?) {
            (Some(best), Some(found)) => {
                let better = found.held_out.log_score > best.held_out.log_score + LEAST_GAIN;
                Some(if better { found } else { best })
            }
            (best, found) => best.or(found),
        };
    }
    Ok(best)
}
