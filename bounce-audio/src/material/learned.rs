//! What was learned of materials, and the drops that say how far to believe it.

use nalgebra::{DMatrix, DVector};

use super::error::MaterialError;
use super::gaussian::{DIMENSIONS, Material, Point, Shared, drawn, moments};
use super::observation::Observation;
use super::spectrum::FEATURES;

/// Fewest drops of a material to learn from, and to calibrate by.
pub(super) const FEWEST: [usize; 2] = [20, 15];

/// A drop of which the material is known, by its number from 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Labelled {
    /// What was observed.
    pub observation: Observation,
    /// What the ball was made of.
    pub material: usize,
}

/// What each material is like, and the drops held out.
#[derive(Debug, Clone)]
pub(super) struct Learned {
    pub(super) shared: Shared,
    pub(super) materials: Vec<Material>,
    pub(super) held_out: Vec<Labelled>,
}

impl Learned {
    /// From complete drops, covariances drawn to that of all by a share.
    pub(super) fn new(
        materials: usize,
        learned: &[Labelled],
        held_out: Vec<Labelled>,
        shrinkage: f64,
    ) -> Result<Self, MaterialError> {
        let points: Vec<Point> = learned.iter().map(|d| Point::of(&d.observation, usize::MAX)).collect();
        let (means, scales) = scales(&points)?;
        let mut shared = Shared { means, scales, within: DMatrix::zeros(DIMENSIONS, DIMENSIONS) };
        shared.within = within(learned, &shared);
        let all: Vec<usize> = (0..DIMENSIONS).collect();
        let mut own = Vec::with_capacity(materials);
        for material in 0..materials {
            let of = || points.iter().zip(learned).filter(|(_, d)| d.material == material).map(|(p, _)| p);
            let rows: Vec<DVector<f64>> = of().map(|p| shared.standard(p, &all)).collect();
            let (mean, covariance) = moments(&rows);
            let per_impact = of().map(|p| 1.0 / p.impacts.max(1) as f64).sum::<f64>() / rows.len() as f64;
            own.push((mean, covariance - &shared.within * per_impact));
        }
        let pooled =
            own.iter().fold(DMatrix::zeros(DIMENSIONS, DIMENSIONS), |sum, (_, c)| sum + c) / materials as f64;
        let materials = own
            .into_iter()
            .map(|(mean, covariance)| Material { mean, between: drawn(&covariance, &pooled, shrinkage) })
            .collect();
        Ok(Self { shared, materials, held_out })
    }

    /// Drops held out of a material that have all dimensions asked for.
    pub(super) fn calibration(
        &self,
        along: &[usize],
        impacts: usize,
    ) -> Result<Vec<(usize, Point)>, MaterialError> {
        let seen = |p: &Point| along.iter().all(|&k| p.values[k].is_finite());
        let points = self.held_out.iter().map(|d| (d.material, Point::of(&d.observation, impacts)));
        let points: Vec<(usize, Point)> = points.filter(|(_, p)| seen(p)).collect();
        for material in 0..self.materials.len() {
            let got = points.iter().filter(|p| p.0 == material).count();
            if got < FEWEST[1] {
                let purpose = "calibrate by";
                return Err(MaterialError::TooFew { material, purpose, least: FEWEST[1], got });
            }
        }
        Ok(points)
    }
}

/// Mean and spread of each dimension over all drops.
fn scales(points: &[Point]) -> Result<([f64; DIMENSIONS], [f64; DIMENSIONS]), MaterialError> {
    let n = points.len() as f64;
    let (mut means, mut scales) = ([0.0; DIMENSIONS], [0.0; DIMENSIONS]);
    for k in 0..DIMENSIONS {
        means[k] = points.iter().map(|p| p.values[k]).sum::<f64>() / n;
        scales[k] = (points.iter().map(|p| (p.values[k] - means[k]).powi(2)).sum::<f64>() / n).sqrt();
        if !(scales[k] > 1e-9) {
            return Err(MaterialError::Flat { feature: k });
        }
    }
    Ok((means, scales))
}

/// Covariance of the impacts within a drop about its mean, over all drops with two or more, standardised; none of what a drop has once.
fn within(learned: &[Labelled], shared: &Shared) -> DMatrix<f64> {
    let mut sum = DMatrix::zeros(DIMENSIONS, DIMENSIONS);
    let mut degrees = 0usize;
    for drop in learned {
        let sounds = &drop.observation.sounds;
        let mean = Point::of(&drop.observation, usize::MAX);
        for sound in sounds.iter().filter(|_| sounds.len() > 1) {
            let off = DVector::from_fn(DIMENSIONS, |k, _| {
                if k < FEATURES { (sound[k] - mean.values[k]) / shared.scales[k] } else { 0.0 }
            });
            sum.ger(1.0, &off, &off, 1.0);
        }
        degrees += sounds.len().saturating_sub(1);
    }
    sum / degrees.max(1) as f64
}
