//! What a recording that its baseline explains would have shown.

use rayon::prelude::*;

use crate::diagnosis::Limit;
use crate::estimate::estimates::of_mechanism;
use crate::noise::rule::NoiseRule;
use crate::problem::Problem;
use crate::selection::candidate::{Candidate, candidate};

/// For each mechanism alone beside an adequate baseline, the far end of the 95 % interval of each of its strengths.
pub(crate) fn limits(problem: &Problem<'_>, rule: &NoiseRule, baseline: &Candidate) -> Vec<Limit> {
    let spec = problem.spec();
    let of = |m: usize| -> Vec<Limit> {
        let mechanism = &spec.mechanisms[m];
        let Ok(fitted) = candidate(problem, rule, &[m], &[], &baseline.fit, &[]) else { return Vec::new() };
        let beside =
            |p: &&usize| mechanism.shape_parameters.contains(p) || mechanism.integer_parameters.contains(p);
        // What follows from a mechanism and is there without it is none of its sizes.
        let there = mechanism.derived.iter().filter(|derived| (derived.value)(&baseline.fit.shared) != 0.0);
        let no_size: Vec<&str> = (mechanism.parameters.iter().filter(beside))
            .map(|&p| spec.parameters[p].name.as_str())
            .chain(there.map(|derived| derived.name.as_str()))
            .collect();
        of_mechanism(problem, &fitted, mechanism, rule, false)
            .into_iter()
            .filter(|e| !no_size.contains(&e.name.as_str()))
            .map(|e| Limit {
                id: mechanism.id.clone(),
                parameter: e.name,
                unit: e.unit,
                upper: e.ci95[0].abs().max(e.ci95[1].abs()),
            })
            .filter(|limit| limit.upper.is_finite())
            .collect()
    };
    let all: Vec<Vec<Limit>> = spec.asked().into_par_iter().map(of).collect();
    all.into_iter().flatten().collect()
}
