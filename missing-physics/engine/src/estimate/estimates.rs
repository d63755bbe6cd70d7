//! Values and intervals of parameters.

use std::sync::Arc;

use nalgebra::DMatrix;
use statrs::distribution::{ContinuousCDF as _, StudentsT};

use crate::diagnosis::Estimate;
use crate::fit::gauss_newton::{Fit, NoiseRule, NoiseState, covariance, open_shapes, solve};
use crate::model::{Derived, DerivedPerRun, Mechanism, Over, PredictError, Scope};
use crate::problem::{Problem, Selection};
use crate::selection::compare::Candidate;

/// The quantile at which two-sided 95 % intervals end.
const END: f64 = 0.975;
/// That of the normal law.
const Z95: f64 = 1.959_963_984_540_054;

/// How many standard errors an interval reaches to either side: Student's law where the noise is sized by the residuals themselves.
fn reach(problem: &Problem<'_>, selection: &Selection, rule: &NoiseRule) -> f64 {
    let of = |sized: bool| -> usize {
        let mine = (0..problem.channels()).filter(|&c| rule.fixed_sigma[c].is_none() == sized);
        mine.map(|c| problem.count(c)).sum()
    };
    let (sized, fixed) = (of(true) as f64, of(false) as f64);
    if sized == 0.0 {
        return Z95;
    }
    let unknowns = (selection.shared.len() + selection.nuisance.len() * problem.rows.len()) as f64;
    student(sized - unknowns * sized / (sized + fixed))
}

/// The same for so many degrees of freedom.
fn student(freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, freedom.max(1.0)).map_or(Z95, |law| law.inverse_cdf(END))
}

/// Estimates of a mechanism's parameters and of what is derived from them.
pub(crate) fn of_mechanism(
    problem: &Problem<'_>,
    candidate: &Candidate,
    mechanism: &Mechanism,
    rule: &NoiseRule,
    profile: bool,
) -> Vec<Estimate> {
    let mut all = estimates(problem, candidate, &mechanism.parameters, &mechanism.derived, rule, profile);
    for other in &candidate.alternative_modes {
        let other = Candidate { fit: other.clone(), alternative_modes: Vec::new(), ..candidate.clone() };
        let there = estimates(problem, &other, &mechanism.parameters, &mechanism.derived, rule, profile);
        all.iter_mut().zip(&there).for_each(|(estimate, there)| estimate.reach(there));
    }
    let reach = reach(problem, &candidate.selection, rule);
    all.extend(mechanism.derived_per_run.iter().map(|quantity| over_runs(candidate, quantity, reach)));
    all
}

/// A candidate with the information that is left once the shape of the noise is as open as the residuals leave it: the variance of
/// the parameters is its mean over the shapes, and what they move by with the shape (Hoeting et al. 1999,
/// doi:10.1214/ss/1009212519). `None` where that has no inverse.
pub(crate) fn with_open_noise(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    candidate: &Candidate,
) -> Option<Candidate> {
    let Candidate { selection, fit, .. } = candidate;
    let n = selection.shared.len();
    let chosen = covariance(&fit.information);
    let mut total = chosen.clone();
    let over = |noise: &NoiseState| -> Result<DMatrix<f64>, PredictError> {
        let there = solve(problem, selection, noise, &fit.shared, &fit.nuisance)?;
        let moved = |i: usize| there.shared[selection.shared[i]] - fit.shared[selection.shared[i]];
        let by = DMatrix::from_fn(n, n, |i, j| moved(i) * moved(j));
        Ok(covariance(&there.information) + by)
    };
    for (channel, shapes) in open_shapes(problem, selection, rule, fit).ok()?.iter().enumerate() {
        for open in shapes {
            let mut noise = fit.noise.clone();
            (noise.shape[channel], noise.sigma[channel]) = (open.shape, open.sigma);
            total += (over(&noise).ok()? - &chosen) * open.weight;
        }
    }
    let information = total.cholesky()?.inverse();
    let sound = information.iter().all(|v| v.is_finite());
    sound.then(|| Candidate { fit: Fit { information, ..fit.clone() }, ..candidate.clone() })
}

