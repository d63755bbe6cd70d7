//! Drops of one material: Gaussian, with a spread from drop to drop and one from impact to impact within a drop (probabilistic linear
//! discriminant analysis: Prince and Elder 2007, doi:10.1109/ICCV.2007.4409052), so that several impacts of one drop, which share ball,
//! table and room, are not taken for as many witnesses.

use nalgebra::{DMatrix, DVector};

use super::observation::Observation;
use super::spectrum::{CONTACT, FEATURES};

/// Sound, restitution, density, diameter.
pub(super) const DIMENSIONS: usize = FEATURES + 3;
/// Which dimension the restitution is.
pub(super) const RESTITUTION: usize = FEATURES;
/// Least eigenvalue of a matrix of correlations, and least part that a feature's variance from drop to drop has of all materials'.
const LEAST: f64 = 0.02;

/// One drop as a point: the mean over its impacts, sound first, then restitution, density and diameter; NaN for what is not observed.
#[derive(Debug, Clone)]
pub(super) struct Point {
    pub(super) values: [f64; DIMENSIONS],
    pub(super) impacts: usize,
    pub(super) speed_variance: f64,
}

impl Point {
    /// Of the first impacts (all where there are fewer).
    pub(super) fn of(observation: &Observation, impacts: usize) -> Self {
        let sounds = &observation.sounds[..observation.sounds.len().min(impacts)];
        let mut values = [f64::NAN; DIMENSIONS];
        for (k, v) in values.iter_mut().enumerate().take(FEATURES) {
            // Of no impact this is NaN, as it should be.
            *v = sounds.iter().map(|s| s[k]).sum::<f64>() / sounds.len() as f64;
        }
        let scalars = [observation.logit_restitution, observation.ln_density, observation.ln_diameter];
        for (v, scalar) in values[FEATURES..].iter_mut().zip(scalars) {
            *v = scalar.unwrap_or(f64::NAN);
        }
        Self { values, impacts: sounds.len(), speed_variance: observation.speed_variance }
    }
}

/// Mean and spread of the drops of one material, standardised.
#[derive(Debug, Clone)]
pub(super) struct Material {
    pub(super) mean: DVector<f64>,
    pub(super) between: DMatrix<f64>,
}

/// What is shared by all materials: scales of the features, and the spread within a drop.
#[derive(Debug, Clone)]
pub(super) struct Shared {
    pub(super) means: [f64; DIMENSIONS],
    pub(super) scales: [f64; DIMENSIONS],
    pub(super) within: DMatrix<f64>,
}

impl Shared {
    /// Values along some dimensions, standardised.
    pub(super) fn standard(&self, point: &Point, along: &[usize]) -> DVector<f64> {
        DVector::from_iterator(
            along.len(),
            along.iter().map(|&k| (point.values[k] - self.means[k]) / self.scales[k]),
        )
    }

    /// What the impacts within a drop add to the covariance.
    pub(super) fn noise(&self, impacts: usize, speed_variance: f64) -> DMatrix<f64> {
        let mut noise = &self.within / impacts.max(1) as f64;
        noise[(CONTACT, CONTACT)] += speed_variance / self.scales[CONTACT].powi(2);
        noise
    }
}

/// Covariance of rows about their mean, and the mean.
pub(super) fn moments(rows: &[DVector<f64>]) -> (DVector<f64>, DMatrix<f64>) {
    let n = rows.len().max(1) as f64;
    let mean = rows.iter().fold(DVector::zeros(DIMENSIONS), |sum, r| sum + r) / n;
    let mut covariance = DMatrix::zeros(DIMENSIONS, DIMENSIONS);
    for row in rows {
        let off = row - &mean;
        covariance.ger(1.0 / (n - 1.0).max(1.0), &off, &off, 1.0);
    }
    (mean, covariance)
}

