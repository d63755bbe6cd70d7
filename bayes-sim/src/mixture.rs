//! A mixture of Gaussians as a value.

use nalgebra::{DMatrix, DVector};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use crate::component::Component;
use crate::error::Error;
use crate::normal::ln_sum_exp;
use crate::points::{Points, check_length};

/// Gaussians with full covariance and weights that add up to one.
#[derive(Debug, Clone, PartialEq)]
pub struct Mixture {
    pub(crate) components: Vec<Component>,
}

/// A local maximum of a density.
#[derive(Debug, Clone, PartialEq)]
pub struct Mode {
    /// Where.
    pub at: Vec<f64>,
    /// Log density there.
    pub ln_density: f64,
}

impl Mixture {
    /// From weights (any positive scale), means and covariances (`dim x dim`, row after row; only the lower half is read).
    ///
    /// # Errors
    /// [`Error::TooFew`] for none; [`Error::Length`]; [`Error::Setting`] for a weight that is not above 0 or not finite;
    /// [`Error::NotPositiveDefinite`].
    pub fn new(weights: &[f64], means: &Points, covariances: &[Vec<f64>]) -> Result<Self, Error> {
        let d = means.dim();
        if weights.is_empty() {
            return Err(Error::TooFew { least: 1, got: 0 });
        }
        check_length("weights", weights, means.len())?;
        means.check_finite("means")?;
        if covariances.len() != weights.len() {
            return Err(Error::Length {
                what: "covariances",
                expected: weights.len(),
                got: covariances.len(),
            });
        }
        let mut components = Vec::with_capacity(weights.len());
        for (k, (&weight, covariance)) in weights.iter().zip(covariances).enumerate() {
            check_length("covariance", covariance, d * d)?;
            if !(weight > 0.0 && weight.is_finite()) {
                return Err(Error::Setting { name: "weight", value: weight, rule: "above 0 and finite" });
            }
            let matrix = DMatrix::from_row_slice(d, d, covariance);
            let mean = DVector::from_column_slice(means.row(k));
            let component = Component::from_covariance(weight.ln(), mean, matrix);
            components.push(component.ok_or(Error::NotPositiveDefinite { component: k })?);
        }
        Ok(Self::normalised(components))
    }

    /// Scales the weights to one.
    pub(crate) fn normalised(mut components: Vec<Component>) -> Self {
        let total = ln_sum_exp(components.iter().map(|c| c.ln_weight));
        components.iter_mut().for_each(|c| c.ln_weight -= total);
        Self { components }
    }

    /// Number of dimensions.
    pub fn dim(&self) -> usize {
        self.components.first().map_or(0, Component::dim)
    }

    /// Number of components.
    pub fn len(&self) -> usize {
        self.components.len()
    }

    /// Whether there are no components; never, from a constructor.
    pub fn is_empty(&self) -> bool {
        self.components.is_empty()
    }

    /// Weight of each component.
    pub fn weights(&self) -> Vec<f64> {
        self.components.iter().map(|c| c.ln_weight.exp()).collect()
    }

    /// Mean of component `k`; empty beyond the end.
    pub fn component_mean(&self, k: usize) -> &[f64] {
        self.components.get(k).map_or(&[], |c| c.mean.as_slice())
    }

    /// Covariance of component `k`, row after row; empty beyond the end.
    pub fn component_covariance(&self, k: usize) -> Vec<f64> {
        self.components.get(k).map_or_else(Vec::new, |c| c.covariance().as_slice().to_vec())
    }

    /// Log density.
    ///
    /// # Errors
    /// [`Error::Length`].
    pub fn ln_density(&self, x: &[f64]) -> Result<f64, Error> {
        check_length("point", x, self.dim())?;
        Ok(self.ln_density_unchecked(x))
    }

    pub(crate) fn ln_density_unchecked(&self, x: &[f64]) -> f64 {
        let mut top = f64::NEG_INFINITY;
        let mut sum = 0.0;
        // One pass, rescaled whenever a larger term comes.
        for c in &self.components {
            let term = c.ln_weight + c.ln_density(x);
            if term > top {
                sum = sum * (top - term).exp() + 1.0;
                top = term;
            } else if term > f64::NEG_INFINITY {
                sum += (term - top).exp();
            }
        }
        top + sum.ln()
    }

    /// Draws `count` points.
    pub fn sample<R: Rng + ?Sized>(&self, count: usize, rng: &mut R) -> Points {
        let (d, spreads) = (self.dim(), self.spreads());
        let cumulative = cumulative(self.components.iter().map(|c| c.ln_weight.exp()));
        let mut values = Vec::with_capacity(count * d);
        for _ in 0..count {
            let k = pick(&cumulative, rng);
            draw(&self.components[k].mean, &spreads[k], rng, &mut values);
        }
        Points::from_values(d.max(1), values).unwrap_or_else(|_| Points::new(d))
    }

    pub(crate) fn spreads(&self) -> Vec<DMatrix<f64>> {
        self.components.iter().map(Component::spread).collect()
    }

