//! A set of mechanisms, fitted from several starts.

use crate::fit::alternate::{fit, fit_from};
use crate::fit::gauss_newton::{End, solve_until};
use crate::fit::optimum::Fit;
use crate::model::PredictError;
use crate::noise::rule::NoiseRule;
use crate::problem::{Problem, Selection};
use crate::selection::evidence::evidence;

/// Whole numbers that are less likely than the best by more than this logarithm (1 in 20) are ruled out.
const OPEN: f64 = 3.0;

/// Starts of one set, with the same whole numbers, that are fitted to the end.
const FINALISTS: usize = 3;
/// Steps after which those are chosen of more.
pub(crate) const HEAT: usize = 6;

/// A set of mechanisms, fitted.
#[derive(Debug, Clone)]
pub(crate) struct Candidate {
    /// Indices into the model's mechanisms, rising.
    pub(crate) set: Vec<usize>,
    pub(crate) selection: Selection,
    pub(crate) fit: Fit,
    /// Fits with other whole numbers (which row, which sensor) that the data leave open, likeliest first.
    pub(crate) alternative_modes: Vec<Fit>,
    /// Log marginal likelihood plus log prior odds of the set.
    pub(crate) evidence: f64,
    /// Why it is no explanation.
    pub(crate) ruled_out: Option<String>,
}

/// Values of shared parameters at which a fit begins: slots and values.
pub(crate) type Guess = Vec<(usize, f64)>;

/// Fits one set, from several starts.
pub(crate) fn candidate(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    set: &[usize],
    terms: &[usize],
    near: &Fit,
    guesses: &[Guess],
) -> Result<Candidate, PredictError> {
    let selection = problem.select(set, terms);
    let integers = problem.integer_slots(set);
    let mut near = without_others(problem, &selection, &integers, near);
    if problem.knows_many() {
        // What a neighbour leaves looks like correlated noise, and that makes of each row at which a joint may come to rest a minimum.
        near.noise.shape.fill(0);
    }
    let starts = starts(problem, &selection, &integers, &near, guesses);
    let mut fits = fits(problem, rule, &selection, &integers, &near, &starts)?;
    let likelihood = |fit: &Fit| likelihood(problem, rule, fit);
    fits.sort_by(|a, b| likelihood(b).total_cmp(&likelihood(a)));
    let mut alternative_modes = fits.split_off(1);
    let fit = fits.remove(0);
    alternative_modes.retain(|other| likelihood(other) > likelihood(&fit) - OPEN);
    let (evidence, ruled_out) = worth(problem, rule, (set, terms), &selection, &fit);
    Ok(Candidate { set: set.to_vec(), selection, fit, alternative_modes, evidence, ruled_out })
}

/// The log evidence of a fitted set with the prior weight of its noise, and why it is no explanation, if it is none.
fn worth(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    (set, terms): (&[usize], &[usize]),
    selection: &Selection,
    fit: &Fit,
) -> (f64, Option<String>) {
    let (evidence, ruled_out) = evidence(problem, set, terms, selection, fit);
    (evidence + log_prior(problem, rule, fit), ruled_out)
}

/// Takes the fit of a model that knows many mechanisms to its end, which no choice among sets has asked for.
pub(crate) fn finish(problem: &Problem<'_>, rule: &NoiseRule, candidate: &mut Candidate) {
    let Candidate { set, selection, fit, .. } = &*candidate;
    if !problem.knows_many() {
        return;
    }
    let (start, end) = ((&fit.shared[..], &fit.nuisance[..]), End::of(problem).finely());
    let Ok(fit) = solve_until(end, problem, selection, &fit.noise, start) else { return };
    (candidate.evidence, candidate.ruled_out) = worth(problem, rule, (set, &[]), selection, &fit);
    candidate.fit = fit;
}

/// A fit with everything off that a set has not.
pub(crate) fn without_more(problem: &Problem<'_>, set: &[usize], fit: &Fit) -> Fit {
    without_others(problem, &problem.select(set, &[]), &problem.integer_slots(set), fit)
}

