//! Priors: independent parameters, flat or Gaussian, in the parameter or its logarithm.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::normal::truncated_quantile;
use crate::points::{Points, check_length};

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
    fn is_valid(self) -> bool {
        match self {
            Self::Uniform { low, high } => low < high && (high - low).is_finite(),
            Self::LogUniform { low, high } => 0.0 < low && low < high && high.is_finite(),
            Self::Normal { mean, sd } | Self::LogNormal { mean, sd } => {
                mean.is_finite() && sd > 0.0 && sd.is_finite()
            }
        }
    }

    fn is_log(self) -> bool {
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

    fn sample<R: Rng + ?Sized>(self, rng: &mut R) -> f64 {
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

/// Independent priors of all parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Prior {
    marginals: Vec<Marginal>,
}

impl Prior {
    /// A prior of one or more parameters.
    ///
    /// # Errors
    /// [`Error::Prior`] for bounds that do not rise or are not positive under a logarithm; [`Error::TooFew`] for no parameter.
    pub fn new(marginals: Vec<Marginal>) -> Result<Self, Error> {
        if marginals.is_empty() {
            return Err(Error::TooFew { least: 1, got: 0 });
        }
        match marginals.iter().position(|m| !m.is_valid()) {
            Some(parameter) => Err(Error::Prior { parameter, prior: format!("{:?}", marginals[parameter]) }),
            None => Ok(Self { marginals }),
        }
    }

    /// Flat between two bounds for each parameter.
    ///
    /// # Errors
    /// As [`Prior::new`].
    pub fn uniform(bounds: &[[f64; 2]]) -> Result<Self, Error> {
        Self::new(bounds.iter().map(|&[low, high]| Marginal::Uniform { low, high }).collect())
    }

    /// Number of parameters.
    pub fn dim(&self) -> usize {
        self.marginals.len()
    }

    /// The prior of each parameter.
    pub fn marginals(&self) -> &[Marginal] {
        &self.marginals
    }

    /// Bounds of each coordinate; infinite for Gaussian ones.
    pub fn bounds(&self) -> Vec<[f64; 2]> {
        self.marginals.iter().map(|m| m.bounds()).collect()
    }

    /// Coordinates of a parameter vector: logarithms where the prior is in the logarithm.
    pub fn coordinates(&self, theta: &[f64]) -> Vec<f64> {
        self.marginals.iter().zip(theta).map(|(m, &t)| m.coordinate(t)).collect()
    }

    /// The parameter vector at these coordinates.
    pub fn values(&self, coordinates: &[f64]) -> Vec<f64> {
        self.marginals.iter().zip(coordinates).map(|(m, &u)| m.value(u)).collect()
    }

    /// Log density of a parameter vector; minus infinity outside.
    ///
    /// # Errors
    /// [`Error::Length`].
    pub fn ln_density(&self, theta: &[f64]) -> Result<f64, Error> {
        check_length("parameters", theta, self.dim())?;
        let u = self.coordinates(theta);
        if u.iter().any(|u| u.is_nan()) {
            return Ok(f64::NEG_INFINITY);
        }
        Ok(self.ln_density_of_coordinates(&u) + self.ln_jacobian(&u))
    }

    /// Log density of coordinates.
    pub(crate) fn ln_density_of_coordinates(&self, u: &[f64]) -> f64 {
        self.marginals.iter().zip(u).map(|(m, &u)| m.ln_density(u)).sum()
    }

    /// `ln |d coordinates / d parameters|`: what turns a log density of coordinates into one of parameters.
    pub(crate) fn ln_jacobian(&self, u: &[f64]) -> f64 {
        self.marginals.iter().zip(u).filter(|(m, _)| m.is_log()).map(|(_, &u)| -u).sum()
    }

    /// Whether a parameter vector lies within the bounds.
    pub fn contains(&self, theta: &[f64]) -> bool {
        theta.len() == self.dim() && self.outside(theta).is_none()
    }

    /// The first parameter outside its bounds.
    fn outside(&self, theta: &[f64]) -> Option<usize> {
        self.marginals.iter().zip(theta).position(|(m, &t)| {
            // The bounds themselves, whatever their logarithm rounds to.
            let [low, high] = match *m {
                Marginal::Uniform { low, high } | Marginal::LogUniform { low, high } => [low, high],
                Marginal::Normal { .. } => [f64::NEG_INFINITY, f64::INFINITY],
                Marginal::LogNormal { .. } => [f64::MIN_POSITIVE, f64::INFINITY],
            };
            !(t >= low && t <= high && t.is_finite())
        })
    }

    /// Draws one parameter vector.
    pub fn sample<R: Rng + ?Sized>(&self, rng: &mut R) -> Vec<f64> {
        self.marginals.iter().map(|m| m.value(m.sample(rng))).collect()
    }

    /// Coordinates of a table of parameters, refused where they lie outside.
    pub(crate) fn coordinates_of(&self, theta: &Points) -> Result<Points, Error> {
        let mut out = Points::new(self.dim());
        for (row, t) in theta.rows().enumerate() {
            if let Some(parameter) = self.outside(t) {
                let prior = format!("{:?}", self.marginals[parameter]);
                return Err(Error::OutsidePrior { row, parameter, value: t[parameter], prior });
            }
            let u: Vec<f64> = self.coordinates(t);
            out.push(&u)?;
        }
        Ok(out)
    }
}
