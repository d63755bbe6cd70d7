//! The full model of pours: an emulator of what their pictures show.

use std::collections::HashMap;

use granular_infer::campaign::Conditions;
use granular_infer::emulator::{Emulator, EmulatorError};
use granular_infer::statistics::{COUNT, STATISTICS, statistics};
use missing_physics::data::Run;
use missing_physics::model::{ErrorModel, Extensions, Model, PredictError, Spec};
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::campaign::{Campaign, Scale};
use super::discrepancy::discrepancy;
use super::learning::{MOST_BLUR_PX, counts, in_sight, samples};
use super::read::{Picture, Read};
use super::spec::{Places, build};

/// What the ground's level and slopes are known to beyond the pictures' noise: in m, and in rad.
const LEVEL_M: f64 = 3e-5;
const SLOPE: f64 = 5e-4;
/// How well mean heights are known to, in diameters.
const RING_D: f64 = 2e-3;
/// The first statistics, which are the ground's.
const GROUND: usize = 3;
/// Draws and refinements of the search for where the spread is taken.
const DRAWS: u64 = 3000;

/// Whether the search may take effects on.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Effects {
    Any,
    None,
}

/// Everything that a prediction depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
struct View {
    conditions: Conditions,
    blur_px2: f64,
}

/// A run as the engine is to see it: statistics less `centre`, made independent and of variance one.
#[derive(Debug, Clone)]
struct Shown {
    height_m: f64,
    centre: [f64; COUNT],
    factor: DMatrix<f64>,
}

/// The model of the domain `grain-pour`.
#[derive(Debug)]
pub(super) struct PourModel {
    emulator: Emulator,
    spec: Spec,
    places: Places,
    diameter_m: f64,
    scale: Scale,
    /// Number of pictures in the recording.
    pictures: usize,
    runs: HashMap<String, Shown>,
}

impl View {
    /// The same without what is not the baseline's.
    fn plain(mut self) -> Self {
        let c = &mut self.conditions;
        (c.work_of_adhesion_j_m2, c.size_variation, c.drag_per_m) = (0.0, 0.0, 0.0);
        (c.ground_ratio, c.tilt_rad, self.blur_px2) = (1.0, [0.0; 2], 0.0);
        c.aspect_ratio = 1.0;
        self
    }
}

impl PourModel {
    pub(super) fn new(campaign: &Campaign, read: &Read) -> Result<Self, EmulatorError> {
        let seen: Vec<[f64; COUNT]> = read.pictures.iter().map(|p| shown_by(p, read)).collect();
        let samples = in_sight(samples(campaign, read), &seen, read.rig.count);
        let emulator = Emulator::learn(&campaign.ranges, &samples)?;
        let heights: Vec<f64> = read.pictures.iter().map(|p| p.height_m / campaign.scale.length).collect();
        let lowest = read.pictures.iter().map(|p| p.height_m).fold(f64::INFINITY, f64::min);
        let highest = read.pictures.iter().map(|p| p.height_m).fold(0.0, f64::max);
        let mut model = Self {
            emulator,
            spec: Spec::default(),
            places: Places::default(),
            diameter_m: read.rig.diameter_m,
            scale: campaign.scale,
            pictures: read.pictures.len(),
            runs: HashMap::new(),
        };
        // Grains like these count for more: a polynomial is nearer to the truth the smaller its range is.
        let likely =
            [Effects::Any, Effects::None].map(|e| model.nearest(&heights, &seen, campaign, e).conditions);
        let ranges = &campaign.ranges;
        model.emulator =
            Emulator::learn_weighted(ranges, &samples, |s| counts(ranges, &s.conditions, &likely))?;
        let near = model.nearest(&heights, &seen, campaign, Effects::Any);
        let c = near.conditions;
        let start = [c.sliding_friction, c.rolling_friction, c.restitution, c.rolling_damping];
        (model.spec, model.places) = build(&campaign.scale.up(&campaign.ranges), start, lowest, highest);
        for (label, height) in read.pictures.iter().map(|p| (p.label.clone(), p.height_m)) {
            model.add(label, height, &near);
        }
        Ok(model)
    }

