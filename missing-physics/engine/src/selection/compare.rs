//! Which mechanisms have to be on: evidence of sets of mechanisms, and how well each predicts what it has not seen.

use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::adequacy::linearised::Linearised;
use crate::adequacy::test::{draw, residuals};
use crate::data::Recording;
use crate::estimate::estimates::better_top;
use crate::fit::gauss_newton::{Fit, NoiseRule, NoiseState, UNDETERMINED, covariance, fit, solve};
use crate::linalg::{cholesky, log_determinant};
use crate::model::PredictError;
use crate::problem::{Problem, Selection};
use crate::selection::nuisance_prior;

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

/// Log prior odds of each further mechanism.
const LOG_PRIOR_ODDS: f64 = -1.5;
/// A mechanism's strength is thought equally likely on a log scale over this many e-folds.
pub(crate) const LOG_RANGE: f64 = 9.21;
/// How many sets of one size are tried with one more mechanism.
const BEAM: usize = 3;
/// Standard deviation of a shared parameter's prior where unseen data are predicted, in units of its scale.
const WIDE: f64 = 10.0;
/// Whole numbers that are less likely than the best by more than this logarithm (1 in 20) are ruled out.
const OPEN: f64 = 3.0;
/// Sets within this log evidence of the best may become it once their best top is found.
const POLISHED: f64 = 6.0;
/// The largest set tried.
const MOST: usize = 3;

/// Fits one set, from several starts.
pub(crate) fn candidate(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    set: &[usize],
    terms: &[usize],
    near: &Fit,
    guesses: &[Vec<(usize, f64)>],
) -> Result<Candidate, PredictError> {
    let selection = problem.select(set, terms);
    let added: Vec<usize> =
        selection.shared.iter().zip(&selection.added_shared).filter(|(_, a)| **a).map(|(s, _)| *s).collect();
    // What the neighbour had on and this set does not is off again.
    let mut near = near.clone();
    let integers = problem.integer_slots(set);
    for slot in (0..near.shared.len()).filter(|s| !selection.shared.contains(s) && !integers.contains(s)) {
        near.shared[slot] = problem.shared.start[slot];
    }
    for (run, nuisance) in near.nuisance.iter_mut().enumerate() {
        for slot in (0..nuisance.len()).filter(|s| !selection.nuisance.contains(s)) {
            nuisance[slot] = problem.nuisance_start[run][slot];
        }
    }
    let mut starts: Vec<Vec<f64>> = Vec::new();
    for guess in guesses {
        let mut start = near.shared.clone();
        let mine = |slot: &usize| selection.shared.contains(slot) || integers.contains(slot);
        guess.iter().filter(|(slot, _)| mine(slot)).for_each(|&(slot, value)| start[slot] = value);
        starts.push(start);
    }
    if guesses.is_empty() {
        for side in [0.0, 0.3, -0.3] {
            let mut start = near.shared.clone();
            for &slot in &added {
                let table = &problem.shared;
                start[slot] = (table.start[slot] + side * table.scale[slot])
                    .clamp(table.lower[slot], table.upper[slot]);
            }
            if !starts.contains(&start) {
                starts.push(start);
            }
        }
    }
    // Sigmas of the baseline's fit are too large where it misses; a smaller one only sharpens the same surface. Between whole numbers
    // there is no surface: the best start with each of them is fitted with a noise of its own.
    let mut tops: Vec<(Vec<f64>, Fit)> = Vec::new();
    let mut failure = None;
    for start in &starts {
        let numbers: Vec<f64> = integers.iter().map(|&slot| start[slot]).collect();
        match solve(problem, &selection, &near.noise, start, &near.nuisance) {
            Ok(fit) => match tops.iter_mut().find(|(n, _)| *n == numbers) {
                Some((_, best)) if fit.chi2 < best.chi2 - 1e-9 => *best = fit,
                Some(_) => {}
                None => tops.push((numbers, fit)),
            },
            Err(error) => failure = Some(error),
        }
    }
    let mut fits = Vec::new();
    for (_, top) in tops {
        match fit(problem, &selection, rule, (&top.shared, &top.nuisance), Some(&top.noise)) {
            Ok(fit) => fits.push(fit),
            Err(error) => failure = Some(error),
        }
    }
    let likelihood = |fit: &Fit| likelihood(problem, rule, fit);
    fits.sort_by(|a, b| likelihood(b).total_cmp(&likelihood(a)));
    if fits.is_empty() {
        return Err(
            failure.unwrap_or(PredictError { run: "(all)".into(), reason: "no start was possible".into() })
        );
    }
    let mut alternative_modes = fits.split_off(1);
    let fit = fits.remove(0);
    alternative_modes.retain(|other| likelihood(other) > likelihood(&fit) - OPEN);
    let (mut evidence, ruled_out) = evidence(problem, set, terms, &selection, &fit);
    evidence += log_prior(problem, rule, &fit);
    Ok(Candidate { set: set.to_vec(), selection, fit, alternative_modes, evidence, ruled_out })
}

