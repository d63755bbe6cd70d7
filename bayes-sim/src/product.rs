//! Posteriors of independent observations of the same parameters, put together: their product divided by the prior to the power of
//! one less than their number.

use nalgebra::{DMatrix, DVector};

use crate::component::Component;
use crate::error::Error;
use crate::mixture::Mixture;
use crate::normal::ln_sum_exp;
use crate::posterior::Posterior;
use crate::prior::Prior;

/// Most components that are carried from one factor to the next.
const CARRIED: usize = 24;
/// Most candidates that are merged down to them.
const CANDIDATES: usize = 80;

impl Posterior {
    /// The posterior of all observations together, from the posterior of each. Exact but for the merging of components down to
    /// 24 after each factor, which keeps the mean and the covariance of what it merges.
    ///
    /// # Errors
    /// [`Error::TooFew`] for none; [`Error::Mismatch`] for different priors; [`Error::ImproperProduct`] where a Gaussian prior
    /// divided out leaves no density.
    pub fn product(posteriors: &[Posterior]) -> Result<Posterior, Error> {
        let first = posteriors.first().ok_or(Error::TooFew { least: 1, got: 0 })?;
        let prior = first.prior();
        if let Some(other) = posteriors.iter().find(|p| p.prior() != prior) {
            return Err(Error::Mismatch {
                what: "priors",
                left: format!("{prior:?}"),
                right: format!("{:?}", other.prior()),
            });
        }
        let improper = Error::ImproperProduct { count: posteriors.len() };
        let divisor = Information::of_prior(prior);
        let mut carried = first.mixture().components.clone();
        for factor in &posteriors[1..] {
            let factors: Vec<Information> =
                factor.mixture().components.iter().map(|c| Information::of(c).minus(&divisor)).collect();
            let mut candidates: Vec<(f64, Information)> = Vec::with_capacity(carried.len() * factors.len());
            for a in carried.iter().map(Information::of) {
                for b in &factors {
                    let together = a.plus(b);
                    if let Some(ln_weight) = together.ln_mass() {
                        candidates.push((ln_weight, together));
                    }
                }
            }
            candidates.sort_by(|a, b| b.0.total_cmp(&a.0));
            candidates.truncate(CANDIDATES);
            let top = candidates.first().map_or(f64::NAN, |c| c.0);
            carried = candidates
                .into_iter()
                .take_while(|c| c.0 > top - 20.0)
                .filter_map(|(ln_weight, c)| c.component(ln_weight))
                .collect();
            if carried.is_empty() {
                return Err(improper);
            }
            carried = merged(Mixture::normalised(carried).components, CARRIED);
        }
        Posterior::new(prior.clone(), Mixture::normalised(carried))
    }
}

/// A weighted Gaussian as `exp(constant + shift . x - x' precision x / 2)`.
#[derive(Debug, Clone)]
struct Information {
    constant: f64,
    shift: DVector<f64>,
    precision: DMatrix<f64>,
}

impl Information {
    fn of(component: &Component) -> Self {
        let precision = component.precision();
        let shift = &precision * &component.mean;
        let zero = vec![0.0; component.dim()];
        let constant = component.ln_weight + component.ln_density(&zero);
        Self { constant, shift, precision }
    }

    /// Flat priors are constant: nothing to divide out but a constant.
    fn of_prior(prior: &Prior) -> Self {
        let (precision, shift) = prior.information();
        Self { constant: 0.0, shift, precision }
    }

    fn plus(&self, other: &Self) -> Self {
        Self {
            constant: self.constant + other.constant,
            shift: &self.shift + &other.shift,
            precision: &self.precision + &other.precision,
        }
    }

    fn minus(&self, other: &Self) -> Self {
        Self {
            constant: self.constant - other.constant,
            shift: &self.shift - &other.shift,
            precision: &self.precision - &other.precision,
        }
    }

    /// `ln` of the integral, up to a constant of the dimension; none where it is infinite.
    fn ln_mass(&self) -> Option<f64> {
        let factor = self.precision.clone().cholesky()?;
        let ln_determinant: f64 = factor.l_dirty().diagonal().iter().map(|l| l.ln()).sum();
        let ln = self.constant + 0.5 * self.shift.dot(&factor.solve(&self.shift)) - ln_determinant;
        ln.is_finite().then_some(ln)
    }

