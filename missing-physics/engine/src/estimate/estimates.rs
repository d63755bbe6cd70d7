//! Values and intervals of parameters.

use std::sync::Arc;

use crate::diagnosis::Estimate;
use crate::estimate::over_runs::over_runs;
use crate::estimate::profile::{Profile, at_fit};
use crate::estimate::propagate::{errors, quadratic, slopes};
use crate::estimate::reach::reach;
use crate::fit::optimum::covariance;
use crate::model::{Derived, DerivedPerRun, Mechanism, Over, Scope};
use crate::noise::rule::NoiseRule;
use crate::problem::Problem;
use crate::selection::candidate::Candidate;

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
    let linear = if profile { at_fit(problem, candidate) } else { None };
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
                    let profile = Profile::new(problem, candidate, linear.as_ref(), i);
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
