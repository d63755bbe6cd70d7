//! Innovations of a dough that is followed: whitened, their likelihood, and by how much they answer the dynamics' coefficients.

use nalgebra::{Const, DMatrix, DVector, Dyn, Matrix3, OMatrix, Vector3};

use crate::filter::Step;
use crate::nuisance::{NUISANCES, trends};

/// Innovations of a roll: three of the measurement after it, then three of the one before it.
pub const PER_ROLL: usize = 6;

/// The innovations of a dough, whitened: independent and of variance one where dynamics and noise are right.
pub fn whitened(steps: &[Step]) -> DVector<f64> {
    let rolls = steps.iter().flat_map(|s| [s.after.whitened(), s.before.whitened()]);
    DVector::from_iterator(PER_ROLL * steps.len(), rolls.flat_map(|w| [w[0], w[1], w[2]]))
}

/// The two parts of twice the negative log likelihood of innovations, but for a constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NegativeLogLikelihood {
    /// Logarithm of the determinant of the innovations' covariance.
    pub log_determinant: f64,
    /// Sum of squares of the [`whitened`] innovations.
    pub sum_of_squares: f64,
}

impl NegativeLogLikelihood {
    /// Twice the negative log likelihood, but for a constant.
    pub fn twice(&self) -> f64 {
        self.log_determinant + self.sum_of_squares
    }
}

/// The negative log likelihood of a dough's innovations.
pub fn negative_log_likelihood(steps: &[Step]) -> NegativeLogLikelihood {
    let mut all = NegativeLogLikelihood { log_determinant: 0.0, sum_of_squares: 0.0 };
    for innovation in steps.iter().flat_map(|s| [&s.before, &s.after]) {
        all.log_determinant += 2.0 * innovation.factor.diagonal().map(f64::ln).sum();
        all.sum_of_squares += innovation.whitened().norm_squared();
    }
    all
}

/// Derivatives of the [`whitened`] innovations with respect to the coefficients of each dimension's change, one dimension after the
/// other, and (the last [`NUISANCES`] columns) to the dough's nuisance parameters.
///
/// `terms(i)` are what the coefficients of roll `i`'s change multiply, and what that counts for in each dimension (m); `response(i)` is
/// the part of the change that takes place.
pub fn sensitivity(
    steps: &[Step],
    terms: impl Fn(usize) -> (DVector<f64>, Vector3<f64>),
    response: impl Fn(usize) -> f64,
    coefficients: usize,
) -> DMatrix<f64> {
    let p = coefficients;
    let columns = 3 * p + NUISANCES;
    let trends = trends(steps.len());
    let mut all = DMatrix::zeros(PER_ROLL * steps.len(), columns);
    // Of the predicted state.
    let mut moved = OMatrix::<f64, Const<3>, Dyn>::zeros(columns);
    for (i, step) in steps.iter().enumerate() {
        let row = PER_ROLL * i;
        write(&mut all, row + 3, &step.before.factor, &moved);
        moved -= step.before.gain * &moved;
        let mut state = moved.clone();
        moved = step.gradient * &moved;
        let ((terms, unit_m), response) = (terms(i), response(i));
        for k in 0..3 {
            for (j, term) in terms.iter().enumerate() {
                moved[(k, k * p + j)] += response * unit_m[k] * term;
            }
            for (c, trend) in trends.iter().enumerate() {
                moved[(k, 3 * p + 3 * c + k)] += response * trend[i];
            }
            if !trends.is_empty() {
                moved[(k, columns - 1)] += step.change[k];
            }
        }
        write(&mut all, row, &step.after.factor, &moved);
        state -= step.smoother_gain * &moved;
        moved -= step.after.gain * &moved;
        moved = step.weights[0] * moved + step.weights[1] * state;
    }
    all
}

fn write(all: &mut DMatrix<f64>, row: usize, factor: &Matrix3<f64>, moved: &OMatrix<f64, Const<3>, Dyn>) {
    let mut whitened = -moved.clone();
    factor.solve_lower_triangular_mut(&mut whitened);
    all.view_mut((row, 0), (3, moved.ncols())).copy_from(&whitened);
}