/// A neighbour's fit: what it had on and this set does not is off again.
fn without_others(problem: &Problem<'_>, selection: &Selection, integers: &[usize], near: &Fit) -> Fit {
    let mut near = near.clone();
    for slot in (0..near.shared.len()).filter(|s| !selection.shared.contains(s) && !integers.contains(s)) {
        near.shared[slot] = problem.shared.start[slot];
    }
    for (run, nuisance) in near.nuisance.iter_mut().enumerate() {
        for slot in (0..nuisance.len()).filter(|s| !selection.nuisance.contains(s)) {
            nuisance[slot] = problem.nuisance_start[run][slot];
        }
    }
    near
}

/// Shared parameters at which fits begin: at the guesses, or where there is none with what was added off, or on a little to either
/// side.
fn starts(
    problem: &Problem<'_>,
    selection: &Selection,
    integers: &[usize],
    near: &Fit,
    guesses: &[Guess],
) -> Vec<Vec<f64>> {
    let mine = |slot: &usize| selection.shared.contains(slot) || integers.contains(slot);
    let mut starts: Vec<Vec<f64>> = Vec::new();
    for guess in guesses {
        let mut start = near.shared.clone();
        guess.iter().filter(|(slot, _)| mine(slot)).for_each(|&(slot, value)| start[slot] = value);
        starts.push(start);
    }
    if guesses.is_empty() {
        let table = &problem.shared;
        for side in [0.0, 0.3, -0.3] {
            let mut start = near.shared.clone();
            for slot in selection.added() {
                start[slot] = (table.start[slot] + side * table.scale[slot])
                    .clamp(table.lower[slot], table.upper[slot]);
            }
            if !starts.contains(&start) {
                starts.push(start);
            }
        }
    }
    starts
}

/// The best fit for each choice of whole numbers, one at least.
///
/// Sigmas of the baseline's fit are too large where it misses; a smaller one only sharpens the same surface. Between whole numbers
/// there is no surface: the best start with each of them is fitted with a noise of its own.
fn fits(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    selection: &Selection,
    integers: &[usize],
    near: &Fit,
    starts: &[Vec<f64>],
) -> Result<Vec<Fit>, PredictError> {
    let mut best_of: Vec<(Vec<f64>, Fit)> = Vec::new();
    let mut failure = None;
    let begun = begun(problem, selection, integers, near, starts);
    for (start, nuisance) in &begun {
        let numbers: Vec<f64> = integers.iter().map(|&slot| start[slot]).collect();
        match solve_until(End::of(problem).roughly(), problem, selection, &near.noise, (start, nuisance)) {
            Ok(fit) => match best_of.iter_mut().find(|(n, _)| *n == numbers) {
                Some((_, best)) if fit.chi2 < best.chi2 - 1e-9 => *best = fit,
                Some(_) => {}
                None => best_of.push((numbers, fit)),
            },
            Err(error) => failure = Some(error),
        }
    }
    let mut fits = Vec::new();
    for (_, best) in best_of {
        let fitted = if problem.knows_many() {
            fit_from(problem, selection, rule, &best)
        } else {
            fit(problem, selection, rule, (&best.shared, &best.nuisance), Some(&best.noise))
        };
        match fitted {
            Ok(fit) => fits.push(fit),
            Err(error) => failure = Some(error),
        }
    }
    if fits.is_empty() {
        let none = || PredictError { run: "(all)".into(), reason: "no start was possible".into() };
        return Err(failure.unwrap_or_else(none));
    }
    Ok(fits)
}