    /// Adds a run at a height in m; the spread is that of `near`.
    fn add(&mut self, label: String, height_m: f64, near: &View) {
        let mut view = *near;
        view.conditions.height_m = height_m / self.scale.length;
        let factor = self.factor(&view);
        let centre = self.emulator.mean(&view.conditions, view.blur_px2);
        self.runs.insert(label, Shown { height_m, centre, factor });
    }

    /// Another run, for an experiment, with the spread of an existing one.
    pub(super) fn propose(&mut self, label: &str, height_m: f64) {
        if let Some(shown) = self
            .runs
            .values()
            .min_by(|a, b| (a.height_m - height_m).abs().total_cmp(&(b.height_m - height_m).abs()))
        {
            let shown = Shown { height_m, ..shown.clone() };
            self.runs.insert(label.to_owned(), shown);
        }
    }

    /// Cholesky factor of the covariance of a picture's statistics.
    fn factor(&self, view: &View) -> DMatrix<f64> {
        let pictures = self.pictures as f64;
        let mut sigma = self.emulator.sigma(&view.conditions, view.blur_px2);
        sigma[0] = sigma[0].hypot(LEVEL_M / self.diameter_m);
        sigma[1] = sigma[1].hypot(SLOPE);
        sigma[2] = sigma[2].hypot(SLOPE);
        // The outer rings hang on the ground's level to within some micrometres.
        let mean = self.emulator.mean(&view.conditions, view.blur_px2);
        for (k, (name, _)) in STATISTICS.iter().enumerate() {
            if name.starts_with("height_") {
                sigma[k] = sigma[k].hypot(0.5 * RING_D / mean[k].max(0.1));
            }
        }
        let correlation = self.emulator.correlation();
        let discrepant = discrepancy(&mean, &sigma);
        let covariance = DMatrix::from_fn(COUNT, COUNT, |i, j| {
            // Where the ground reads is the camera's, and says nothing of the grains.
            let tied = if i != j && i.min(j) < GROUND { 0.0 } else { correlation[(i, j)] };
            // A discrepancy is the same in all pictures, so that their mean has no less of it.
            sigma[i] * sigma[j] * (tied + pictures * discrepant[(i, j)])
        });
        covariance
            .cholesky()
            .map_or_else(|| DMatrix::from_diagonal(&DVector::from_row_slice(&sigma)), |c| c.unpack())
    }

