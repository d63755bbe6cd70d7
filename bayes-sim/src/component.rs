//! One Gaussian of a mixture.

use nalgebra::{DMatrix, DVector};

use crate::normal::ln_norm;

/// One Gaussian: `factor (x - mean)` is standard normal, `factor` lower triangular with a positive diagonal.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Component {
    pub(crate) ln_weight: f64,
    pub(crate) mean: DVector<f64>,
    pub(crate) factor: DMatrix<f64>,
}

impl Component {
    pub(crate) fn from_covariance(
        ln_weight: f64,
        mean: DVector<f64>,
        covariance: DMatrix<f64>,
    ) -> Option<Self> {
        let n = mean.len();
        let lower = covariance.cholesky()?.unpack();
        let factor = lower.solve_lower_triangular(&DMatrix::identity(n, n))?;
        factor.iter().all(|f| f.is_finite()).then_some(Self { ln_weight, mean, factor })
    }

    /// From a precision matrix.
    pub(crate) fn from_precision(
        ln_weight: f64,
        mean: DVector<f64>,
        precision: DMatrix<f64>,
    ) -> Option<Self> {
        let covariance = precision.cholesky()?.inverse();
        Self::from_covariance(ln_weight, mean, covariance)
    }

    pub(crate) fn dim(&self) -> usize {
        self.mean.len()
    }

    fn ln_determinant(&self) -> f64 {
        self.factor.diagonal().iter().map(|f| f.ln()).sum()
    }

    /// Log density, without the weight.
    pub(crate) fn ln_density(&self, x: &[f64]) -> f64 {
        let d = self.dim();
        let mut squares = 0.0;
        for i in 0..d {
            let y: f64 = (0..=i).map(|j| self.factor[(i, j)] * (x[j] - self.mean[j])).sum();
            squares += y * y;
        }
        ln_norm(d) + self.ln_determinant() - 0.5 * squares
    }

    pub(crate) fn precision(&self) -> DMatrix<f64> {
        self.factor.transpose() * &self.factor
    }

    /// Lower triangular square root of the covariance.
    pub(crate) fn spread(&self) -> DMatrix<f64> {
        let n = self.dim();
        // The diagonal is positive, so that the system has a solution.
        self.factor.solve_lower_triangular(&DMatrix::identity(n, n)).unwrap_or_else(|| DMatrix::zeros(n, n))
    }

    pub(crate) fn covariance(&self) -> DMatrix<f64> {
        let spread = self.spread();
        &spread * spread.transpose()
    }
}
