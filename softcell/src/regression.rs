//! Linear least squares with what it does not know.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Coefficients, their covariance, and the scatter about the fit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Linear {
    pub(crate) coefficients: DVector<f64>,
    /// Covariance for a scatter of one.
    inverse: DMatrix<f64>,
    pub(crate) variance: f64,
    pub(crate) freedom: usize,
}

impl Linear {
    /// Fits `rows x = values`; none where the rows do not determine x or there are no more of them than unknowns.
    pub(crate) fn fit(rows: &[Vec<f64>], values: &[f64]) -> Option<Self> {
        let unknowns = rows.first()?.len();
        if rows.len() <= unknowns {
            return None;
        }
        // Columns of one size, so that the rank is that of the data and not of the units.
        let size: Vec<f64> =
            (0..unknowns).map(|k| rows.iter().map(|r| r[k].abs()).fold(0.0, f64::max)).collect();
        if !size.iter().all(|s| *s > 0.0 && s.is_finite()) {
            return None;
        }
        let a = DMatrix::from_fn(rows.len(), unknowns, |i, k| rows[i][k] / size[k]);
        let b = DVector::from_column_slice(values);
        let svd = a.clone().svd(true, true);
        if !(svd.singular_values.min() > 1e-7 * svd.singular_values.max()) {
            return None;
        }
        let x = svd.solve(&b, 0.0).ok()?;
        let freedom = rows.len() - unknowns;
        let variance = (&a * &x - b).norm_squared() / freedom as f64;
        let inverse = (a.transpose() * a).try_inverse()?;
        let scale = DMatrix::from_fn(unknowns, unknowns, |i, k| 1.0 / (size[i] * size[k]));
        let coefficients = DVector::from_fn(unknowns, |k, _| x[k] / size[k]);
        Some(Self { coefficients, inverse: inverse.component_mul(&scale), variance, freedom })
    }

    /// The mean at a row, and its standard error.
    pub(crate) fn at(&self, row: &[f64]) -> (f64, f64) {
        let row = DVector::from_column_slice(row);
        let square = self.variance * (self.inverse.clone() * &row).dot(&row);
        (self.coefficients.dot(&row), square.max(0.0).sqrt())
    }

    /// Standard deviation of a new value at a row.
    pub(crate) fn new_sigma(&self, row: &[f64]) -> f64 {
        self.at(row).1.hypot(self.variance.sqrt())
    }

    /// Half of a 95 % interval in standard errors: Student's quantile.
    pub(crate) fn half_width(&self) -> f64 {
        StudentsT::new(0.0, 1.0, self.freedom as f64).map_or(f64::INFINITY, |t| t.inverse_cdf(0.975))
    }
}
