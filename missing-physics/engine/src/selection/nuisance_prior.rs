//! What a parameter costs that a mechanism gives each run for itself.
//!
//! Its values in the runs come from one normal law, whose mean and width the runs tell: all alike (an offset of the rig), around
//! nothing (a phase, a sign by chance), or both. A fixed wide prior for each run would cost more than a faint effect can pay.

use nalgebra::DMatrix;

use crate::fit::columns::nuisance_prior_width;
use crate::fit::optimum::{Fit, covariance};
use crate::linalg::{SemiCholesky, dot, rank};
use crate::model::Mechanism;
use crate::problem::{Problem, Selection};
use crate::selection::prior::LOG_RANGE;

/// Log evidence that the `i`-th free nuisance parameter costs: minus the log of the best normal law's density at the runs' values (with
/// the errors that they have, alone and through the shared parameters, of which `information` is known), plus what choosing that law costs.
pub(crate) fn cost(
    problem: &Problem<'_>,
    selection: &Selection,
    fit: &Fit,
    information: &DMatrix<f64>,
    i: usize,
) -> f64 {
    let (slot, widest) = (selection.nuisance[i], nuisance_prior_width(problem, selection, i));
    let n = fit.nuisance.len();
    let values: Vec<f64> = fit
        .nuisance
        .iter()
        .zip(&problem.nuisance_start)
        .map(|(nuisance, start)| nuisance[slot] - start[slot])
        .collect();
    // What the fit's wide prior has taken already.
    let taken: f64 = values.iter().map(|v| 0.5 * v * v / (widest * widest)).sum();
    let shared = covariance(information);
    let errors = DMatrix::from_fn(n, n, |r, q| {
        let (a, b) = (&fit.nuisance_errors[r], &fit.nuisance_errors[q]);
        let mut through = 0.0;
        for (j, x) in a.slope[i].iter().enumerate() {
            for (k, y) in b.slope[i].iter().enumerate().filter(|(k, _)| shared[(j, *k)].is_finite()) {
                through += x * y * shared[(j, k)];
            }
        }
        through + if r == q { a.error[i].min(widest).powi(2) } else { 0.0 }
    });
    let law = |width: f64, free_mean: bool| -> (f64, f64, f64) {
        let mut covariance = errors.clone();
        (0..n).for_each(|r| covariance[(r, r)] += width * width);
        let factor = SemiCholesky::new(covariance, rank::COVARIANCE);
        let (mut ones, mut left) = (vec![1.0; n], values.clone());
        factor.forward(&mut ones);
        factor.forward(&mut left);
        let precision = dot(&ones, &ones);
        let mean = if free_mean { dot(&ones, &left) / precision } else { 0.0 };
        let square = dot(&left, &left) - if free_mean { mean * mean * precision } else { 0.0 };
        (0.5 * factor.log_determinant() + 0.5 * square, mean, precision.sqrt().recip())
    };
    let runs = n as f64;
    let largest = (dot(&values, &values) / runs).sqrt().clamp(1e-9 * widest, widest);
    let widths = || (0..=16).map(|k| largest * 0.7f64.powi(k));
    let width_cost = LOG_RANGE.ln() - 0.5 * (std::f64::consts::PI / runs).ln();
    let with_mean = |width: f64| {
        let (cost, mean, error) = law(width, true);
        let prior = (2.0 * (mean * mean + error * error).sqrt() * LOG_RANGE).ln();
        cost + prior - (std::f64::consts::TAU.sqrt() * error).ln()
    };
    let around_nothing = widths().map(|w| law(w, false).0).fold(f64::INFINITY, f64::min) + width_cost;
    let spec = problem.spec();
    let differs = |m: &Mechanism| m.between_runs && m.parameters.contains(&problem.nuisance.index[slot]);
    if spec.mechanisms.iter().any(differs) {
        return around_nothing - taken;
    }
    let alike = with_mean(0.0);
    let both = widths().map(with_mean).fold(f64::INFINITY, f64::min) + width_cost;
    alike.min(around_nothing).min(both) + 3f64.ln() - taken
}
