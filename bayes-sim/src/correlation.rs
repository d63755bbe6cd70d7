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
    /// interval, and the whole accepted in proportion to the mass of its path, against the most mass that intervals so wide can have.
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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;
    use crate::scaling::mean_sd;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Draws within a window have the moments of direct draws that happen to fall into it.
    #[test]
    fn within_a_window_draws_are_those_that_fall_into_it() {
        let matrix = DMatrix::from_row_slice(3, 3, &[1.0, 0.9, -0.4, 0.9, 1.0, -0.6, -0.4, -0.6, 1.0]);
        let correlation = Correlation::new(&matrix).unwrap();
        let window = [[-0.5, 1.5], [0.2, 2.0], [-3.0, 0.3]];
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut direct = Vec::new();
        while direct.len() < 20_000 {
            let white: Vec<f64> = (0..3).map(|_| StandardNormal.sample(&mut rng)).collect();
            let z = correlation.colour(&white);
            if z.iter().zip(&window).all(|(z, w)| *z >= w[0] && *z <= w[1]) {
                direct.push(z);
            }
        }
        let drawn: Vec<Vec<f64>> =
            (0..200_000).filter_map(|_| correlation.sample_within(&window, &mut rng)).take(20_000).collect();
        assert_eq!(drawn.len(), 20_000);
        for i in 0..3 {
            for j in 0..=i {
                let of = |z: &Vec<f64>| z[i] * if i == j { 1.0 } else { z[j] };
                let [a, b] = [&direct, &drawn].map(|all| mean_sd(&all.iter().map(of).collect::<Vec<f64>>()));
                // Five standard errors of the difference.
                assert!((a.0 - b.0).abs() < 5.0 * a.1 * (2.0 / 20_000.0_f64).sqrt(), "{i} {j}: {a:?} {b:?}");
            }
        }
    }
}
