//! How probable a set of mechanisms is, given the data.

use nalgebra::DMatrix;

use crate::fit::columns::nuisance_prior_width;
use crate::fit::optimum::{Fit, covariance};
use crate::linalg::{SemiCholesky, rank};
use crate::problem::{Problem, Selection};
use crate::selection::nuisance_prior;
use crate::selection::prior::{LOG_PRIOR_BETWEEN, LOG_PRIOR_ODDS, LOG_RANGE};

/// Standard deviation of a shared parameter's prior where unseen data are predicted, in units of its scale.
const WIDE: f64 = 10.0;

/// Laplace's approximation of the marginal likelihood of mechanisms `set` and `terms`, and why the fit is no explanation, if it is none.
pub(crate) fn evidence(
    problem: &Problem<'_>,
    set: &[usize],
    terms: &[usize],
    selection: &Selection,
    fit: &Fit,
) -> (f64, Option<String>) {
    let unknowns =
        selection.shared.len() + selection.nuisance.len() * problem.rows.len() + problem.channels();
    if problem.size().0 <= unknowns {
        return (f64::NEG_INFINITY, Some("there are too few rows for it".into()));
    }
    let covariance = covariance(&fit.information);
    let added: Vec<usize> = (0..selection.shared.len()).filter(|&i| selection.added_shared[i]).collect();
    let added = without_open(problem, set, selection, &covariance, added);
    if added.iter().any(|&i| !covariance[(i, i)].is_finite()) {
        return (f64::NEG_INFINITY, Some("these data do not determine it".into()));
    }
    let information = within_shape_priors(problem, set, selection, fit);
    let mut evidence = Evidence { problem, selection, fit, covariance, value: 0.0 };
    evidence.value = marginal(problem, selection, fit, &information) + undetermined(problem, selection, fit);
    for slot in problem.integer_slots(set) {
        evidence.value -= (problem.shared.upper[slot] - problem.shared.lower[slot] + 1.0).ln();
    }
    // Each free parameter's prior belongs to the first mechanism or term that frees it.
    let mut left = added.clone();
    let spec = problem.spec();
    for mechanism in problem.at_work(set).into_iter().map(|m| &spec.mechanisms[m]) {
        let frees: Vec<usize> = mechanism.parameters.iter().chain(&mechanism.companions).copied().collect();
        evidence.pay(&mut left, &frees, &mechanism.shape_parameters);
        evidence.value += if mechanism.between_runs { LOG_PRIOR_BETWEEN } else { 0.0 };
    }
    for &term in terms {
        evidence.pay(&mut left, &[spec.terms[term].parameter], &[]);
    }
    (evidence.value, evidence.ruled_out(set, &added))
}

/// What is taken back of the likelihood integrated over a nuisance parameter of the baseline where a run tells no more of it than its wide
/// prior: as if it were as well determined as in the other runs. A ceiling at a run's first level is no better for hiding where it began.
fn undetermined(problem: &Problem<'_>, selection: &Selection, fit: &Fit) -> f64 {
    let of_parameter = |i: usize| {
        let widest = nuisance_prior_width(problem, selection, i);
        let errors = fit.nuisance_errors.iter().map(|run| run.error[i].min(widest));
        let (open, known): (Vec<f64>, Vec<f64>) = errors.partition(|error| *error > 0.5 * widest);
        let log = |errors: &[f64]| errors.iter().map(|error| error.ln()).sum::<f64>();
        if known.is_empty() { 0.0 } else { open.len() as f64 * log(&known) / known.len() as f64 - log(&open) }
    };
    (0..selection.nuisance.len()).filter(|&i| !selection.added_nuisance[i]).map(of_parameter).sum()
}

/// The information of a fit with what the priors of shape parameters say: no shape fills more than its prior. Where the data say next to
/// nothing of one (a lag that is shorter than the rows are apart), its Laplace approximation would.
fn within_shape_priors(
    problem: &Problem<'_>,
    set: &[usize],
    selection: &Selection,
    fit: &Fit,
) -> DMatrix<f64> {
    let mut information = fit.information.clone();
    let shapes = || set.iter().flat_map(|&m| &problem.spec().mechanisms[m].shape_parameters);
    for (i, &slot) in selection.shared.iter().enumerate() {
        if shapes().any(|&p| p == problem.shared.index[slot]) {
            let width = shape_prior_width(problem, fit, slot);
            information[(i, i)] += std::f64::consts::TAU / (width * width);
        }
    }
    information
}