/// Where fits go on, shared and nuisance parameters: of many starts with the same whole numbers those that are best after some steps.
fn begun(
    problem: &Problem<'_>,
    selection: &Selection,
    integers: &[usize],
    near: &Fit,
    starts: &[Vec<f64>],
) -> Vec<(Vec<f64>, Vec<Vec<f64>>)> {
    let numbers = |start: &[f64]| -> Vec<f64> { integers.iter().map(|&slot| start[slot]).collect() };
    let mut by_numbers: Vec<(Vec<f64>, Vec<&Vec<f64>>)> = Vec::new();
    for start in starts {
        match by_numbers.iter_mut().find(|(n, _)| *n == numbers(start)) {
            Some((_, alike)) => alike.push(start),
            None => by_numbers.push((numbers(start), vec![start])),
        }
    }
    let mut begun = Vec::new();
    for (_, alike) in by_numbers {
        let begin = |start: &Vec<f64>| (start.clone(), near.nuisance.clone());
        if alike.len() <= FINALISTS {
            begun.extend(alike.into_iter().map(begin));
            continue;
        }
        let some = |start: &&Vec<f64>| {
            solve_until(End::after(HEAT), problem, selection, &near.noise, (start, &near.nuisance)).ok()
        };
        let mut fits: Vec<Fit> = alike.iter().filter_map(some).collect();
        if fits.is_empty() {
            // Why none of them is possible is said where one is fitted.
            begun.extend(alike.first().map(|start| begin(start)));
        }
        fits.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
        begun.extend(fits.into_iter().take(FINALISTS).map(|fit| (fit.shared, fit.nuisance)));
    }
    begun
}

impl Candidate {
    /// Whether a channel's noise is a slow error: correlated over a good part of a run, and large beside the white noise.
    pub(crate) fn slow(&self, problem: &Problem<'_>, white: &[f64]) -> bool {
        /// Part of a run over which noise of an instrument may be correlated.
        const LONG: f64 = 0.25;
        /// Times the white noise.
        const LARGE: f64 = 3.0;
        let noise = &self.fit.noise;
        (0..problem.channels()).any(|c| {
            let shape = problem.family.shape(noise.shape[c]);
            let rows = problem.count(c) as f64 / problem.rows.len().max(1) as f64;
            shape.correlated > 0.0 && shape.length_steps > LONG * rows && noise.sigma[c] > LARGE * white[c]
        })
    }

    /// Whether errors accumulate in its noise.
    pub(crate) fn accumulates(&self, problem: &Problem<'_>) -> bool {
        self.fit.noise.shape.iter().any(|&shape| problem.family.shape(shape).accumulated > 0.0)
    }

    /// Takes the place of a worse fit of this set: whole numbers that it left open stay so where they are likely still.
    pub(crate) fn in_place_of(mut self, worse: Self, problem: &Problem<'_>, rule: &NoiseRule) -> Self {
        let integers = problem.integer_slots(&self.set);
        let same = |a: &Fit, b: &Fit| integers.iter().all(|&slot| a.shared[slot] == b.shared[slot]);
        for other in std::iter::once(worse.fit).chain(worse.alternative_modes) {
            let known = same(&other, &self.fit) || self.alternative_modes.iter().any(|e| same(&other, e));
            if !known && likelihood(problem, rule, &other) > likelihood(problem, rule, &self.fit) - OPEN {
                self.alternative_modes.push(other);
            }
        }
        self
    }
}

/// Whether every parameter that `small` frees is also freed by `large`.
pub(crate) fn nested(small: &Candidate, large: &Candidate) -> bool {
    small.selection.shared.iter().all(|s| large.selection.shared.contains(s))
        && small.selection.nuisance.iter().all(|s| large.selection.nuisance.contains(s))
}

/// Log likelihood with the prior weight of the noise.
fn likelihood(problem: &Problem<'_>, rule: &NoiseRule, fit: &Fit) -> f64 {
    fit.log_likelihood + log_prior(problem, rule, fit)
}

/// Log prior weight of a fit's noise.
fn log_prior(problem: &Problem<'_>, rule: &NoiseRule, fit: &Fit) -> f64 {
    fit.noise.shape.iter().map(|&shape| rule.log_prior(problem, shape)).sum()
}