impl Estimate {
    /// Widens the interval to what is likely with another whole number as well. A whole number itself has an interval only so.
    fn reach(&mut self, there: &Self) {
        let ends = |e: &Self| if e.ci95[0].is_nan() { [e.value; 2] } else { e.ci95 };
        let (mine, other) = (ends(self), ends(there));
        if self.ci95[0].is_finite() || self.value != there.value {
            self.ci95 = [mine[0].min(other[0]), mine[1].max(other[1])];
        }
    }
}

/// Estimates of the given parameters (indices into the model's list) and of what is derived from them.
///
/// Intervals are quadratic; with `profile` they follow the likelihood where that is not quadratic.
pub(crate) fn estimates(
    problem: &Problem<'_>,
    candidate: &Candidate,
    parameters: &[usize],
    derived: &[Derived],
    rule: &NoiseRule,
    profile: bool,
) -> Vec<Estimate> {
    let spec = problem.spec();
    let selection = &candidate.selection;
    let reach = reach(problem, selection, rule);
    let covariance = covariance(&candidate.fit.information);
    let place = |slot: usize| selection.shared.iter().position(|&s| s == slot);
    let mut estimates: Vec<Estimate> = parameters
        .iter()
        .map(|&p| {
            let info = &spec.parameters[p];
            let slot = problem.slots[p];
            if info.scope == Scope::PerRun {
                let nuisance = DerivedPerRun {
                    name: info.name.clone(),
                    unit: info.unit.clone(),
                    over: Over::Mean,
                    value: Arc::new(move |_, nuisance: &[f64]| nuisance[slot]),
                };
                return over_runs(candidate, &nuisance, reach);
            }
            let value = candidate.fit.shared[slot];
            let mut ci95 = [f64::NAN; 2];
            if let Some(i) = place(slot).filter(|&i| covariance[(i, i)].is_finite()) {
                let half = reach * covariance[(i, i)].max(0.0).sqrt();
                ci95 = [value - half, value + half];
                if profile {
                    let profile = Profile::new(problem, candidate, i);
                    let between = profile
                        .between(problem.model.extensions().modes.map_or(&[], |modes| modes.jumps(slot)));
                    ci95 = between.unwrap_or_else(|| profile.interval(half, reach));
                }
                ci95 = [ci95[0].max(info.lower), ci95[1].min(info.upper)];
            }
            Estimate { name: info.name.clone(), unit: info.unit.clone(), value, ci95 }
        })
        .collect();
    for quantity in derived {
        let value = (quantity.value)(&candidate.fit.shared);
        let by_shared = slopes(&selection.shared, &candidate.fit.shared, &errors(&covariance), &|shared| {
            (quantity.value)(shared)
        });
        let half = reach * quadratic(&by_shared, &covariance).max(0.0).sqrt();
        let (name, unit) = (quantity.name.clone(), quantity.unit.clone());
        let estimate = Estimate { name, unit, value, ci95: [value - half, value + half] };
        match estimates.iter_mut().find(|e| e.name == estimate.name) {
            // The parameter itself has the better interval.
            Some(same) if same.value == value => {}
            Some(other) => *other = estimate,
            None => estimates.push(estimate),
        }
    }
    estimates
}

/// Standard errors of the free shared parameters; infinite where the data do not determine one.
fn errors(covariance: &DMatrix<f64>) -> Vec<f64> {
    covariance.diagonal().iter().map(|v| v.max(0.0).sqrt()).collect()
}

/// Slopes of a function along the given slots of its argument, by differences of a small part of each one's error; none along those
/// that are not determined.
fn slopes(slots: &[usize], at: &[f64], errors: &[f64], value: &dyn Fn(&[f64]) -> f64) -> Vec<f64> {
    let mut shifted = at.to_vec();
    slots
        .iter()
        .zip(errors)
        .map(|(&slot, error)| {
            let step = 1e-4 * error;
            if !(step > 0.0 && step.is_finite()) {
                return 0.0;
            }
            shifted[slot] = at[slot] + step;
            let above = value(&shifted);
            shifted[slot] = at[slot] - step;
            let below = value(&shifted);
            shifted[slot] = at[slot];
            (above - below) / (2.0 * step)
        })
        .collect()
}

