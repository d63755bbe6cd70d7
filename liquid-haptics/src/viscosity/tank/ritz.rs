//! What Ritz's method is made of here: a mode's integrals, quadrature, the lowest mode of two matrices.

use std::f64::consts::PI;

use nalgebra::{DMatrix, SymmetricEigen};

/// Integrals over a mode's potential: its `omega^2 / g`, the squares of its gradient over volume and over wall.
#[derive(Debug, Clone, Copy)]
pub(super) struct Integrals {
    pub(super) wave_number: f64,
    pub(super) volume: f64,
    pub(super) wall: f64,
}

/// Gauss-Legendre nodes and weights on [0, 1] of that many points, by Newton's method on the polynomial.
pub(super) fn gauss(points: usize) -> Vec<(f64, f64)> {
    (0..points)
        .map(|k| {
            let mut x = (PI * (k as f64 + 0.75) / (points as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..20 {
                let (mut before, mut here) = (1.0, x);
                for n in 2..=points {
                    let n = n as f64;
                    (before, here) = (here, ((2.0 * n - 1.0) * x * here - (n - 1.0) * before) / n);
                }
                slope = points as f64 * (x * here - before) / (x * x - 1.0);
                x -= here / slope;
            }
            (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// The lowest eigenvalue of `stiff x = lambda mass x` (the mass may be singular), and its vector of unit mass.
pub(super) fn lowest(stiff: &DMatrix<f64>, mass: &DMatrix<f64>) -> Option<(f64, Vec<f64>)> {
    let lower = stiff.clone().cholesky()?.l();
    let half = lower.solve_lower_triangular(mass)?;
    let whole = lower.solve_lower_triangular(&half.transpose())?;
    let eigen = SymmetricEigen::new(0.5 * (&whole + whole.transpose()));
    let (k, inverse) = eigen.eigenvalues.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let vector = lower.transpose().solve_upper_triangular(&eigen.eigenvectors.column(k).into_owned())?;
    (inverse > 0.0).then(|| (1.0 / inverse, vector.iter().map(|v| v / inverse.sqrt()).collect()))
}
