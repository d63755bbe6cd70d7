//! Stationary kernels, in two forms that differ above one dimension.

use serde::{Deserialize, Serialize};

/// How fast correlation falls with distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Family {
    /// Squared exponential, `exp(-r^2 / 2)`.
    Rbf,
    /// Matern with nu = 3/2, `(1 + sqrt(3) r) exp(-sqrt(3) r)`.
    Matern32,
    /// Matern with nu = 5/2, `(1 + sqrt(5) r + 5 r^2 / 3) exp(-sqrt(5) r)`: that of [Matl 2021], chapter 3.
    Matern52,
}

impl Family {
    /// Degrees of freedom 2 nu of the spectral density, a Student t; none for the Gaussian one.
    pub(crate) fn degrees_of_freedom(self) -> Option<f64> {
        match self {
            Self::Rbf => None,
            Self::Matern32 => Some(3.0),
            Self::Matern52 => Some(5.0),
        }
    }

    /// Correlation at distance `r`, in length scales.
    pub fn correlation(self, r: f64) -> f64 {
        match self {
            Self::Rbf => (-0.5 * r * r).exp(),
            Self::Matern32 => {
                let s = 3.0_f64.sqrt() * r;
                (1.0 + s) * (-s).exp()
            }
            Self::Matern52 => {
                let s = 5.0_f64.sqrt() * r;
                (1.0 + s + s * s / 3.0) * (-s).exp()
            }
        }
    }
}

/// How dimensions are put together. For the squared exponential both are the same function; for Matern they are not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Form {
    /// A function of the Euclidean distance; its spectral density is a *multivariate* t.
    Isotropic,
    /// A product over dimensions; its spectral density is a product of univariate t's.
    Product,
}

/// A stationary kernel with one length scale.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Kernel {
    /// How fast correlation falls.
    pub family: Family,
    /// How dimensions are put together.
    pub form: Form,
    /// Distance over which it falls, above 0.
    pub length_scale: f64,
}

impl Kernel {
    /// `k(a, b)`, 1 at no distance.
    pub fn correlation(&self, a: &[f64], b: &[f64]) -> f64 {
        let steps = a.iter().zip(b).map(|(a, b)| (a - b) / self.length_scale);
        match self.form {
            Form::Isotropic => self.family.correlation(steps.map(|s| s * s).sum::<f64>().sqrt()),
            Form::Product => steps.map(|s| self.family.correlation(s.abs())).product(),
        }
    }
}
