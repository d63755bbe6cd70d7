//! Errors of parameters carried on to what is computed from them.

use nalgebra::DMatrix;

/// Standard errors of the free shared parameters; infinite where the data do not determine one.
pub(crate) fn errors(covariance: &DMatrix<f64>) -> Vec<f64> {
    covariance.diagonal().iter().map(|v| v.max(0.0).sqrt()).collect()
}

/// Slopes of a function along the given slots of its argument, by differences of a small part of each one's error; none along those
/// that are not determined.
pub(crate) fn slopes(slots: &[usize], at: &[f64], errors: &[f64], value: &dyn Fn(&[f64]) -> f64) -> Vec<f64> {
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
pub(crate) fn quadratic(weights: &[f64], covariance: &DMatrix<f64>) -> f64 {
    let determined = |i: &usize| covariance[(*i, *i)].is_finite();
    let determined: Vec<usize> = (0..weights.len()).filter(determined).collect();
    determined
        .iter()
        .flat_map(|&i| determined.iter().map(move |&j| (i, j)))
        .map(|(i, j)| weights[i] * weights[j] * covariance[(i, j)])
        .sum()
}
