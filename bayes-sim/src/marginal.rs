//! The prior of one parameter.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use crate::normal::truncated_quantile;

/// The prior of one parameter. Its *coordinate* is the parameter, or the logarithm of it where a logarithm is in the name.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Marginal {
    /// Flat between two bounds.
    Uniform {
        /// Lower bound.
        low: f64,
        /// Upper bound.
        high: f64,
    },
    /// Flat in the logarithm between two positive bounds.
    LogUniform {
        /// Lower bound, above 0.
        low: f64,
        /// Upper bound.
        high: f64,
    },
    /// Gaussian.
    Normal {
        /// Mean.
        mean: f64,
        /// Standard deviation, above 0.
        sd: f64,
    },
    /// Gaussian in the logarithm.
    LogNormal {
        /// Mean of the logarithm.
        mean: f64,
        /// Standard deviation of the logarithm, above 0.
        sd: f64,
    },
}

impl Marginal {
    pub(crate) fn is_valid(self) -> bool {
        match self {
            Self::Uniform { low, high } => low < high && (high - low).is_finite(),
            Self::LogUniform { low, high } => 0.0 < low && low < high && high.is_finite(),
            Self::Normal { mean, sd } | Self::LogNormal { mean, sd } => {
                mean.is_finite() && sd > 0.0 && sd.is_finite()
            }
        }
    }

    pub(crate) fn is_log(self) -> bool {
        matches!(self, Self::LogUniform { .. } | Self::LogNormal { .. })
    }

    /// The coordinate of a value: itself, or its logarithm.
    pub fn coordinate(self, value: f64) -> f64 {
        if self.is_log() { value.ln() } else { value }
    }

    /// The value at a coordinate.
    pub fn value(self, coordinate: f64) -> f64 {
        // Rounding of the exponential must not step over a bound.
        match self {
            Self::LogUniform { low, high } => coordinate.exp().clamp(low, high),
            Self::LogNormal { .. } => coordinate.exp(),
            Self::Uniform { .. } | Self::Normal { .. } => coordinate,
        }
    }

    /// Bounds of the coordinate; infinite for Gaussian ones.
    pub fn bounds(self) -> [f64; 2] {
        match self {
            Self::Uniform { low, high } => [low, high],
            Self::LogUniform { low, high } => [low.ln(), high.ln()],
            Self::Normal { .. } | Self::LogNormal { .. } => [f64::NEG_INFINITY, f64::INFINITY],
        }
    }

    /// Log density of the coordinate.
    pub fn ln_density(self, coordinate: f64) -> f64 {
        match self {
            Self::Uniform { .. } | Self::LogUniform { .. } => {
                let [low, high] = self.bounds();
                if coordinate < low || coordinate > high { f64::NEG_INFINITY } else { -(high - low).ln() }
            }
            Self::Normal { mean, sd } | Self::LogNormal { mean, sd } => {
                let z = (coordinate - mean) / sd;
                -0.5 * z * z - sd.ln() - 0.5 * (2.0 * std::f64::consts::PI).ln()
            }
        }
    }

    /// Mean and standard deviation of the coordinate, if it is Gaussian.
    pub(crate) fn gaussian(self) -> Option<[f64; 2]> {
        match self {
            Self::Normal { mean, sd } | Self::LogNormal { mean, sd } => Some([mean, sd]),
            Self::Uniform { .. } | Self::LogUniform { .. } => None,
        }
    }

    /// A coordinate drawn within a window.
    pub(crate) fn sample_within<R: Rng + ?Sized>(self, window: [f64; 2], rng: &mut R) -> f64 {
        let u = rng.random::<f64>();
        match self {
            Self::Uniform { .. } | Self::LogUniform { .. } => window[0] + (window[1] - window[0]) * u,
            Self::Normal { mean, sd } | Self::LogNormal { mean, sd } => {
                let [low, high] = window.map(|w| (w - mean) / sd);
                mean + sd * truncated_quantile(low, high, u)
            }
        }
    }

    pub(crate) fn sample<R: Rng + ?Sized>(self, rng: &mut R) -> f64 {
        match self {
            Self::Uniform { .. } | Self::LogUniform { .. } => {
                let [low, high] = self.bounds();
                low + (high - low) * rng.random::<f64>()
            }
            Self::Normal { mean, sd } | Self::LogNormal { mean, sd } => {
                let z: f64 = StandardNormal.sample(rng);
                mean + sd * z
            }
        }
    }
}
