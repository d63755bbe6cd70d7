//! Correlations of a Gaussian prior's coordinates.

use nalgebra::DMatrix;
use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};

use crate::normal::{mass, truncated_quantile};

/// The lower Cholesky factor of a correlation matrix, row after row without what is above the diagonal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Correlation {
    rows: Vec<Vec<f64>>,
}

impl Correlation {
    /// None for a matrix that is not symmetric and positive definite, or has not ones on its diagonal.
    pub(crate) fn new(matrix: &DMatrix<f64>) -> Option<Self> {
        const ROUNDING: f64 = 1e-9;
        let near = |a: f64, b: f64| (a - b).abs() <= ROUNDING;
        let n = matrix.nrows();
        let is_correlation = matrix.is_square()
            && (0..n).all(|i| near(matrix[(i, i)], 1.0))
            && (0..n).all(|i| (0..i).all(|j| near(matrix[(i, j)], matrix[(j, i)])));
        let factor = is_correlation.then(|| matrix.clone().cholesky()).flatten()?.unpack();
        Some(Self { rows: (0..n).map(|i| (0..=i).map(|j| factor[(i, j)]).collect()).collect() })
    }

    /// Correlated standard normals from independent ones.
    pub(crate) fn colour(&self, white: &[f64]) -> Vec<f64> {
        self.rows.iter().map(|row| dot(row, white)).collect()
    }

    /// Log density of correlated standard normals, less that of independent ones.
    pub(crate) fn ln_gain(&self, z: &[f64]) -> f64 {
        let mut white: Vec<f64> = Vec::with_capacity(z.len());
        let mut ln = 0.0;
        for (row, z) in self.rows.iter().zip(z) {
            let w = (z - dot(row, &white)) / row[white.len()];
            ln += 0.5 * (z * z - w * w) - row[white.len()].ln();
            white.push(w);
        }
        ln
    }

    /// The inverse of the correlation matrix.
    pub(crate) fn precision(&self) -> DMatrix<f64> {
        let n = self.rows.len();
        let factor = DMatrix::from_fn(n, n, |i, j| self.rows[i].get(j).copied().unwrap_or(0.0));
        // A diagonal without zeros always has an inverse.
        let inverse = factor.solve_lower_triangular(&DMatrix::identity(n, n)).unwrap_or(factor);
        inverse.transpose() * inverse
    }

    /// Correlated standard normals within a window, by rejection; none for a try that is refused. One after another is drawn within its
    /// interval, and the whole kept in proportion to the mass of its path, against the most mass that intervals so wide can have.
    pub(crate) fn sample_within<R: Rng + ?Sized>(
        &self,
        window: &[[f64; 2]],
        rng: &mut R,
    ) -> Option<Vec<f64>> {
        let (mut white, mut share) = (Vec::with_capacity(window.len()), 1.0);
        for (row, w) in self.rows.iter().zip(window) {
            let (shift, sd) = (dot(row, &white), row[white.len()]);
            let [low, high] = w.map(|w| (w - shift) / sd);
            let half = 0.5 * (high - low);
            share *= mass(low, high) / mass(-half, half).max(f64::MIN_POSITIVE);
            white.push(truncated_quantile(low, high, rng.random()));
        }
        (rng.random::<f64>() < share).then(|| self.colour(&white))
    }
}

/// Sum of the products of as many as there are in the second.
fn dot(row: &[f64], values: &[f64]) -> f64 {
    row.iter().zip(values).map(|(a, b)| a * b).sum()
}
