//! Columns whose factors are normal about zero, integrated out of a likelihood.

use std::f64::consts::PI;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix2, Vector2};

/// Cosines that follow the wander of a sensor.
const WANDER: usize = 5;

/// Readings over their noise, with columns integrated out.
pub(super) struct Nuisance {
    /// Columns times their factors' standard deviations over the noise, column by column.
    columns: Vec<Vec<f64>>,
    factor: Cholesky<f64, Dyn>,
    y: Vec<f64>,
    /// What the columns share with the readings, solved.
    solved: DVector<f64>,
    /// The readings' squares that the columns leave.
    pub(super) squares: f64,
    /// Logarithm of the likelihood, but for the noise's own constant.
    pub(super) ln_likelihood: f64,
}

impl Nuisance {
    /// Readings and columns over the readings' noise; a column has been multiplied by its factor's standard deviation. `None` for what are no
    /// numbers.
    pub(super) fn new(columns: Vec<Vec<f64>>, y: Vec<f64>) -> Option<Self> {
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let inner = DMatrix::from_fn(columns.len(), columns.len(), |i, j| {
            dot(&columns[i], &columns[j]) + if i == j { 1.0 } else { 0.0 }
        });
        let shared = DVector::from_iterator(columns.len(), columns.iter().map(|c| dot(c, &y)));
        let factor = inner.cholesky()?;
        let solved = factor.solve(&shared);
        let squares = dot(&y, &y) - solved.dot(&shared);
        let ln_det: f64 = factor.l().diagonal().iter().map(|d| d.ln()).sum();
        let ln_likelihood = -0.5 * squares - ln_det;
        Some(Self { columns, factor, y, solved, squares, ln_likelihood })
    }

    /// Products of what the columns leave of others with each other, and with the readings.
    fn products<const N: usize>(&self, others: [&[f64]; N]) -> ([[f64; N]; N], [f64; N]) {
        let count = self.columns.len();
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let shared = others.map(|x| DVector::from_iterator(count, self.columns.iter().map(|c| dot(c, x))));
        let solved = shared.each_ref().map(|s| self.factor.solve(s));
        let inner = std::array::from_fn(|i| {
            std::array::from_fn(|j| dot(others[i], others[j]) - shared[i].dot(&solved[j]))
        });
        let right = std::array::from_fn(|i| dot(others[i], &self.y) - shared[i].dot(&self.solved));
        (inner, right)
    }

    /// A further column (over the noise): what it shares with itself, and with the readings.
    pub(super) fn one(&self, column: &[f64]) -> [f64; 2] {
        let ([[own]], [with]) = self.products([column]);
        [own, with]
    }

    /// Two further columns with normal factors, as in [`Self::new`]: logarithm of the likelihood, squares that are left, and the factors.
    pub(super) fn two(&self, columns: [&[f64]; 2]) -> Option<(f64, f64, [f64; 2])> {
        let ([[a, b], [_, c]], [u, v]) = self.products(columns);
        let inner = Matrix2::new(1.0 + a, b, b, 1.0 + c);
        let right = Vector2::new(u, v);
        let found = inner.try_inverse()? * right;
        let gain = right.dot(&found);
        let ln = self.ln_likelihood + 0.5 * gain - 0.5 * inner.determinant().ln();
        Some((ln, self.squares - gain, [found.x, found.y]))
    }
}

/// Columns of a constant offset and of a wander (Ornstein and Uhlenbeck's process of a standard deviation and memory) at times, with the
/// standard deviations of their factors: cosines over the record, the first of which have nearly all of it.
pub(super) fn drift(t_s: &[f64], [offset, wander]: [f64; 2], memory_s: f64) -> Vec<Vec<f64>> {
    let first = t_s.first().copied().unwrap_or_default();
    let length = (t_s.last().copied().unwrap_or_default() - first).max(f64::MIN_POSITIVE);
    let column = |k: usize| -> Vec<f64> {
        // Variance of the k-th cosine's factor: the process's spectrum at that frequency; the mean is as uncertain as the wander at most.
        let rate = k as f64 * PI * memory_s / length;
        let variance = if k == 0 {
            offset * offset + wander * wander
        } else {
            4.0 * wander * wander * memory_s / length / (1.0 + rate * rate)
        };
        let sd = variance.sqrt();
        t_s.iter().map(|t| sd * (k as f64 * PI * (t - first) / length).cos()).collect()
    };
    (0..=WANDER).map(column).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    /// Against the normal law of all readings at once, covariance written out.
    #[test]
    fn columns_are_integrated_out() {
        let column = |f: &dyn Fn(f64) -> f64| (0..12).map(|i| f(f64::from(i))).collect::<Vec<f64>>();
        let columns = vec![column(&|_| 2.0), column(&|i| 0.3 * i)];
        let (first, second) = (column(&|i| (0.9 * i).sin()), column(&|i| 0.5 * (0.9 * i).cos()));
        let y = column(&|i| 0.7 * (1.3 * i).sin() + 0.1 * i);
        let direct = |columns: &[Vec<f64>]| {
            let covariance = DMatrix::from_fn(12, 12, |i, j| {
                columns.iter().map(|c| c[i] * c[j]).sum::<f64>() + if i == j { 1.0 } else { 0.0 }
            });
            let factor = covariance.cholesky().unwrap();
            let y = DVector::from_vec(y.clone());
            let ln_det: f64 = factor.l().diagonal().iter().map(|d| d.ln()).sum();
            -0.5 * y.dot(&factor.solve(&y)) - ln_det
        };
        let nuisance = Nuisance::new(columns.clone(), y.clone()).unwrap();
        approx::assert_relative_eq!(nuisance.ln_likelihood, direct(&columns), max_relative = 1e-10);
        let all = [columns, vec![first.clone(), second.clone()]].concat();
        let (ln, ..) = nuisance.two([&first, &second]).unwrap();
        approx::assert_relative_eq!(ln, direct(&all), max_relative = 1e-10);
    }
}