/// A covariance whose correlations are drawn to those of another by a share; so are its variances of the sound, but not those of what is measured
/// once a drop, which differ from material to material by far more than they are uncertain.
pub(super) fn drawn(own: &DMatrix<f64>, all: &DMatrix<f64>, share: f64) -> DMatrix<f64> {
    let sds = |matrix: &DMatrix<f64>| -> Vec<f64> {
        let least = |k: usize| if k < FEATURES { LEAST * all[(k, k)].max(LEAST) } else { 1e-8 };
        (0..DIMENSIONS).map(|k| matrix[(k, k)].max(least(k)).sqrt()).collect()
    };
    let correlation = |matrix: &DMatrix<f64>, sds: &[f64]| {
        DMatrix::from_fn(DIMENSIONS, DIMENSIONS, |i, j| {
            if i == j { 1.0 } else { (matrix[(i, j)] / (sds[i] * sds[j])).clamp(-1.0, 1.0) }
        })
    };
    let (mine, theirs) = (sds(own), sds(all));
    let mixed = correlation(own, &mine) * (1.0 - share) + correlation(all, &theirs) * share;
    let eigen = mixed.symmetric_eigen();
    let values = eigen.eigenvalues.map(|v| v.max(LEAST));
    let lifted = &eigen.eigenvectors * DMatrix::from_diagonal(&values) * eigen.eigenvectors.transpose();
    let sd = |k: usize| {
        if k < FEATURES { mine[k].powf(1.0 - share) * theirs[k].powf(share) } else { mine[k] }
    };
    DMatrix::from_fn(DIMENSIONS, DIMENSIONS, |i, j| lifted[(i, j)] * sd(i) * sd(j))
}

/// A Gaussian along some dimensions.
#[derive(Debug, Clone)]
pub(super) struct Factor {
    mean: DVector<f64>,
    lower: DMatrix<f64>,
    ln_scale: f64,
}

impl Factor {
    /// Of a material, with what the impacts add; `None` where it is no covariance.
    pub(super) fn new(material: &Material, noise: &DMatrix<f64>, along: &[usize]) -> Option<Self> {
        let covariance = picked(&(&material.between + noise), along, along);
        let lower = covariance.cholesky()?.unpack();
        let ln_scale = lower.diagonal().iter().map(|v| v.ln()).sum::<f64>();
        let mean = DVector::from_iterator(along.len(), along.iter().map(|&k| material.mean[k]));
        Some(Self { mean, lower, ln_scale })
    }

    /// Squared distance from the mean in the covariance's metric.
    pub(super) fn distance(&self, x: &DVector<f64>) -> f64 {
        let off = x - &self.mean;
        // A Cholesky factor has an inverse.
        self.lower.solve_lower_triangular(&off).map_or(f64::INFINITY, |z| z.norm_squared())
    }

    /// Log density but for a constant that all materials share.
    pub(super) fn ln_density(&self, x: &DVector<f64>) -> f64 {
        -0.5 * self.distance(x) - self.ln_scale
    }
}

/// Rows and columns of a matrix.
pub(super) fn picked(matrix: &DMatrix<f64>, rows: &[usize], columns: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), columns.len(), |i, j| matrix[(rows[i], columns[j])])
}

/// Mean and variance of one dimension given others, standardised.
pub(super) fn conditional(
    material: &Material,
    noise: &DMatrix<f64>,
    wanted: usize,
    along: &[usize],
    x: &DVector<f64>,
) -> Option<[f64; 2]> {
    let covariance = &material.between + noise;
    let own = covariance[(wanted, wanted)];
    let cross = picked(&covariance, along, &[wanted]);
    let solved = picked(&covariance, along, along).cholesky()?.solve(&cross);
    let off =
        DVector::from_iterator(along.len(), along.iter().enumerate().map(|(i, &k)| x[i] - material.mean[k]));
    let shift = (solved.transpose() * off)[0];
    let gain = (solved.transpose() * cross)[(0, 0)];
    Some([material.mean[wanted] + shift, (own - gain).max(1e-6)])
}