    fn component(&self, ln_weight: f64) -> Option<Component> {
        let mean = self.precision.clone().cholesky()?.solve(&self.shift);
        Component::from_precision(ln_weight, mean, self.precision.clone())
    }
}

/// A component by its moments.
#[derive(Debug, Clone)]
struct Blob {
    weight: f64,
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
    ln_determinant: f64,
}

impl Blob {
    fn new(weight: f64, mean: DVector<f64>, covariance: DMatrix<f64>) -> Self {
        let diagonal = covariance.clone().cholesky().map(|c| c.l_dirty().diagonal());
        let ln_determinant = diagonal.map_or(f64::INFINITY, |d| 2.0 * d.iter().map(|l| l.ln()).sum::<f64>());
        Self { weight, mean, covariance, ln_determinant }
    }

    fn with(&self, other: &Self) -> Self {
        let weight = self.weight + other.weight;
        let (a, b) = (self.weight / weight, other.weight / weight);
        let away = &self.mean - &other.mean;
        let covariance = &self.covariance * a + &other.covariance * b + &away * away.transpose() * (a * b);
        Self::new(weight, &self.mean * a + &other.mean * b, covariance)
    }

    /// Bound on the divergence that merging costs (Runnalls 2007, doi:10.1109/TAES.2007.4383588, eq. 21).
    fn cost(&self, other: &Self) -> f64 {
        let both = self.with(other);
        0.5 * (both.weight * both.ln_determinant
            - self.weight * self.ln_determinant
            - other.weight * other.ln_determinant)
    }
}

/// Merges the cheapest pair until `most` are left.
fn merged(components: Vec<Component>, most: usize) -> Vec<Component> {
    if components.len() <= most {
        return components;
    }
    let mut blobs: Vec<Blob> = components
        .into_iter()
        .map(|c| Blob::new(c.ln_weight.exp(), c.mean.clone(), c.covariance()))
        .collect();
    let costs_of =
        |blobs: &[Blob], i: usize| -> Vec<f64> { (0..i).map(|j| blobs[i].cost(&blobs[j])).collect() };
    let mut costs: Vec<Vec<f64>> = (0..blobs.len()).map(|i| costs_of(&blobs, i)).collect();
    while blobs.len() > most {
        let pairs = costs
            .iter()
            .enumerate()
            .flat_map(|(i, row)| row.iter().enumerate().map(move |(j, c)| (*c, i, j)));
        let Some((_, i, j)) = pairs.min_by(|a, b| a.0.total_cmp(&b.0)) else { break };
        let both = blobs[i].with(&blobs[j]);
        // j < i: remove the later one, put the merged one in the place of the earlier.
        blobs.remove(i);
        costs.remove(i);
        costs.iter_mut().filter(|row| row.len() > i).for_each(|row| {
            row.remove(i);
        });
        blobs[j] = both;
        costs[j] = costs_of(&blobs, j);
        for k in j + 1..blobs.len() {
            costs[k][j] = blobs[k].cost(&blobs[j]);
        }
    }
    let back =
        blobs.into_iter().filter_map(|b| Component::from_covariance(b.weight.ln(), b.mean, b.covariance));
    Mixture::normalised(back.collect()).components
}

impl Mixture {
    /// A mixture of at most `most` components (at least 1), merged pair by pair where it costs least (Runnalls 2007); mean and
    /// covariance stay.
    pub fn reduced(&self, most: usize) -> Mixture {
        Mixture { components: merged(self.components.clone(), most.max(1)) }
    }

    /// The product of two mixtures over the same space, scaled to one.
    ///
    /// # Errors
    /// [`Error::Length`] for different dimensions; [`Error::ImproperProduct`] where they are so far apart that nothing is left.
    pub fn product(&self, other: &Mixture) -> Result<Mixture, Error> {
        if self.dim() != other.dim() {
            return Err(Error::Length { what: "mixture", expected: self.dim(), got: other.dim() });
        }
        let right: Vec<Information> = other.components.iter().map(Information::of).collect();
        let pairs = self.components.iter().map(Information::of).flat_map(|a| {
            right
                .iter()
                .filter_map(move |b| {
                    let together = a.plus(b);
                    together.component(together.ln_mass()?)
                })
                .collect::<Vec<_>>()
        });
        let components: Vec<Component> = pairs.collect();
        if !ln_sum_exp(components.iter().map(|c| c.ln_weight)).is_finite() {
            return Err(Error::ImproperProduct { count: 2 });
        }
        Ok(Mixture::normalised(components))
    }
}
