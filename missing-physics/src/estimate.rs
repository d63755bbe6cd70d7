//! Values and intervals of parameters.

use crate::compare::Candidate;
use crate::diagnosis::Estimate;
use crate::fit::{NoiseRule, covariance, solve};
use crate::model::{Derived, Mechanism, Scope};
use crate::problem::{Problem, Selection};

/// Two-sided 95 % quantile of the normal law.
const Z95: f64 = 1.959_963_984_540_054;
/// Its square: the 95 % quantile of chi-square with one degree of freedom.
const CHI95: f64 = Z95 * Z95;

/// Estimates of a mechanism's parameters and of what is derived from them.
pub(crate) fn of_mechanism(
    problem: &Problem<'_>,
    candidate: &Candidate,
    mechanism: &Mechanism,
    profile: Option<&NoiseRule>,
) -> Vec<Estimate> {
    let mut all = estimates(problem, candidate, &mechanism.parameters, &mechanism.derived, profile);
    all.extend(mechanism.derived_per_run.iter().map(|quantity| {
        let of_run = |own: &Vec<f64>| (quantity.value)(&candidate.fit.shared, own);
        over_runs(candidate.fit.own.iter().map(of_run).collect(), &quantity.name, &quantity.unit)
    }));
    all
}

/// Estimates of the given parameters (indices into the model's list) and of what is derived from them.
///
/// Intervals are quadratic; with `profile` they follow the likelihood where that is not quadratic.
pub(crate) fn estimates(
    problem: &Problem<'_>,
    candidate: &Candidate,
    parameters: &[usize],
    derived: &[Derived],
    profile: Option<&NoiseRule>,
) -> Vec<Estimate> {
    let spec = problem.spec();
    let selection = &candidate.selection;
    let covariance = covariance(&candidate.fit.information);
    let place = |slot: usize| selection.shared.iter().position(|&s| s == slot);
    let mut estimates: Vec<Estimate> = parameters
        .iter()
        .map(|&p| {
            let info = &spec.parameters[p];
            let slot = problem.slots[p];
            if info.scope == Scope::PerRun {
                let values = candidate.fit.own.iter().map(|own| own[slot]).collect();
                return over_runs(values, &info.name, &info.unit);
            }
            let value = candidate.fit.shared[slot];
            let mut ci95 = [f64::NAN; 2];
            if let Some(i) = place(slot).filter(|&i| covariance[(i, i)].is_finite()) {
                let half = Z95 * covariance[(i, i)].max(0.0).sqrt();
                ci95 = [value - half, value + half];
                if profile.is_some() {
                    ci95 = followed(problem, candidate, i, half, ci95);
                }
                ci95 = [ci95[0].max(info.lower), ci95[1].min(info.upper)];
            }
            Estimate { name: info.name.clone(), unit: info.unit.clone(), value, ci95 }
        })
        .collect();
    for quantity in derived {
        let value = (quantity.value)(&candidate.fit.shared);
        let determined: Vec<bool> =
            (0..selection.shared.len()).map(|i| covariance[(i, i)].is_finite()).collect();
        let half = {
            let gradient: Vec<f64> = selection
                .shared
                .iter()
                .enumerate()
                .map(|(i, &slot)| {
                    if !determined[i] {
                        return 0.0;
                    }
                    let step = 1e-4 * covariance[(i, i)].max(0.0).sqrt();
                    let mut shifted = candidate.fit.shared.clone();
                    shifted[slot] += step;
                    let above = (quantity.value)(&shifted);
                    shifted[slot] -= 2.0 * step;
                    if step > 0.0 { (above - (quantity.value)(&shifted)) / (2.0 * step) } else { 0.0 }
                })
                .collect();
            let variance: f64 = (0..gradient.len())
                .flat_map(|i| (0..gradient.len()).map(move |j| (i, j)))
                .filter(|&(i, j)| determined[i] && determined[j])
                .map(|(i, j)| gradient[i] * gradient[j] * covariance[(i, j)])
                .sum();
            Z95 * variance.max(0.0).sqrt()
        };
        estimates.push(Estimate {
            name: quantity.name.clone(),
            unit: quantity.unit.clone(),
            value,
            ci95: [value - half, value + half],
        });
    }
    estimates
}

/// The mean of a value that each run has of its own, with the interval of that mean.
fn over_runs(values: Vec<f64>, name: &str, unit: &str) -> Estimate {
    let n = values.len().max(1) as f64;
    let value = values.iter().sum::<f64>() / n;
    let spread = values.iter().map(|v| (v - value).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    let half = Z95 * (spread / n).sqrt();
    Estimate { name: name.into(), unit: unit.into(), value, ci95: [value - half, value + half] }
}

/// The profile-likelihood interval of the `i`-th free shared parameter, where the quadratic one misleads.
fn followed(
    problem: &Problem<'_>,
    candidate: &Candidate,
    i: usize,
    half: f64,
    quadratic: [f64; 2],
) -> [f64; 2] {
    let fit = &candidate.fit;
    let slot = candidate.selection.shared[i];
    let mut others: Selection = candidate.selection.clone();
    others.shared.remove(i);
    others.added_shared.remove(i);
    let rise = |value: f64| -> Option<f64> {
        let mut shared = fit.shared.clone();
        shared[slot] = value;
        solve(problem, &others, &fit.noise, &shared, &fit.own).ok().map(|f| f.chi2 - fit.chi2)
    };
    let mut interval = quadratic;
    for (side, end) in [(-1.0, 0), (1.0, 1)] {
        let bound = if side < 0.0 { problem.shared.lower[slot] } else { problem.shared.upper[slot] };
        let mut distance = half;
        for _ in 0..8 {
            let value = fit.shared[slot] + side * distance;
            if !(value - bound).is_finite() && bound.is_finite() || (value - bound) * side >= 0.0 {
                interval[end] = bound;
                break;
            }
            let Some(risen) = rise(value).filter(|r| *r > 0.0) else { break };
            interval[end] = value;
            if (risen - CHI95).abs() < 0.05 * CHI95 {
                break;
            }
            // Along a profile that is nearly a parabola the distance goes with the square root of the rise.
            distance *= (CHI95 / risen).sqrt().clamp(0.5, 2.0);
        }
    }
    interval
}
