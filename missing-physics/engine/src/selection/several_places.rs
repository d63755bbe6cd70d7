//! Sets of more than three mechanisms: of three kinds, some of which act at several places (friction in each joint of an arm).

use rayon::prelude::*;

use crate::noise::rule::NoiseRule;
use crate::problem::Problem;
use crate::selection::candidate::{Candidate, candidate};
use crate::selection::parts::{MOST, without_the_rest};

/// Log Bayes factor by which each mechanism beyond three is needed.
pub(super) const NEEDED: f64 = 5.0;
/// The largest set tried.
pub(super) const MOST_MEMBERS: usize = 12;

impl Problem<'_> {
    /// Whether a set may have this mechanism too: it has not yet, and with it there are no more kinds than are tried.
    pub(crate) fn may_join(&self, set: &[usize], mechanism: usize) -> bool {
        let kind = |m: usize| self.spec().mechanisms[m].kind();
        let mut kinds: Vec<&str> = set.iter().copied().chain([mechanism]).map(kind).collect();
        kinds.sort_unstable();
        kinds.dedup();
        !set.contains(&mechanism) && kinds.len() <= MOST
    }
}

/// A set without each of its members in turn, of those that nobody has tried, fitted from where the whole set is.
pub(super) fn without_each(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    all: &[Candidate],
    whole: usize,
) -> Vec<Candidate> {
    let Candidate { set, fit: whole, .. } = &all[whole];
    let fitted = |member: &usize| {
        let part: Vec<usize> = set.iter().copied().filter(|m| m != member).collect();
        if problem.is_among(&part, all.iter().map(|c| &c.set)) {
            return None;
        }
        let some = without_the_rest(problem, &part, whole)?;
        candidate(problem, rule, &part, &[], &some, &[vec![]]).ok()
    };
    set.par_iter().filter_map(fitted).collect()
}