/// One over the density of a shape parameter's prior where it was fitted: flat within its bounds, on a log scale where these are above
/// zero.
fn shape_prior_width(problem: &Problem<'_>, fit: &Fit, slot: usize) -> f64 {
    let table = &problem.shared;
    let (low, high, x) = (table.lower[slot], table.upper[slot], fit.shared[slot]);
    if low > 0.0 { (high / low).ln() * x } else { high - low }
}

/// The added parameters without those that may stay open and do: where others of the same mechanism are determined.
fn without_open(
    problem: &Problem<'_>,
    set: &[usize],
    selection: &Selection,
    covariance: &DMatrix<f64>,
    added: Vec<usize>,
) -> Vec<usize> {
    let mechanisms = || set.iter().map(|&m| &problem.spec().mechanisms[m]);
    if mechanisms().all(|m| m.may_be_open.is_empty()) {
        return added;
    }
    let index = |i: usize| problem.shared.index[selection.shared[i]];
    let determined = |i: &usize| covariance[(*i, *i)].is_finite();
    let open = |i: &usize| {
        mechanisms().any(|m| {
            m.may_be_open.contains(&index(*i))
                && added.iter().any(|j| m.parameters.contains(&index(*j)) && determined(j))
        })
    };
    added.iter().copied().filter(|i| determined(i) || !open(i)).collect()
}

/// An evidence in the making.
struct Evidence<'a> {
    problem: &'a Problem<'a>,
    selection: &'a Selection,
    fit: &'a Fit,
    covariance: DMatrix<f64>,
    value: f64,
}

impl Evidence<'_> {
    /// What a mechanism or term pays that frees the parameters `frees`, of which `shapes` are shape parameters: its prior odds, and the
    /// priors of those that are `left` (numbers among the free shared ones), which it takes.
    fn pay(&mut self, left: &mut Vec<usize>, frees: &[usize], shapes: &[usize]) {
        let parameter = |i: usize| self.problem.shared.index[self.selection.shared[i]];
        let (mine, others): (Vec<usize>, Vec<usize>) =
            left.iter().copied().partition(|&i| frees.contains(&parameter(i)));
        *left = others;
        let (shapes, strengths): (Vec<usize>, Vec<usize>) =
            mine.into_iter().partition(|&i| shapes.contains(&parameter(i)));
        self.value += LOG_PRIOR_ODDS;
        self.pay_shapes(&shapes);
        if !strengths.is_empty() {
            self.pay_strengths(&strengths);
        }
    }

    /// Shape parameters pay one over the density of their priors.
    fn pay_shapes(&mut self, shapes: &[usize]) {
        for &i in shapes {
            self.value -= shape_prior_width(self.problem, self.fit, self.selection.shared[i]).ln();
        }
    }

    /// Strengths have a prior that is flat in the logarithm of their common size, and even over directions.
    fn pay_strengths(&mut self, strengths: &[usize]) {
        let dimension = strengths.len() as f64;
        let table = &self.problem.shared;
        let mut square = 0.0;
        let mut one_sided = false;
        for &i in strengths {
            let slot = self.selection.shared[i];
            let scale = table.scale[slot];
            square += ((self.fit.shared[slot] - table.start[slot]).powi(2) + self.covariance[(i, i)])
                / (scale * scale);
            self.value -= scale.ln();
            one_sided |= table.lower[slot] >= table.start[slot];
        }
        let sphere = 2.0 * std::f64::consts::PI.powf(dimension / 2.0)
            / statrs::function::gamma::gamma(dimension / 2.0);
        let sphere = if one_sided { 0.5 * sphere } else { sphere };
        self.value -= sphere.ln() + dimension * 0.5 * square.ln() + LOG_RANGE.ln();
    }

    /// Why a fit is no explanation: a parameter at its bound, values that make no sense together, no convergence.
    fn ruled_out(&self, set: &[usize], added: &[usize]) -> Option<String> {
        let Self { problem, selection, fit, .. } = self;
        let bound = added.iter().map(|&i| selection.shared[i]).find(|slot| fit.at_bound.contains(slot));
        let at_bound = |slot: usize| {
            let name = &problem.spec().parameters[problem.shared.index[slot]].name;
            // Four digits: a bound often follows from the data.
            let bound = format!("{:.3e}", fit.shared[slot]).parse().unwrap_or(fit.shared[slot]);
            format!("{name} ended at its bound of {bound}")
        };
        let senseless = || {
            let limits = problem.model.extensions().limits?;
            set.iter().find_map(|&mechanism| limits.implausible(mechanism, &fit.shared))
        };
        bound
            .map(at_bound)
            .or_else(senseless)
            .or_else(|| (!fit.converged).then(|| "its fit did not converge".to_owned()))
    }
}