impl Candidate {
    /// The same set better fitted from another start: whole numbers that were open stay so where they are likely still.
    fn in_place_of(mut self, worse: Self, problem: &Problem<'_>, rule: &NoiseRule) -> Self {
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

/// Log likelihood with the prior weight of the noise.
fn likelihood(problem: &Problem<'_>, rule: &NoiseRule, fit: &Fit) -> f64 {
    fit.log_likelihood + log_prior(problem, rule, fit)
}

/// Log prior weight of a fit's noise.
fn log_prior(problem: &Problem<'_>, rule: &NoiseRule, fit: &Fit) -> f64 {
    fit.noise.shape.iter().map(|&shape| rule.log_prior(problem, shape)).sum()
}

/// Laplace's approximation of the marginal likelihood, and whether the fit is physical.
fn evidence(
    problem: &Problem<'_>,
    set: &[usize],
    terms: &[usize],
    selection: &Selection,
    fit: &Fit,
) -> (f64, Option<String>) {
    let name = |slot: usize| problem.spec().parameters[problem.shared.index[slot]].name.clone();
    let added: Vec<usize> = (0..selection.shared.len()).filter(|&i| selection.added_shared[i]).collect();
    let bound = added.iter().map(|&i| selection.shared[i]).find(|slot| fit.at_bound.contains(slot));
    let covariance = covariance(&fit.information);
    if added.iter().any(|&i| !covariance[(i, i)].is_finite()) {
        return (f64::NEG_INFINITY, Some("these data do not determine it".into()));
    }
    let mut value = marginal(problem, selection, fit, &fit.information);
    for slot in problem.integer_slots(set) {
        value -= (problem.shared.upper[slot] - problem.shared.lower[slot] + 1.0).ln();
    }
    // Each free parameter's prior belongs to the first mechanism or term that frees it.
    let mut taken: Vec<usize> = Vec::new();
    let spec = problem.spec();
    let groups = set
        .iter()
        .map(|&m| {
            spec.mechanisms[m].parameters.iter().chain(&spec.mechanisms[m].companions).copied().collect()
        })
        .chain(terms.iter().map(|&t| vec![spec.terms[t].parameter]));
    for (order, group) in groups.enumerate() {
        let group: Vec<usize> = group;
        let mine: Vec<usize> = added
            .iter()
            .copied()
            .filter(|i| {
                let slot = selection.shared[*i];
                group.contains(&problem.shared.index[slot]) && !taken.contains(i)
            })
            .collect();
        taken.extend(&mine);
        value += LOG_PRIOR_ODDS;
        if mine.is_empty() {
            continue;
        }
        let shapes = &set.get(order).map_or(&[][..], |&m| &spec.mechanisms[m].shape_parameters);
        let is_shape = |i: &usize| shapes.contains(&problem.shared.index[selection.shared[*i]]);
        let (shapes, mine): (Vec<usize>, Vec<usize>) = mine.into_iter().partition(is_shape);
        for i in shapes {
            let slot = selection.shared[i];
            let (low, high, x) = (problem.shared.lower[slot], problem.shared.upper[slot], fit.shared[slot]);
            value -= if low > 0.0 { ((high / low).ln() * x).ln() } else { (high - low).ln() };
        }
        if mine.is_empty() {
            continue;
        }
        let dimension = mine.len() as f64;
        let mut square = 0.0;
        let mut one_sided = false;
        for &i in &mine {
            let slot = selection.shared[i];
            let scale = problem.shared.scale[slot];
            square += ((fit.shared[slot] - problem.shared.start[slot]).powi(2) + covariance[(i, i)])
                / (scale * scale);
            value -= scale.ln();
            one_sided |= problem.shared.lower[slot] >= problem.shared.start[slot];
        }
        let sphere = 2.0 * std::f64::consts::PI.powf(dimension / 2.0)
            / statrs::function::gamma::gamma(dimension / 2.0);
        let sphere = if one_sided { 0.5 * sphere } else { sphere };
        value -= sphere.ln() + dimension * 0.5 * square.ln() + LOG_RANGE.ln();
    }
    let senseless = || {
        let limits = problem.model.extensions().limits?;
        set.iter().find_map(|&mechanism| limits.implausible(mechanism, &fit.shared))
    };
    let ruled_out = bound
        .map(|slot| format!("{} ended at its bound of {}", name(slot), fit.shared[slot]))
        .or_else(senseless)
        .or_else(|| (!fit.converged).then(|| "its fit did not converge".to_owned()));
    (value, ruled_out)
}

/// Log likelihood with the parameters of runs and all runs integrated out, before what the prior of the latter says.
fn marginal(problem: &Problem<'_>, selection: &Selection, fit: &Fit, information: &DMatrix<f64>) -> f64 {
    let mut factor = information.clone();
    let kept = cholesky(&mut factor, UNDETERMINED);
    let volume = kept.iter().filter(|k| **k).count() as f64 * std::f64::consts::TAU.ln();
    let nuisance = (0..selection.nuisance.len()).filter(|&i| selection.added_nuisance[i]);
    fit.log_likelihood + 0.5 * (volume - log_determinant(&factor, &kept))
        - nuisance.map(|i| nuisance_prior::cost(problem, selection, fit, i)).sum::<f64>()
}

/// The same with so wide a normal prior of the shared parameters that no data are needed to bound them.
fn bounded_marginal(problem: &Problem<'_>, selection: &Selection, fit: &Fit) -> f64 {
    let mut information = fit.information.clone();
    for (i, &slot) in selection.shared.iter().enumerate() {
        information[(i, i)] += (WIDE * problem.shared.scale[slot]).powi(-2);
    }
    marginal(problem, selection, fit, &information)
}

/// Tries sets of mechanisms: each alone, then the best ones with one more, to three.
pub(crate) fn search(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    baseline: Candidate,
    allowed: &[usize],
    tell: &(dyn Fn(f64) -> bool + Sync),
) -> Option<Vec<Candidate>> {
    let mut all = vec![baseline];
    let mut layer: Vec<usize> = vec![0];
    for size in 1..=MOST {
        let mut wanted: Vec<(Vec<usize>, usize)> = Vec::new();
        for &parent in &layer {
            for &m in allowed {
                let mut set = all[parent].set.clone();
                if !set.contains(&m) {
                    set.push(m);
                    set.sort_unstable();
                    if !wanted.iter().any(|(s, _)| *s == set) {
                        wanted.push((set, parent));
                    }
                }
            }
        }
        let fitted: Vec<Candidate> = wanted
            .par_iter()
            .filter_map(|(set, parent)| {
                let parent = &all[*parent];
                let guesses = guesses(problem, parent, set);
                let mut found = candidate(problem, rule, set, &[], &parent.fit, &guesses).ok();
                let hints = hints(problem, &all, set);
                if size > 1
                    && let Ok(other) = candidate(problem, rule, set, &[], &parent.fit, &[hints])
                    && found.as_ref().is_none_or(|f| other.fit.log_likelihood > f.fit.log_likelihood + 1e-6)
                {
                    found = Some(match found {
                        Some(worse) => other.in_place_of(worse, problem, rule),
                        None => other,
                    });
                }
                found
            })
            .collect();
        if !tell(size as f64 / MOST as f64) {
            return None;
        }
        let before = best_evidence(&all);
        let first = all.len();
        all.extend(fitted);
        let mut order: Vec<usize> = (first..all.len()).filter(|&i| all[i].evidence.is_finite()).collect();
        order.sort_by(|&a, &b| all[b].evidence.total_cmp(&all[a].evidence));
        if size > 1 && best_evidence(&all) <= before {
            break;
        }
        order.truncate(BEAM);
        layer = order;
    }
    polish(problem, rule, &mut all);
    Some(all)
}

/// Looks for better tops of the likelihood of the sets that are likeliest, and takes them.
fn polish(problem: &Problem<'_>, rule: &NoiseRule, all: &mut [Candidate]) {
    let best = best_evidence(all);
    let worth =
        |c: &&mut Candidate| c.ruled_out.is_none() && !c.set.is_empty() && c.evidence > best - POLISHED;
    let mut likely: Vec<&mut Candidate> = all.iter_mut().filter(worth).collect();
    likely.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    likely.truncate(BEAM);
    likely.par_iter_mut().for_each(|c| {
        for _ in 0..BEAM {
            let Some(top) = better_top(problem, c) else { break };
            match candidate(problem, rule, &c.set, &[], &top, &[vec![]]) {
                Ok(better) if better.evidence > c.evidence => {
                    **c = better.in_place_of(c.clone(), problem, rule);
                }
                _ => break,
            }
        }
    });
}

fn best_evidence(all: &[Candidate]) -> f64 {
    all.iter().filter(|c| c.ruled_out.is_none()).map(|c| c.evidence).fold(f64::NEG_INFINITY, f64::max)
}

/// Where the model says to begin the mechanism that a set has and its parent has not, with all whole numbers that it knows for those
/// of the others: what was the best of them alone need not be so in company.
fn guesses(problem: &Problem<'_>, parent: &Candidate, set: &[usize]) -> Vec<Vec<(usize, f64)>> {
    let Some(modes) = problem.model.extensions().modes else { return Vec::new() };
    let Ok(left) = residuals(problem, &parent.fit) else { return Vec::new() };
    let whole: Vec<Vec<Vec<f64>>> = left
        .into_iter()
        .zip(&problem.rows)
        .zip(&problem.recording.runs)
        .map(|((channels, rows), run)| {
            let spread = |(values, valid): (Vec<f64>, &Vec<usize>)| {
                let mut column = vec![f64::NAN; run.len()];
                valid.iter().zip(values).for_each(|(&i, v)| column[i] = v);
                column
            };
            channels.into_iter().zip(&rows.valid).map(spread).collect()
        })
        .collect();
    let shared = |p: usize| problem.shared.index.iter().position(|&i| i == p);
    let mut all: Vec<Vec<(usize, f64)>> = Vec::new();
    for &mechanism in set {
        let integers = problem.integer_slots(&[mechanism]);
        let new = !parent.set.contains(&mechanism);
        if !new && integers.is_empty() {
            continue;
        }
        let mut starts: Vec<Vec<(usize, f64)>> = Vec::new();
        for start in modes.starts(mechanism, &problem.recording.runs, &whole) {
            let of_it = start.into_iter().filter_map(|(p, value)| Some((shared(p)?, value)));
            let start: Vec<_> = of_it.filter(|(slot, _)| new || integers.contains(slot)).collect();
            if !start.is_empty() && !starts.contains(&start) {
                starts.push(start);
            }
        }
        if all.is_empty() {
            all = starts;
        } else if !starts.is_empty() {
            all = all.iter().flat_map(|a| starts.iter().map(|b| [&a[..], b].concat())).collect();
        }
    }
    all
}

/// Values of a set's parameters from the fits of its members alone.
fn hints(problem: &Problem<'_>, all: &[Candidate], set: &[usize]) -> Vec<(usize, f64)> {
    let mut hints = Vec::new();
    for &m in set {
        let Some(single) = all.iter().find(|c| c.set == [m]) else { continue };
        let mechanism = &problem.spec().mechanisms[m];
        for &p in mechanism.parameters.iter().chain(&mechanism.companions) {
            if let Some(slot) = problem.shared.index.iter().position(|&i| i == p) {
                hints.push((slot, single.fit.shared[slot]));
            }
        }
    }
    hints
}

/// Whether every parameter that `small` frees is also freed by `large`.
pub(crate) fn nested(small: &Candidate, large: &Candidate) -> bool {
    small.selection.shared.iter().all(|s| large.selection.shared.contains(s))
        && small.selection.nuisance.iter().all(|s| large.selection.nuisance.contains(s))
}

/// What a fit predicts of data that it has not seen.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct HeldOut {
    /// Log density of the unseen data.
    pub(crate) log_score: f64,
    /// Root mean square error, by channel.
    pub(crate) rmse: Vec<f64>,
}

/// Leaves out each run (or each of five groups of runs) in turn; a single run's end is predicted from its beginning.
///
/// The density of unseen data is the ratio of two marginal likelihoods, with and without them (Dawid 1984,
/// doi:10.2307/2981683): what the seen data leave open counts. With the best values alone in its place, an effect that half
/// of a recording cannot size loses to a baseline whose noise is as large as its misfit.
pub(crate) fn held_out(problem: &Problem<'_>, candidate: &Candidate) -> Result<HeldOut, PredictError> {
    let runs = problem.recording.runs.len();
    let mut squares = vec![(0.0, 0usize); problem.channels()];
    let mut log_score = 0.0;
    let mut add = |residual: &[Vec<Vec<f64>>], keep: &dyn Fn(usize, usize, usize) -> bool| {
        for (r, row) in residual.iter().enumerate() {
            for (c, column) in row.iter().enumerate() {
                for (i, v) in column.iter().enumerate().filter(|(i, _)| keep(r, c, *i)) {
                    let _ = i;
                    squares[c].0 += v * v;
                    squares[c].1 += 1;
                }
            }
        }
    };
    let none = Selection { shared: Vec::new(), added_shared: Vec::new(), ..candidate.selection.clone() };
    let noise = &candidate.fit.noise;
    let whole = bounded_marginal(problem, &candidate.selection, &candidate.fit);
    if runs > 1 {
        let folds = runs.min(5);
        for fold in 0..folds {
            let part = |inside: bool| -> Vec<usize> {
                (0..runs).filter(|r| (r % folds == fold) == inside).collect()
            };
            let (test, train) = (part(true), part(false));
            let pick = |ids: &[usize]| -> (Recording, Vec<Vec<f64>>) {
                let mut recording = problem.recording.clone();
                recording.runs = ids.iter().map(|&r| problem.recording.runs[r].clone()).collect();
                (recording, ids.iter().map(|&r| candidate.fit.nuisance[r].clone()).collect())
            };
            let (recording, nuisance) = pick(&train);
            let seen = problem.with(recording);
            let trained = solve(&seen, &candidate.selection, noise, &candidate.fit.shared, &nuisance)?;
            let (recording, nuisance) = pick(&test);
            let unseen = problem.with(recording);
            let tested = solve(&unseen, &none, noise, &trained.shared, &nuisance)?;
            log_score += whole - bounded_marginal(&seen, &candidate.selection, &trained);
            add(&residuals(&unseen, &tested)?, &|_, _, _| true);
        }
    } else {
        let rows = problem.recording.runs[0].len();
        for (seen, until) in [(rows / 2, rows * 3 / 4), (rows * 3 / 4, rows)] {
            let cut = |end: usize| {
                let mut recording = problem.recording.clone();
                for column in &mut recording.runs[0].outputs {
                    column[end..].fill(f64::NAN);
                }
                problem.with(recording)
            };
            let (begin, both) = (cut(seen), cut(until));
            let trained =
                solve(&begin, &candidate.selection, noise, &candidate.fit.shared, &candidate.fit.nuisance)?;
            let known = solve(&begin, &none, noise, &trained.shared, &trained.nuisance)?;
            let longer = solve(&both, &candidate.selection, noise, &trained.shared, &trained.nuisance)?;
            log_score += bounded_marginal(&both, &candidate.selection, &longer)
                - bounded_marginal(&begin, &candidate.selection, &trained);
            let valid = &both.rows[0].valid;
            add(&residuals(&both, &known)?, &|_, c, i| valid[c][i] >= seen);
        }
    }
    let rmse = squares.iter().map(|(sum, n)| (sum / (*n).max(1) as f64).sqrt()).collect();
    Ok(HeldOut { log_score, rmse })
}

/// `matrix[i][j]`: how often data simulated from rival `i` favour rival `j`.
pub(crate) fn confusion(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    rivals: &[&Candidate],
    draws: usize,
    seed: u64,
) -> Result<Vec<Vec<f64>>, PredictError> {
    let mut shapes: Vec<usize> =
        rivals.iter().flat_map(|r| r.fit.noise.shape.iter().copied()).chain([0]).collect();
    shapes.sort_unstable();
    shapes.dedup();
    let mut models = Vec::with_capacity(rivals.len());
    let mut constants = Vec::with_capacity(rivals.len());
    let mut residuals_of = Vec::with_capacity(rivals.len());
    for rival in rivals {
        let mut linearised =
            Linearised::new(problem, &rival.selection, &rival.fit, &[], rule)?.without_alternatives();
        linearised.play(&shapes);
        let residual = residuals(problem, &rival.fit)?;
        constants.push(rival.evidence - linearised.read(&residual).score);
        models.push(linearised);
        residuals_of.push(residual);
    }
    let matrix = (0..rivals.len())
        .map(|truth| {
            let noise = noise_pairs(&rivals[truth].fit.noise);
            let winners: Vec<usize> = (0..draws as u64)
                .into_par_iter()
                .map(|k| {
                    let base = draw(problem, &noise, rule, seed ^ (0xc0f + truth as u64), k);
                    let score = |j: usize| {
                        // Simulated less predicted by j: noise, plus what truth predicts more than j does.
                        let data: Vec<Vec<Vec<f64>>> = base
                            .iter()
                            .enumerate()
                            .map(|(r, row)| {
                                row.iter()
                                    .enumerate()
                                    .map(|(c, column)| {
                                        (0..column.len())
                                            .map(|i| {
                                                column[i] + residuals_of[j][r][c][i]
                                                    - residuals_of[truth][r][c][i]
                                            })
                                            .collect()
                                    })
                                    .collect()
                            })
                            .collect();
                        models[j].read(&data).score + constants[j]
                    };
                    let scores: Vec<f64> = (0..rivals.len()).map(score).collect();
                    (0..scores.len()).max_by(|&a, &b| scores[a].total_cmp(&scores[b])).unwrap_or(truth)
                })
                .collect();
            (0..rivals.len())
                .map(|j| winners.iter().filter(|w| **w == j).count() as f64 / draws.max(1) as f64)
                .collect()
        })
        .collect();
    Ok(matrix)
}

/// Shape and sigma of each channel.
fn noise_pairs(noise: &NoiseState) -> Vec<(usize, f64)> {
    noise.shape.iter().copied().zip(noise.sigma.iter().copied()).collect()
}
