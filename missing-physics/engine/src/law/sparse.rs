//! A law of a few of the model's candidate terms.

use rayon::prelude::*;

use crate::diagnosis::{Estimate, Law};
use crate::estimate::estimates::estimates;
use crate::fit::prediction::predictions;
use crate::law::added::AddedLaw;
use crate::law::found::{Found, LEAST_GAIN, compared, improves};
use crate::model::{PredictError, Quantity, Term};
use crate::noise::rule::NoiseRule;
use crate::problem::Problem;
use crate::repaired::Repaired;
use crate::selection::candidate::{Candidate, candidate};
use crate::selection::held_out::{HeldOut, held_out};

/// The largest number of terms.
const MOST_TERMS: usize = 3;

/// Forward selection among the model's candidate terms beside a set of mechanisms, each step judged on unseen data.
pub(crate) fn sparse(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    start: &Candidate,
    seen: &HeldOut,
) -> Result<Option<Found>, PredictError> {
    let (chosen, current) = selected(problem, rule, start, seen);
    let Some((fitted, score)) = current.filter(|(_, score)| improves(seen, score)) else { return Ok(None) };
    let spec = problem.spec();
    let terms: Vec<&Term> = chosen.iter().map(|&t| &spec.terms[t]).collect();
    let coefficients =
        estimates(problem, &fitted, &terms.iter().map(|t| t.parameter).collect::<Vec<_>>(), &[], rule, false);
    let parts = by_quantity(&terms, &coefficients);
    let mut variables: Vec<String> = terms.iter().flat_map(|t| t.variables.clone()).collect();
    variables.sort();
    variables.dedup();
    Ok(Some(Found {
        law: Law {
            formula: parts
                .iter()
                .map(|(to, sum)| format!("{} += {sum}", to.name))
                .collect::<Vec<_>>()
                .join("; "),
            kind: "sparse",
            beside: Vec::new(),
            adds_to: parts.first().map(|(to, _)| (to.name.clone(), to.unit.clone())).unwrap_or_default(),
            variables: variables.into_iter().map(|v| (v, String::new())).collect(),
            coefficients,
            heldout_rmse: compared(problem, seen, &score),
            heldout_log_score_gain: score.log_score - seen.log_score,
        },
        predictions: predictions(problem, &fitted.fit)?,
        held_out: score,
        repaired: Repaired { law: Some(AddedLaw::of_terms(spec, &terms)), ..Repaired::of(problem, &fitted) },
        fit: fitted.fit,
    }))
}

/// What terms add to each quantity, those of one quantity together.
fn by_quantity(terms: &[&Term], coefficients: &[Estimate]) -> Vec<(Quantity, String)> {
    let mut parts: Vec<(Quantity, String)> = Vec::new();
    for (term, coefficient) in terms.iter().zip(coefficients) {
        let unit = if coefficient.unit.is_empty() { String::new() } else { format!(" {}", coefficient.unit) };
        let product = format!("{:.4e}{unit} * {}", coefficient.value, term.formula);
        match parts.iter_mut().find(|(to, _)| *to == term.adds_to) {
            Some((_, sum)) => *sum = format!("{sum} + {product}"),
            None => parts.push((term.adds_to.clone(), product)),
        }
    }
    parts
}

/// The terms that forward selection chose, and their fit; none where the first gains nothing.
fn selected(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    start: &Candidate,
    seen: &HeldOut,
) -> (Vec<usize>, Option<(Candidate, HeldOut)>) {
    let spec = problem.spec();
    let mut chosen: Vec<usize> = Vec::new();
    let mut current: Option<(Candidate, HeldOut)> = None;
    while chosen.len() < MOST_TERMS {
        let tried: Vec<(usize, Candidate, HeldOut)> = (0..spec.terms.len())
            .into_par_iter()
            .filter(|t| !chosen.contains(t))
            .filter_map(|t| {
                let terms: Vec<usize> = chosen.iter().copied().chain([t]).collect();
                let near = current.as_ref().map_or(&start.fit, |c| &c.0.fit);
                let fitted = candidate(problem, rule, &start.set, &terms, near, &[vec![]]).ok()?;
                let score = held_out(problem, &fitted).ok()?;
                (fitted.ruled_out.is_none() && fitted.evidence.is_finite()).then_some((t, fitted, score))
            })
            .collect();
        let next = tried.into_iter().max_by(|a, b| a.2.log_score.total_cmp(&b.2.log_score));
        let bar = current.as_ref().map_or(seen.log_score, |c| c.1.log_score) + LEAST_GAIN;
        match next {
            Some((t, fitted, score)) if score.log_score > bar => {
                chosen.push(t);
                current = Some((fitted, score));
            }
            _ => break,
        }
    }
    (chosen, current)
}