/// The variance of a sum of parameters with the given weights, those that are not determined left out.
fn quadratic(weights: &[f64], covariance: &DMatrix<f64>) -> f64 {
    let determined = |i: &usize| covariance[(*i, *i)].is_finite();
    let determined: Vec<usize> = (0..weights.len()).filter(determined).collect();
    determined
        .iter()
        .flat_map(|&i| determined.iter().map(move |&j| (i, j)))
        .map(|(i, j)| weights[i] * weights[j] * covariance[(i, j)])
        .sum()
}

/// A value that each run has of its own, over the runs, with what the errors of the runs' nuisance and of the shared parameters make of it,
/// and with what the runs differ beyond those (DerSimonian and Laird 1986, doi:10.1016/0197-2456(86)90046-2).
fn over_runs(candidate: &Candidate, quantity: &DerivedPerRun, reach: f64) -> Estimate {
    let (fit, selection) = (&candidate.fit, &candidate.selection);
    let covariance = covariance(&fit.information);
    let shared_errors = errors(&covariance);
    let mut values = Vec::with_capacity(fit.nuisance.len());
    let mut nuisance_variances = Vec::with_capacity(fit.nuisance.len());
    let mut by_shared = Vec::with_capacity(fit.nuisance.len());
    for (nuisance, errors) in fit.nuisance.iter().zip(&fit.nuisance_errors) {
        let by_nuisance = slopes(&selection.nuisance, nuisance, &errors.error, &|nuisance| {
            (quantity.value)(&fit.shared, nuisance)
        });
        let mut along = slopes(&selection.shared, &fit.shared, &shared_errors, &|shared| {
            (quantity.value)(shared, nuisance)
        });
        for (slope, moved) in by_nuisance.iter().zip(&errors.slope) {
            along.iter_mut().zip(moved).for_each(|(a, m)| *a += slope * m);
        }
        let determined = by_nuisance.iter().zip(&errors.error).filter(|(_, e)| e.is_finite());
        values.push((quantity.value)(&fit.shared, nuisance));
        nuisance_variances.push(determined.map(|(s, e)| (s * e).powi(2)).sum::<f64>());
        by_shared.push(along);
    }
    let (value, half) = match quantity.over {
        Over::Mean => {
            let n = values.len().max(1) as f64;
            let mean = values.iter().sum::<f64>() / n;
            let along: Vec<f64> = (0..selection.shared.len())
                .map(|k| by_shared.iter().map(|run| run[k]).sum::<f64>() / n)
                .collect();
            let differ = between(&values, &nuisance_variances);
            let determined =
                nuisance_variances.iter().sum::<f64>() / (n * n) + quadratic(&along, &covariance);
            // What the runs differ by is known from the runs alone (Hartung and Knapp 2001, doi:10.1002/sim.791).
            (mean, (reach * reach * determined.max(0.0) + student(n - 1.0).powi(2) * differ / n).sqrt())
        }
        Over::Largest => {
            let largest = (0..values.len()).max_by(|&a, &b| values[a].abs().total_cmp(&values[b].abs()));
            largest.map_or((f64::NAN, f64::NAN), |run| {
                let determined = nuisance_variances[run] + quadratic(&by_shared[run], &covariance);
                (values[run], reach * determined.max(0.0).sqrt())
            })
        }
    };
    let name = quantity.name.clone();
    Estimate { name, unit: quantity.unit.clone(), value, ci95: [value - half, value + half] }
}

/// The variance of runs' values beyond their own errors, by moments; none where it cannot be told.
fn between(values: &[f64], variances: &[f64]) -> f64 {
    if values.len() < 2 || variances.iter().any(|v| !(*v > 0.0)) {
        let n = values.len().max(1) as f64;
        let mean = values.iter().sum::<f64>() / n;
        return values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    }
    let weights: Vec<f64> = variances.iter().map(|v| 1.0 / v).collect();
    let total: f64 = weights.iter().sum();
    let mean = weights.iter().zip(values).map(|(w, v)| w * v).sum::<f64>() / total;
    let spread: f64 = weights.iter().zip(values).map(|(w, v)| w * (v - mean).powi(2)).sum();
    let scale = total - weights.iter().map(|w| w * w).sum::<f64>() / total;
    ((spread - (values.len() - 1) as f64) / scale).max(0.0)
}

