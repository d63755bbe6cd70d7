//! Sets that are parts of larger ones: what a larger set's fit says of them.

use rayon::prelude::*;

use crate::fit::gauss_newton::{End, linearise, solve_until};
use crate::fit::optimum::Fit;
use crate::noise::rule::NoiseRule;
use crate::problem::Problem;
use crate::selection::candidate::{Candidate, HEAT, candidate, without_more};

/// How many sets of one size are tried with one more mechanism.
pub(super) const BEAM: usize = 3;
/// The largest set of mechanisms of different kinds that is tried.
pub(super) const MOST: usize = 3;

/// The evidence of a set that is an explanation.
pub(super) fn worth(candidate: &Candidate) -> f64 {
    if candidate.ruled_out.is_none() { candidate.evidence } else { f64::NEG_INFINITY }
}

/// The most of it that one of several has.
pub(super) fn best_evidence<'a>(of: impl Iterator<Item = &'a Candidate>) -> f64 {
    of.map(worth).fold(f64::NEG_INFINITY, f64::max)
}

/// Where the likeliest of the sets stands, of those that are explanations.
pub(super) fn likeliest(all: &[Candidate]) -> Option<usize> {
    (0..all.len()).max_by(|&a, &b| worth(&all[a]).total_cmp(&worth(&all[b])))
}

/// The fit of a larger set some steps on, without what a part of it has not.
pub(super) fn without_the_rest(problem: &Problem<'_>, part: &[usize], whole: &Fit) -> Option<Fit> {
    let begins = without_more(problem, part, whole);
    let selection = problem.select(part, &[]);
    let start = (&begins.shared[..], &begins.nuisance[..]);
    solve_until(End::after(HEAT), problem, &selection, &whole.noise, start).ok()
}

/// Sets that nobody has tried, and of which a larger one says that they are better than all that were: it has a member that does next to
/// nothing, which brought the others together.
pub(super) fn unknown_parts(problem: &Problem<'_>, rule: &NoiseRule, all: &[Candidate]) -> Vec<Candidate> {
    let best = best_evidence(all.iter());
    let mut wholes: Vec<&Candidate> = all.iter().filter(|c| (2..=MOST).contains(&c.set.len())).collect();
    wholes.sort_by(|a, b| b.fit.log_likelihood.total_cmp(&a.fit.log_likelihood));
    wholes.truncate(BEAM);
    let mut parts: Vec<(Vec<usize>, &Candidate)> = Vec::new();
    for whole in wholes {
        // Every part but nothing and the whole, as the bits of a number say.
        for bits in 1..(1_usize << whole.set.len()) - 1 {
            let within = |k: &usize| bits & (1 << k) != 0;
            let part: Vec<usize> = (0..whole.set.len()).filter(within).map(|k| whole.set[k]).collect();
            if !problem.is_among(&part, all.iter().map(|c| &c.set).chain(parts.iter().map(|(p, _)| p))) {
                parts.push((part, whole));
            }
        }
    }
    let fitted = |(part, whole): &(Vec<usize>, &Candidate)| {
        let some = without_the_rest(problem, part, &whole.fit)?;
        let promised = whole.fit.log_likelihood - 0.5 * (some.chi2 - whole.fit.chi2);
        (promised > best).then(|| candidate(problem, rule, part, &[], &some, &[vec![]]).ok())?
    };
    parts.par_iter().filter_map(fitted).collect()
}

/// Fits sets again from the fits of larger ones, where these leave less with the member off that they have more.
///
/// A set that is stuck in a local minimum is left by a member that hardly does anything, which would then be named.
pub(super) fn from_larger(problem: &Problem<'_>, rule: &NoiseRule, all: &mut [Candidate]) {
    for size in (2..=MOST).rev() {
        let mut larger: Vec<usize> = (0..all.len())
            .filter(|&i| {
                all[i].set.len() == size && all[i].evidence.is_finite() && all[i].ruled_out.is_none()
            })
            .collect();
        larger.sort_by(|&a, &b| all[b].evidence.total_cmp(&all[a].evidence));
        larger.truncate(BEAM);
        let known: &[Candidate] = all;
        let parts: Vec<(usize, usize)> = larger
            .iter()
            .flat_map(|&whole| {
                let is_part = move |part: &usize| {
                    let set = &known[*part].set;
                    set.len() + 1 == size && set.iter().all(|m| known[whole].set.contains(m))
                };
                (0..known.len()).filter(is_part).map(move |part| (part, whole))
            })
            .collect();
        let again = |&(part, whole): &(usize, usize)| -> Option<(usize, Candidate)> {
            let (part_of, whole) = (&known[part], &known[whole]);
            (whole.evidence > part_of.evidence).then_some(())?;
            let (selection, noise) = (&part_of.selection, &whole.fit.noise);
            let some = without_the_rest(problem, &part_of.set, &whole.fit)?;
            let stuck = linearise(problem, selection, noise, &part_of.fit.shared, &part_of.fit.nuisance);
            stuck.is_ok_and(|stuck| some.chi2 < stuck.chi2).then_some(())?;
            let found = candidate(problem, rule, &part_of.set, &[], &some, &[vec![]]).ok()?;
            (found.evidence > part_of.evidence).then_some((part, found))
        };
        let found: Vec<(usize, Candidate)> = parts.par_iter().filter_map(again).collect();
        for (part, better) in found {
            if better.evidence > all[part].evidence {
                all[part] = better.in_place_of(all[part].clone(), problem, rule);
            }
        }
    }
}
