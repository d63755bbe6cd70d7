//! Whether the data speak for a cause that acts in a part of them only, rather than for mechanisms, which act everywhere.

use statrs::function::factorial::ln_binomial;

use crate::locate::locations::local_cause;
use crate::model::PredictError;
use crate::problem::Problem;
use crate::selection::candidate::Candidate;
use crate::selection::main_cause::Judge;

/// Twice the log Bayes factor from which on a local cause is preferred (Kass and Raftery 1995, doi:10.1080/01621459.1995.10476572, "very
/// strong").
const CLEAR: f64 = 10.0;

/// How many members of a set are left, where one unknown more that acts within an interval, or in some runs, takes away clearly more beside
/// those than the others do; `None` where none does.
///
/// All are judged by what they leave in units of white noise, less Schwarz's price of each size that is fitted and the logarithm of the number
/// of hypotheses of its kind. What is left beyond noise is noise of its size as well: it counts by its logarithm.
pub(super) fn beside_a_local_cause(
    problem: &Problem<'_>,
    baseline: &Candidate,
    all: &[Candidate],
    set: &Candidate,
    judge: &Judge<'_>,
    white: &[f64],
) -> Result<Option<usize>, PredictError> {
    let rows = (0..problem.channels()).map(|c| problem.count(c)).sum::<usize>() as f64;
    let counted = |squares: f64| {
        if squares > rows { rows * (1.0 + (squares / rows).ln()) } else { squares }
    };
    let price = |candidate: &Candidate| {
        let sizes = candidate.selection.shared.len().saturating_sub(baseline.selection.shared.len());
        let mechanisms = problem.spec().mechanisms.len() as u64;
        sizes as f64 * rows.ln() + 2.0 * ln_binomial(mechanisms, candidate.set.len() as u64)
    };
    let Some(plain) = judge.plain(&set.set) else { return Ok(None) };
    let most = counted(plain.chi2) + price(set) - CLEAR;
    let mut best: Option<(f64, usize)> = None;
    let part = |c: &&Candidate| c.set.len() < set.set.len() && c.set.iter().all(|m| set.set.contains(m));
    for part in all.iter().filter(part) {
        let Some(plain) = judge.plain(&part.set) else { continue };
        let Some(local) = local_cause(problem, &part.selection, plain, white)? else { continue };
        let left = counted((plain.chi2 - local.gain).max(1.0)) + price(part) + local.price;
        if left < best.map_or(most, |(best, _)| best) {
            best = Some((left, part.set.len()));
        }
    }
    Ok(best.map(|(_, members)| members))
}