/// How far about an estimate the profile of the likelihood is looked at, in standard errors: dry friction and jumps leave many tops.
const LOOK: [f64; 6] = [0.75, 1.5, 3.0, 6.0, 12.0, 24.0];
/// A top is a better one where the sum of squares is lower by this.
const BETTER: f64 = 0.05;

/// A stair of the likelihood is looked at until this many treads in a row have a sum of squares that is higher by so much.
const UNLIKELY: f64 = 30.0;
const UNLIKELY_TREADS: usize = 3;

/// The likelihood of one free shared parameter, all others fitted at each of its values.
struct Profile<'a> {
    problem: &'a Problem<'a>,
    fit: &'a Fit,
    /// What is free with it, and beside it.
    all: &'a Selection,
    others: Selection,
    slot: usize,
}

impl<'a> Profile<'a> {
    fn new(problem: &'a Problem<'a>, candidate: &'a Candidate, i: usize) -> Self {
        let mut others = candidate.selection.clone();
        let slot = others.shared.remove(i);
        others.added_shared.remove(i);
        Self { problem, fit: &candidate.fit, all: &candidate.selection, others, slot }
    }

    fn at(&self, value: f64) -> Option<Fit> {
        let mut shared = self.fit.shared.clone();
        shared[self.slot] = value;
        solve(self.problem, &self.others, &self.fit.noise, &shared, &self.fit.nuisance).ok()
    }

    /// By how much a standard error is wider than that of the fit's own noise.
    fn wider(&self, error: f64) -> f64 {
        let at = self.all.shared.iter().position(|&slot| slot == self.slot);
        let there = solve(self.problem, self.all, &self.fit.noise, &self.fit.shared, &self.fit.nuisance).ok();
        let fitted = at.zip(there).map_or(f64::NAN, |(i, fit)| covariance(&fit.information)[(i, i)].sqrt());
        if fitted > 0.0 && fitted.is_finite() { error / fitted } else { 1.0 }
    }

    /// By how much the sum of squares is higher at a value than at the estimate.
    fn rise(&self, value: f64) -> Option<f64> {
        self.at(value).map(|f| f.chi2 - self.fit.chi2)
    }

    /// The top of the likelihood to which a fit climbs from a value, the parameter being free again; none where the sum of squares
    /// at the value is `most` or more.
    fn top_from(&self, value: f64, most: f64) -> Option<Fit> {
        let near = self.at(value).filter(|f| f.chi2 < most)?;
        solve(self.problem, self.all, &near.noise, &near.shared, &near.nuisance).ok()
    }

    fn bound(&self, side: f64) -> f64 {
        let table = &self.problem.shared;
        if side < 0.0 { table.lower[self.slot] } else { table.upper[self.slot] }
    }

