//! A law of a few of the model's candidate terms.

use rayon::prelude::*;

use crate::diagnosis::{Estimate, Law};
use crate::estimate::estimates::estimates;
use crate::fit::optimum::Fit;
use crate::fit::prediction::predictions;
use crate::law::added::AddedLaw;
use crate::law::describe::number;
use crate::law::found::{Found, LEAST_GAIN, compared, improves};
use crate::model::{PredictError, Quantity, Term};
use crate::noise::rule::NoiseRule;
use crate::problem::Problem;
use crate::repaired::Repaired;
use crate::selection::candidate::{Candidate, candidate};
use crate::selection::held_out::{HeldOut, held_out};
use crate::selection::screening::after_one_step;

/// The largest number of terms.
const MOST_TERMS: usize = 3;
/// More terms than these are many: most would be fitted for nothing.
const MANY: usize = 16;
/// Terms that are fitted beside others, of those that promise most.
const MOST_FITTED: usize = 8;

/// A law of a few terms beside a set of mechanisms, and what it predicts of unseen data.
pub(crate) struct Sparse {
    terms: Vec<usize>,
    pub(crate) fitted: Candidate,
    pub(crate) score: HeldOut,
}

/// Forward selection among the model's candidate terms beside a set of mechanisms, to the largest number of terms, each step judged on unseen
/// data; where it predicts these better than the set, as what is told of it.
pub(crate) fn sparse(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    start: &Candidate,
    seen: &HeldOut,
) -> Result<Option<Found>, PredictError> {
    let law = selected(problem, rule, start, seen, MOST_TERMS).filter(|law| improves(seen, &law.score));
    law.map(|law| law.told(problem, rule, seen)).transpose()
}

impl Sparse {
    /// What is told of it, where a set without it predicts unseen data as `seen`.
    pub(crate) fn told(
        self,
        problem: &Problem<'_>,
        rule: &NoiseRule,
        seen: &HeldOut,
    ) -> Result<Found, PredictError> {
        let Self { terms, fitted, score } = self;
        let spec = problem.spec();
        let terms: Vec<&Term> = terms.iter().map(|&t| &spec.terms[t]).collect();
        let parameters: Vec<usize> = terms.iter().map(|t| t.parameter).collect();
        let coefficients = estimates(problem, &fitted, &parameters, &[], rule, false);
        let parts = by_quantity(&terms, &coefficients);
        let mut variables: Vec<String> = terms.iter().flat_map(|t| t.variables.clone()).collect();
        variables.sort();
        variables.dedup();
        let formulas: Vec<String> = parts.iter().map(|(to, sum)| format!("{} += {sum}", to.name)).collect();
        Ok(Found {
            law: Law {
                formula: formulas.join("; "),
                kind: "sparse",
                beside: Vec::new(),
                adds_to: parts.first().map(|(to, _)| (to.name.clone(), to.unit.clone())).unwrap_or_default(),
                variables: variables.into_iter().map(|v| (v, String::new())).collect(),
                coefficients,
                heldout_rmse: compared(problem, seen, &score),
                heldout_log_score_gain: score.log_score - seen.log_score,
                p_value: None,
            },
            predictions: predictions(problem, &fitted.fit)?,
            held_out: score,
            repaired: Repaired {
                law: Some(AddedLaw::of_terms(spec, &terms)),
                ..Repaired::of(problem, &fitted)
            },
            fit: fitted.fit.clone(),
            of_terms: Some(fitted),
        })
    }
}

/// The law of at most so many terms that forward selection ends at, without those that it needs no more; none where the first gains nothing.
pub(crate) fn selected(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    start: &Candidate,
    seen: &HeldOut,
    most: usize,
) -> Option<Sparse> {
    let spec = problem.spec();
    // The best of very many has to gain more.
    let least_gain = LEAST_GAIN + (spec.terms.len() as f64 / MANY as f64).max(1.0).ln();
    let fitted = |terms: Vec<usize>, from: &Fit| -> Option<Sparse> {
        let fitted = candidate(problem, rule, &start.set, &terms, from, &[vec![]]).ok()?;
        let score = held_out(problem, &fitted).ok()?;
        let sound = fitted.ruled_out.is_none() && fitted.evidence.is_finite();
        sound.then_some(Sparse { terms, fitted, score })
    };
    let best =
        |tried: Vec<Sparse>| tried.into_iter().max_by(|a, b| a.score.log_score.total_cmp(&b.score.log_score));
    let mut law: Option<Sparse> = None;
    while law.as_ref().is_none_or(|law| law.terms.len() < most) {
        let chosen = law.as_ref().map_or(&[][..], |law| &law.terms);
        let beside = law.as_ref().map_or(start, |law| &law.fitted);
        let others = (0..spec.terms.len()).filter(|t| !chosen.contains(t)).collect();
        let tried: Vec<Sparse> = promising(problem, beside, chosen, others)
            .into_par_iter()
            .filter_map(|t| fitted(chosen.iter().copied().chain([t]).collect(), &beside.fit))
            .collect();
        let bar = law.as_ref().map_or(seen.log_score, |law| law.score.log_score) + least_gain;
        match best(tried).filter(|best| best.score.log_score > bar) {
            Some(best) => law = Some(best),
            None => break,
        }
    }
    let mut law = law?;
    // The first terms may have stood in for later ones.
    while law.terms.len() > 1 {
        let without = |&term: &usize| {
            let terms = law.terms.iter().copied().filter(|t| *t != term).collect();
            fitted(terms, &law.fitted.fit)
        };
        let tried: Vec<Sparse> = law.terms.par_iter().filter_map(without).collect();
        match best(tried).filter(|best| best.score.log_score > law.score.log_score - least_gain) {
            Some(fewer) => law = fewer,
            None => break,
        }
    }
    Some(law)
}

/// Of many terms those whose first step of a fit, beside a set with some already, gains most.
fn promising(problem: &Problem<'_>, beside: &Candidate, chosen: &[usize], terms: Vec<usize>) -> Vec<usize> {
    if terms.len() <= MANY {
        return terms;
    }
    let left_after = |term: usize| {
        let terms: Vec<usize> = chosen.iter().copied().chain([term]).collect();
        let selection = problem.select(&beside.set, &terms);
        let at = (&beside.fit.shared[..], &beside.fit.nuisance[..]);
        let (left, _) = after_one_step(problem, &selection, &beside.fit.noise, at)?;
        Some((left, term))
    };
    let mut left: Vec<(f64, usize)> = terms.into_par_iter().filter_map(left_after).collect();
    left.sort_by(|a, b| a.0.total_cmp(&b.0));
    left.into_iter().take(MOST_FITTED).map(|(_, term)| term).collect()
}

/// What terms add to each quantity, those of one quantity together.
fn by_quantity(terms: &[&Term], coefficients: &[Estimate]) -> Vec<(Quantity, String)> {
    let mut parts: Vec<(Quantity, String)> = Vec::new();
    for (term, coefficient) in terms.iter().zip(coefficients) {
        let unit = if coefficient.unit.is_empty() { String::new() } else { format!(" {}", coefficient.unit) };
        let of = if term.formula == "1" { String::new() } else { format!(" * {}", term.formula) };
        let product = format!("{}{unit}{of}", number(coefficient.value));
        match parts.iter_mut().find(|(to, _)| *to == term.adds_to) {
            Some((_, sum)) => *sum = format!("{sum} + {product}"),
            None => parts.push((term.adds_to.clone(), product)),
        }
    }
    parts
}