/// Log likelihood with the parameters of runs and all runs integrated out, before what the prior of the latter says.
fn marginal(problem: &Problem<'_>, selection: &Selection, fit: &Fit, information: &DMatrix<f64>) -> f64 {
    let factor = SemiCholesky::new(information.clone(), rank::DETERMINED);
    let volume = factor.rank() as f64 * std::f64::consts::TAU.ln();
    let nuisance = (0..selection.nuisance.len()).filter(|&i| selection.added_nuisance[i]);
    fit.log_likelihood + 0.5 * (volume - factor.log_determinant())
        - nuisance.map(|i| nuisance_prior::cost(problem, selection, fit, information, i)).sum::<f64>()
}

/// The marginal likelihood with so wide a normal prior of the shared parameters that no data are needed to bound them.
pub(crate) fn bounded_marginal(problem: &Problem<'_>, selection: &Selection, fit: &Fit) -> f64 {
    let mut information = fit.information.clone();
    for (i, &slot) in selection.shared.iter().enumerate() {
        information[(i, i)] += (WIDE * problem.shared.scale[slot]).powi(-2);
    }
    marginal(problem, selection, fit, &information)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use rand::SeedableRng as _;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution as _, Normal};

    use crate::data::{Recording, Run};
    use crate::fit::alternate::fit;
    use crate::fit::optimum::Fit;
    use crate::model::{Model, PredictError, Quantity, Spec, SpecBuilder, UNBOUNDED};
    use crate::noise::rule::noise_rule;
    use crate::problem::Problem;
    use crate::selection::candidate::candidate;

    /// A level of its own in each run, under a ceiling.
    struct Tank(Spec);

    impl Model for Tank {
        fn spec(&self) -> &Spec {
            &self.0
        }

        fn predict(
            &self,
            _: &Run,
            shared: &[f64],
            level: &[f64],
            out: &mut [f64],
        ) -> Result<(), PredictError> {
            out.fill(level[0].min(shared[0]));
            Ok(())
        }

        fn nuisance_start(&self, run: &Run, level: &mut [f64]) {
            level[0] = run.outputs[0].iter().copied().fold(f64::MIN, f64::max);
        }
    }

    /// A ceiling at the highest level hides that run's level, and says no more of the data than the level did.
    #[test]
    fn hiding_a_nuisance_parameter_is_no_evidence() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let noise = Normal::new(0.0, 0.01).unwrap();
        let mut run = |level: f64| Run {
            label: level.to_string(),
            inputs: vec![(0..20).map(f64::from).collect()],
            outputs: vec![(0..20).map(|_| level + noise.sample(&mut rng)).collect()],
            kind: 0,
        };
        let recording = Recording {
            channels: vec![Quantity::new("level_m", "m")],
            variables: vec![Quantity::new("t_s", "s")],
            runs: [1.0, 2.0, 3.0].map(&mut run).to_vec(),
            noise_along: Some(0),
            calibration: vec![Some(0.01)],
            resolution: vec![0.0],
        };
        let mut spec = SpecBuilder::new("levels");
        let ceiling = spec.shared("height_m", "m", 10.0, UNBOUNDED, 1.0);
        spec.nuisance("level_m", "m", UNBOUNDED, 1.0);
        spec.mechanism("ceiling", &[ceiling], ["a ceiling", "What is above it is lost.", "", ""], &[]);
        let model = Tank(spec.build().unwrap());
        let problem = Problem::new(&model, recording);
        let rule = noise_rule(&problem);
        let selection = problem.select(&[], &[]);
        let start = (&problem.shared.start[..], &problem.nuisance_start[..]);
        let levels = fit(&problem, &selection, &rule, start, None).unwrap();
        let without = candidate(&problem, &rule, &[], &[], &levels, &[]).unwrap();
        let above = Fit { nuisance: problem.nuisance_start.clone(), ..levels };
        let with = candidate(&problem, &rule, &[0], &[], &above, &[vec![(0, 2.99)]]).unwrap();
        assert!((with.fit.shared[0] - 3.0).abs() < 0.01, "{:?}", with.fit.shared);
        assert!(with.ruled_out.is_none() && with.evidence < without.evidence);
    }
}