    fn check_indices(&self, indices: &[usize], most: usize) -> Result<(), Error> {
        let dim = self.dim();
        let different = indices.iter().enumerate().all(|(i, a)| !indices[..i].contains(a));
        if indices.is_empty() || indices.len() > most || !different || indices.iter().any(|&i| i >= dim) {
            return Err(Error::Indices { indices: indices.to_vec(), dim });
        }
        Ok(())
    }

    /// The mixture of these dimensions alone, in this order.
    ///
    /// # Errors
    /// [`Error::Indices`] for none, repeated or too large ones.
    pub fn marginal(&self, indices: &[usize]) -> Result<Self, Error> {
        self.check_indices(indices, self.dim())?;
        let each = self.components.iter().enumerate().map(|(component, c)| {
            let covariance = c.covariance().select_rows(indices).select_columns(indices);
            Component::from_covariance(c.ln_weight, c.mean.select_rows(indices), covariance)
                .ok_or(Error::NotPositiveDefinite { component })
        });
        Ok(Self { components: each.collect::<Result<_, _>>()? })
    }

    /// The mixture of the other dimensions, in order, where these have the given values.
    ///
    /// # Errors
    /// [`Error::Indices`] for none, all, repeated or too large ones; [`Error::Length`].
    pub fn conditional(&self, indices: &[usize], values: &[f64]) -> Result<Self, Error> {
        self.check_indices(indices, self.dim().saturating_sub(1))?;
        check_length("values", values, indices.len())?;
        let rest: Vec<usize> = (0..self.dim()).filter(|i| !indices.contains(i)).collect();
        let known = self.marginal(indices)?;
        let mut components = Vec::with_capacity(self.len());
        for (component, (c, marginal)) in self.components.iter().zip(&known.components).enumerate() {
            let precision = c.precision();
            let inner = precision.select_rows(&rest).select_columns(&rest);
            let cross = precision.select_rows(&rest).select_columns(indices);
            let away = DVector::from_iterator(
                indices.len(),
                indices.iter().zip(values).map(|(&i, v)| v - c.mean[i]),
            );
            let failed = Error::NotPositiveDefinite { component };
            let Some(solved) = inner.clone().cholesky().map(|f| f.solve(&(cross * away))) else {
                return Err(failed);
            };
            let ln_weight = c.ln_weight + marginal.ln_density(values);
            let made = Component::from_precision(ln_weight, c.mean.select_rows(&rest) - solved, inner);
            components.push(made.ok_or(failed)?);
        }
        Ok(Self::normalised(components))
    }

    /// Mean.
    pub fn mean(&self) -> Vec<f64> {
        self.moments().0.as_slice().to_vec()
    }

    /// Covariance, row after row.
    pub fn covariance(&self) -> Vec<f64> {
        self.moments().1.as_slice().to_vec()
    }

    pub(crate) fn moments(&self) -> (DVector<f64>, DMatrix<f64>) {
        let d = self.dim();
        let mut mean = DVector::zeros(d);
        self.components.iter().for_each(|c| mean += &c.mean * c.ln_weight.exp());
        let mut covariance = DMatrix::zeros(d, d);
        for c in &self.components {
            let away = &c.mean - &mean;
            covariance += (c.covariance() + &away * away.transpose()) * c.ln_weight.exp();
        }
        (mean, covariance)
    }

    /// The Gaussian with this mixture's mean and covariance: the closest in the Kullback-Leibler sense.
    ///
    /// # Errors
    /// [`Error::NotPositiveDefinite`] where rounding has made it singular.
    pub fn projection(&self) -> Result<Self, Error> {
        let (mean, covariance) = self.moments();
        let made = Component::from_covariance(0.0, mean, covariance);
        Ok(Self { components: vec![made.ok_or(Error::NotPositiveDefinite { component: 0 })?] })
    }
}

/// Running sums of weights.
pub(crate) fn cumulative(weights: impl Iterator<Item = f64>) -> Vec<f64> {
    weights
        .scan(0.0, |sum, w| {
            *sum += w;
            Some(*sum)
        })
        .collect()
}

/// An index with probability proportional to its weight.
pub(crate) fn pick<R: Rng + ?Sized>(cumulative: &[f64], rng: &mut R) -> usize {
    let total = cumulative.last().copied().unwrap_or(0.0);
    let at = total * rng.random::<f64>();
    cumulative.partition_point(|&c| c <= at).min(cumulative.len().saturating_sub(1))
}

/// One normal draw, appended.
pub(crate) fn draw<R: Rng + ?Sized>(
    mean: &DVector<f64>,
    spread: &DMatrix<f64>,
    rng: &mut R,
    out: &mut Vec<f64>,
) {
    let start = out.len();
    out.extend(mean.iter());
    for j in 0..mean.len() {
        let z: f64 = StandardNormal.sample(rng);
        for i in j..mean.len() {
            out[start + i] += spread[(i, j)] * z;
        }
    }
}
