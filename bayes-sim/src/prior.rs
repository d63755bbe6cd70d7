//! Priors: flat or Gaussian, in the parameter or its logarithm; Gaussian ones may be correlated.

use nalgebra::{DMatrix, DVector};
use rand::Rng;
use serde::{Deserialize, Serialize};

use crate::correlation::Correlation;
use crate::error::Error;
use crate::points::{Points, check_length};

pub use crate::marginal::Marginal;

/// The prior of all parameters: independent but for the correlations of Gaussian ones.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Prior {
    marginals: Vec<Marginal>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    correlation: Option<Correlation>,
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
            None => Ok(Self { marginals, correlation: None }),
        }
    }

    /// A prior whose Gaussian coordinates (log-normal ones: their logarithms) are correlated; `correlation` is dim x dim with ones on
    /// the diagonal, and zeros elsewhere in the rows of flat parameters.
    ///
    /// # Errors
    /// As [`Prior::new`]; [`Error::Length`] for a matrix of another size; [`Error::Correlation`] for one that is no correlation
    /// matrix, or correlates a flat parameter.
    pub fn correlated(marginals: Vec<Marginal>, correlation: &DMatrix<f64>) -> Result<Self, Error> {
        let prior = Self::new(marginals)?;
        for got in [correlation.nrows(), correlation.ncols()] {
            if got != prior.dim() {
                return Err(Error::Length { what: "correlation matrix", expected: prior.dim(), got });
            }
        }
        let bad = |reason: String| Error::Correlation { reason };
        let apart = |i: usize, j: usize| i == j || correlation[(i, j)] == 0.0;
        for i in (0..prior.dim()).filter(|&i| prior.marginals[i].gaussian().is_none()) {
            if let Some(j) = (0..prior.dim()).find(|&j| !apart(i, j)) {
                return Err(bad(format!("parameter {i} is flat, but correlated with parameter {j}")));
            }
        }
        let factor = Correlation::new(correlation).ok_or_else(|| {
            bad("it has to be symmetric and positive definite, with ones on the diagonal".to_owned())
        })?;
        Ok(Self { correlation: Some(factor), ..prior })
    }

    /// A Gaussian in all parameters together.
    ///
    /// # Errors
    /// As [`Prior::correlated`].
    pub fn gaussian(mean: &DVector<f64>, covariance: &DMatrix<f64>) -> Result<Self, Error> {
        let dim = mean.len();
        for got in [covariance.nrows(), covariance.ncols()] {
            if got != dim {
                return Err(Error::Length { what: "covariance", expected: dim, got });
            }
        }
        let sd: Vec<f64> = covariance.diagonal().iter().map(|v| v.sqrt()).collect();
        let marginals = mean.iter().zip(&sd).map(|(&mean, &sd)| Marginal::Normal { mean, sd }).collect();
        Self::correlated(marginals, &DMatrix::from_fn(dim, dim, |i, j| covariance[(i, j)] / (sd[i] * sd[j])))
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
        let ln: f64 = self.marginals.iter().zip(u).map(|(m, &u)| m.ln_density(u)).sum();
        ln + self.correlation.as_ref().map_or(0.0, |c| c.ln_gain(&self.standardised(u)))
    }

    /// Gaussian coordinates in their standard deviations; flat ones zero.
    fn standardised(&self, u: &[f64]) -> Vec<f64> {
        let z = |m: &Marginal, u: f64| m.gaussian().map_or(0.0, |[mean, sd]| (u - mean) / sd);
        self.marginals.iter().zip(u).map(|(m, &u)| z(m, u)).collect()
    }

    /// Gaussian coordinates moved to these standard deviations.
    fn place(&self, u: &mut [f64], z: &[f64]) {
        for ((m, u), z) in self.marginals.iter().zip(u).zip(z) {
            if let Some([mean, sd]) = m.gaussian() {
                *u = mean + sd * z;
            }
        }
    }

    /// Precision of the coordinates and its product with their mean; zero in flat ones.
    pub(crate) fn information(&self) -> (DMatrix<f64>, DVector<f64>) {
        let d = self.dim();
        let moments: Vec<[f64; 2]> =
            self.marginals.iter().map(|m| m.gaussian().unwrap_or([0.0, f64::INFINITY])).collect();
        let inner = self.correlation.as_ref().map_or_else(|| DMatrix::identity(d, d), Correlation::precision);
        let precision = DMatrix::from_fn(d, d, |i, j| inner[(i, j)] / (moments[i][1] * moments[j][1]));
        let shift = &precision * DVector::from_iterator(d, moments.iter().map(|m| m[0]));
        (precision, shift)
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
        let mut u: Vec<f64> = self.marginals.iter().map(|m| m.sample(rng)).collect();
        if let Some(correlation) = &self.correlation {
            let z = correlation.colour(&self.standardised(&u));
            self.place(&mut u, &z);
        }
        self.values(&u)
    }

    /// Draws one parameter vector whose coordinates are within a window; none for a try that is refused, which correlations bring.
    pub(crate) fn sample_within<R: Rng + ?Sized>(
        &self,
        window: &[[f64; 2]],
        rng: &mut R,
    ) -> Option<Vec<f64>> {
        let each = self.marginals.iter().zip(window);
        let mut u: Vec<f64> = each.clone().map(|(m, w)| m.sample_within(*w, rng)).collect();
        if let Some(correlation) = &self.correlation {
            let standard = |m: &Marginal, w: &[f64; 2]| match m.gaussian() {
                Some([mean, sd]) => w.map(|w| (w - mean) / sd),
                None => [f64::NEG_INFINITY, f64::INFINITY],
            };
            let window: Vec<[f64; 2]> = each.map(|(m, w)| standard(m, w)).collect();
            self.place(&mut u, &correlation.sample_within(&window, rng)?);
        }
        Some(self.values(&u))
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