    /// Values about the estimate on one side, within its bounds, from near to far.
    fn looks(&self, side: f64, error: f64) -> impl Iterator<Item = f64> + use<'_> {
        let bound = self.bound(side);
        let values = LOOK.map(|k| self.fit.shared[self.slot] + side * k * error);
        values.into_iter().filter(move |value| (value - bound) * side < 0.0)
    }

    /// The 95 % interval of a parameter at whose values predictions jump: the likelihood is a stair, whose treads weigh what they are wide
    /// (a posterior of an even prior). `None` where nothing jumps.
    fn between(&self, jumps: &[f64]) -> Option<[f64; 2]> {
        let [lowest, highest] = [jumps.first()?, jumps.last()?].map(|end| *end);
        let ends = [self.bound(-1.0).min(lowest), self.bound(1.0).max(highest)];
        let edges: Vec<f64> = ends[..1].iter().chain(jumps).chain(&ends[1..]).copied().collect();
        let treads: Vec<[f64; 2]> = edges.windows(2).map(|w| [w[0], w[1]]).filter(|t| t[1] > t[0]).collect();
        let here = treads.iter().position(|t| self.fit.shared[self.slot] <= t[1])?;
        let mut rises = vec![f64::INFINITY; treads.len()];
        let (down, up): (Vec<usize>, Vec<usize>) =
            ((0..here).rev().collect(), (here..treads.len()).collect());
        for side in [up, down] {
            let mut unlikely = 0;
            for at in side {
                rises[at] = self.rise(0.5 * (treads[at][0] + treads[at][1])).unwrap_or(f64::INFINITY);
                unlikely = if rises[at] > UNLIKELY { unlikely + 1 } else { 0 };
                if unlikely == UNLIKELY_TREADS {
                    break;
                }
            }
        }
        let least = rises.iter().copied().fold(f64::INFINITY, f64::min);
        let masses: Vec<f64> = treads
            .iter()
            .zip(&rises)
            .map(|(t, rise)| (t[1] - t[0]) * (-0.5 * (rise - least)).exp())
            .collect();
        let all: f64 = masses.iter().sum();
        let holding = |part: f64| {
            let mut below = 0.0;
            let mut sums = masses.iter().map(|mass| {
                below += mass;
                below
            });
            sums.position(|sum| sum >= part * all)
        };
        // Within a tread all values are alike: whole treads.
        Some([treads[holding(1.0 - END)?][0], treads[holding(END)?][1]])
    }

    /// The 95 % interval, where the quadratic one of this half width, so many standard errors, misleads.
    fn interval(&self, half: f64, reach: f64) -> [f64; 2] {
        let value = self.fit.shared[self.slot];
        let most = (reach * self.wider(half / reach)).powi(2);
        let quadratic = [value - half, value + half];
        let mut interval = quadratic;
        for (side, end) in [(-1.0, 0), (1.0, 1)] {
            let bound = self.bound(side);
            let mut distance = half;
            for _ in 0..8 {
                let value = self.fit.shared[self.slot] + side * distance;
                if !(value - bound).is_finite() && bound.is_finite() || (value - bound) * side >= 0.0 {
                    interval[end] = bound;
                    break;
                }
                let Some(risen) = self.rise(value).filter(|r| *r > 0.0) else { break };
                interval[end] = value;
                if (risen - most).abs() < 0.05 * most {
                    break;
                }
                // Along a profile that is nearly a parabola the distance goes with the square root of the rise.
                distance *= (most / risen).sqrt().clamp(0.5, 2.0);
            }
            // Another top beyond the first fall may be as likely as the interval's own end.
            for value in self.looks(side, half / reach).filter(|value| (value - quadratic[end]) * side > 0.0)
            {
                let top = self
                    .top_from(value, f64::INFINITY)
                    .map(|f| (f.shared[self.slot], f.chi2 - self.fit.chi2));
                if let Some((top, risen)) = top.filter(|(_, risen)| *risen < most) {
                    let reach = top + side * half * (1.0 - risen / most).min(1.0).sqrt();
                    let reach = if (reach - bound) * side < 0.0 { reach } else { bound };
                    if (reach - interval[end]) * side > 0.0 {
                        interval[end] = reach;
                    }
                }
            }
        }
        interval
    }
}

/// A better top of the likelihood than a candidate's own, if there is one where its mechanisms' parameters are a few standard errors
/// to many away.
pub(crate) fn better_top(problem: &Problem<'_>, candidate: &Candidate) -> Option<Fit> {
    let selection = &candidate.selection;
    let covariance = covariance(&candidate.fit.information);
    let mut best: Option<Fit> = None;
    for i in (0..selection.shared.len()).filter(|&i| selection.added_shared[i]) {
        let error = covariance[(i, i)].max(0.0).sqrt();
        if !(error > 0.0 && error.is_finite()) {
            continue;
        }
        let profile = Profile::new(problem, candidate, i);
        for value in [-1.0, 1.0].into_iter().flat_map(|side| profile.looks(side, error)) {
            let least = best.as_ref().map_or(candidate.fit.chi2, |b| b.chi2) - BETTER;
            if let Some(top) = profile.top_from(value, least + Z95 * Z95).filter(|f| f.chi2 < least) {
                best = Some(top);
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quantiles of a table; and few runs that differ know their mean less well than many.
    #[test]
    fn few_degrees_of_freedom_reach_further() {
        approx::assert_abs_diff_eq!(student(2.0), 4.3027, epsilon = 1e-3);
        approx::assert_abs_diff_eq!(student(10.0), 2.2281, epsilon = 1e-3);
        approx::assert_abs_diff_eq!(student(1e6), Z95, epsilon = 1e-3);
    }
}