    /// Conditions near which pictures like these are poured: the likeliest of many draws, refined by smaller and smaller steps.
    fn nearest(&self, heights: &[f64], seen: &[[f64; COUNT]], campaign: &Campaign, effects: Effects) -> View {
        let ranges = &campaign.ranges;
        let allowed = |view: View| if effects == Effects::None { view.plain() } else { view };
        let score = |view: &View| -> f64 {
            heights
                .iter()
                .zip(seen)
                .map(|(&height_m, seen)| {
                    let mut view = *view;
                    view.conditions.height_m = height_m;
                    let mean = self.emulator.mean(&view.conditions, view.blur_px2);
                    let factor = self.factor(&view);
                    let mut left = DVector::from_fn(COUNT, |k, _| seen[k] - mean[k]);
                    // The ground's level says nothing of the grains.
                    left[0] = 0.0;
                    factor.solve_lower_triangular_mut(&mut left);
                    // A misfit that nothing explains must not decide alone.
                    let bounded: f64 = left.iter().map(|v| 9.0 * (1.0 + v * v / 9.0).ln()).sum();
                    bounded + 2.0 * factor.diagonal().iter().map(|v| v.ln()).sum::<f64>()
                })
                .sum()
        };
        let draw = |k: u64| {
            let mut rng = ChaCha8Rng::seed_from_u64(0x9e3);
            rng.set_stream(k);
            let blur: f64 = if k.is_multiple_of(3) { rng.random::<f64>() * MOST_BLUR_PX } else { 0.0 };
            allowed(View { conditions: ranges.draw(0x51, k), blur_px2: blur * blur })
        };
        let scored: Vec<(f64, View)> =
            (0..DRAWS).into_par_iter().map(|k| (score(&draw(k)), draw(k))).collect();
        let Some(mut best) = scored.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)) else { return draw(0) };
        for round in 0..30 {
            let size = 0.5 * 0.85_f64.powi(round);
            let tries: Vec<(f64, View)> = (0..40u64)
                .into_par_iter()
                .map(|k| {
                    let mut rng = ChaCha8Rng::seed_from_u64(round as u64);
                    rng.set_stream(k);
                    let mut step = || size * (2.0 * rng.random::<f64>() - 1.0);
                    let mut view = best.1;
                    let c = &mut view.conditions;
                    let clamp = |v: f64, [a, b]: [f64; 2]| v.clamp(a, b);
                    c.sliding_friction = clamp(c.sliding_friction * step().exp(), ranges.sliding_friction);
                    c.rolling_friction = clamp(c.rolling_friction * step().exp(), ranges.rolling_friction);
                    c.restitution = clamp(c.restitution + 0.4 * step(), ranges.restitution);
                    c.rolling_damping =
                        clamp(c.rolling_damping + 0.4 * step(), [0.0, ranges.rolling_damping]);
                    c.work_of_adhesion_j_m2 *= step().exp();
                    c.work_of_adhesion_j_m2 = c.work_of_adhesion_j_m2.min(ranges.work_of_adhesion_j_m2);
                    c.size_variation = (c.size_variation * step().exp()).min(ranges.size_variation);
                    c.aspect_ratio =
                        clamp(1.0 + (c.aspect_ratio - 1.0) * step().exp(), [1.0, ranges.aspect_ratio]);
                    c.tilt_rad = c.tilt_rad.map(|t| t + 0.03 * step());
                    view.blur_px2 *= step().exp();
                    let view = allowed(view);
                    (score(&view), view)
                })
                .collect();
            for one in tries {
                if one.0 < best.0 {
                    best = one;
                }
            }
        }
        best.1
    }

    /// The likeliest baseline of a recording, at no height in particular.
    pub(super) fn nearest_baseline(&self, read: &Read, campaign: &Campaign) -> Conditions {
        let heights: Vec<f64> = read.pictures.iter().map(|p| p.height_m / self.scale.length).collect();
        let seen: Vec<[f64; COUNT]> = read.pictures.iter().map(|p| shown_by(p, read)).collect();
        self.nearest(&heights, &seen, campaign, Effects::None).conditions
    }

    /// Mean statistics of each picture under the likeliest baseline.
    pub(super) fn baseline(&self, read: &Read, campaign: &Campaign) -> Vec<[f64; COUNT]> {
        let near = self.nearest_baseline(read, campaign);
        read.pictures
            .iter()
            .map(|p| {
                let conditions = Conditions { height_m: p.height_m / self.scale.length, ..near };
                self.emulator.mean(&conditions, 0.0)
            })
            .collect()
    }

    /// Each picture's statistics less their mean, in sigmas from pour to pour, what turns with the scene along and across the tilt; the
    /// height of the conditions is added to the pictures'.
    #[cfg(test)]
    pub(super) fn distances(&self, read: &Read, conditions: &Conditions, blur_px2: f64) -> Vec<[f64; COUNT]> {
        use granular_infer::statistics::Symmetry;
        let left = |picture: &Picture| {
            let height_m = picture.height_m / self.scale.length + conditions.height_m;
            let at = Conditions { height_m, ..*conditions };
            let (mean, sigma) = (self.emulator.mean(&at, blur_px2), self.emulator.sigma(&at, blur_px2));
            let seen = shown_by(picture, read);
            let left: [f64; COUNT] = std::array::from_fn(|k| (seen[k] - mean[k]) / sigma[k]);
            // Along and across the tilt.
            let azimuth = conditions.tilt_rad[1].atan2(conditions.tilt_rad[0]);
            std::array::from_fn(|k| match STATISTICS[k].1 {
                Symmetry::Scalar => left[k],
                Symmetry::Vector => azimuth.cos() * left[k] + azimuth.sin() * left[k + 1],
                Symmetry::Tensor => (2.0 * azimuth).cos() * left[k] + (2.0 * azimuth).sin() * left[k + 1],
                Symmetry::Second if STATISTICS[k - 1].1 == Symmetry::Vector => {
                    azimuth.cos() * left[k] - azimuth.sin() * left[k - 1]
                }
                Symmetry::Second => (2.0 * azimuth).cos() * left[k] - (2.0 * azimuth).sin() * left[k - 1],
            })
        };
        read.pictures.iter().map(left).collect()
    }

    /// Where the pictures' centroids lie.
    #[cfg(test)]
    pub(super) fn aside(&self, read: &Read) -> [f64; 2] {
        let at = |name| STATISTICS.iter().position(|s| s.0 == name).unwrap_or(0);
        let mean = |k: usize| read.pictures.iter().map(|p| shown_by(p, read)[k]).sum::<f64>();
        [mean(at("centroid_x")), mean(at("centroid_y"))]
    }

    /// What the engine is to see of a picture.
    pub(super) fn shown(&self, picture: &Picture, read: &Read) -> Vec<f64> {
        match self.runs.get(&picture.label) {
            Some(shown) => whiten(shown, shown_by(picture, read)),
            None => vec![f64::NAN; COUNT],
        }
    }

    /// Mean statistics of a picture at shared parameters.
    fn mean(&self, height_m: f64, shared: &[f64]) -> [f64; COUNT] {
        let p = &self.places;
        let at = |place: crate::builder::At| shared[place.slot];
        let conditions = Conditions {
            sliding_friction: at(p.friction),
            rolling_friction: at(p.rolling),
            restitution: at(p.restitution),
            rolling_damping: at(p.rolling_damping),
            height_m: height_m + at(p.funnel_offset),
            work_of_adhesion_j_m2: at(p.adhesion),
            ground_ratio: at(p.ground_ratio),
            size_variation: at(p.size_variance).max(0.0).sqrt(),
            tilt_rad: p.tilt.map(at),
            drag_per_m: at(p.drag),
            aspect_ratio: at(p.aspect),
        };
        let mut mean = self.emulator.mean(&self.scale.down(&conditions), at(p.blur_px2));
        mean[0] += at(p.depth_offset) / self.diameter_m;
        for (k, (name, _)) in STATISTICS.iter().enumerate() {
            match name.as_str() {
                "centroid_x" => mean[k] += at(p.aside[0]),
                "centroid_y" => mean[k] += at(p.aside[1]),
                "oval_xx_yy" => mean[k] += at(p.oval[0]),
                "oval_xy" => mean[k] += at(p.oval[1]),
                "roughness" => mean[k] += at(p.rougher),
                _ if name.starts_with("height_") => mean[k] *= 1.0 + at(p.larger),
                _ => {}
            }
        }
        mean
    }
}

/// A picture's statistics.
fn shown_by(picture: &Picture, read: &Read) -> [f64; COUNT] {
    statistics(&picture.map, read.rig.count, read.rig.diameter_m)
}

/// Statistics less what is expected, independent and of variance one.
fn whiten(shown: &Shown, statistics: [f64; COUNT]) -> Vec<f64> {
    let mut left = DVector::from_fn(COUNT, |k, _| statistics[k] - shown.centre[k]);
    shown.factor.solve_lower_triangular_mut(&mut left);
    left.iter().copied().collect()
}

impl Model for PourModel {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn predict(
        &self,
        run: &Run,
        shared: &[f64],
        _nuisance: &[f64],
        out: &mut [f64],
    ) -> Result<(), PredictError> {
        let Some(shown) = self.runs.get(&run.label) else {
            return Err(PredictError { run: run.label.clone(), reason: "no such pour".into() });
        };
        out.copy_from_slice(&whiten(shown, self.mean(shown.height_m, shared)));
        Ok(())
    }

    fn extensions(&self) -> Extensions<'_> {
        Extensions { errors: Some(self), ..Extensions::default() }
    }
}

impl ErrorModel for PourModel {
    /// Pours are independent.
    fn longest_correlation(&self) -> f64 {
        0.0
    }
}

/// A camera for the specification of no recording in particular.
pub(super) fn any_spec() -> Spec {
    let ranges = granular_infer::campaign::Ranges::default();
    build(&ranges, [0.4, 0.1, 0.5, 0.3], 0.04, 0.12).0
}
