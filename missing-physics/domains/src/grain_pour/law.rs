//! What pictures of pours show under given conditions: their mean, their covariance, and where pictures like some are likeliest.

use granular_infer::campaign::{Conditions, Ranges};
use granular_infer::emulator::Emulator;
use granular_infer::statistics::{COUNT, STATISTICS, statistics};
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::discrepancy::discrepancy;
use super::learning::MOST_BLUR_PX;
use super::read::{Picture, Read};

/// What the ground's level and slopes are known to beyond the pictures' noise: in m, and in rad.
const LEVEL_M: f64 = 3e-5;
const SLOPE: f64 = 5e-4;
/// How well mean heights are known to, in diameters.
const RING_D: f64 = 2e-3;
/// The first statistics, which are the ground's.
const GROUND: usize = 3;
/// Draws of the search for likely conditions, rounds of its refinement, and tries of a round.
const DRAWS: u64 = 3000;
const ROUNDS: i32 = 30;
const TRIES: u64 = 40;

/// Whether the search may take effects on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Effects {
    Any,
    None,
}

/// Everything that a prediction depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct View {
    pub(super) conditions: Conditions,
    pub(super) blur_px2: f64,
}

impl View {
    /// The view without what is not the baseline's.
    fn of_baseline(mut self) -> Self {
        let c = &mut self.conditions;
        (c.work_of_adhesion_j_m2, c.size_variation, c.drag_per_m) = (0.0, 0.0, 0.0);
        (c.ground_ratio, c.tilt_rad, self.blur_px2) = (1.0, [0.0; 2], 0.0);
        c.aspect_ratio = 1.0;
        self
    }
    /// A view a step away: each of its values moved by what `step` draws, within the ranges.
    fn stepped(mut self, ranges: &Ranges, mut step: impl FnMut() -> f64) -> Self {
        let c = &mut self.conditions;
        let clamp = |v: f64, [a, b]: [f64; 2]| v.clamp(a, b);
        c.sliding_friction = clamp(c.sliding_friction * step().exp(), ranges.sliding_friction);
        c.rolling_friction = clamp(c.rolling_friction * step().exp(), ranges.rolling_friction);
        c.restitution = clamp(c.restitution + 0.4 * step(), ranges.restitution);
        c.rolling_damping = clamp(c.rolling_damping + 0.4 * step(), [0.0, ranges.rolling_damping]);
        c.work_of_adhesion_j_m2 *= step().exp();
        c.work_of_adhesion_j_m2 = c.work_of_adhesion_j_m2.min(ranges.work_of_adhesion_j_m2);
        c.size_variation = (c.size_variation * step().exp()).min(ranges.size_variation);
        c.aspect_ratio = clamp(1.0 + (c.aspect_ratio - 1.0) * step().exp(), [1.0, ranges.aspect_ratio]);
        c.tilt_rad = c.tilt_rad.map(|t| t + 0.03 * step());
        self.blur_px2 *= step().exp();
        self
    }
}

/// What a recording's pictures show.
#[derive(Debug)]
pub(super) struct Seen {
    /// Height of the funnel in each, m, at the campaign's scale.
    pub(super) heights_m: Vec<f64>,
    pub(super) statistics: Vec<[f64; COUNT]>,
}

impl Seen {
    /// What a recording's pictures show, its lengths `length` times those of the campaign.
    pub(super) fn of(read: &Read, length: f64) -> Self {
        let heights_m = read.pictures.iter().map(|p| p.height_m / length).collect();
        Self { heights_m, statistics: read.pictures.iter().map(|p| statistics_of(p, read)).collect() }
    }
}

/// A picture's statistics.
pub(super) fn statistics_of(picture: &Picture, read: &Read) -> [f64; COUNT] {
    statistics(&picture.map, read.rig.count, read.rig.diameter_m)
}

/// The law of a picture's statistics.
#[derive(Debug)]
pub(super) struct PictureLaw {
    pub(super) emulator: Emulator,
    pub(super) diameter_m: f64,
    /// Number of pictures in the recording.
    pub(super) pictures: usize,
}

impl PictureLaw {
    /// Mean statistics.
    pub(super) fn mean(&self, view: &View) -> [f64; COUNT] {
        self.emulator.mean(&view.conditions, view.blur_px2)
    }

    /// Cholesky factor of the covariance of a picture's statistics.
    pub(super) fn factor(&self, view: &View) -> DMatrix<f64> {
        let pictures = self.pictures as f64;
        let mut sigma = self.emulator.sigma(&view.conditions, view.blur_px2);
        sigma[0] = sigma[0].hypot(LEVEL_M / self.diameter_m);
        sigma[1] = sigma[1].hypot(SLOPE);
        sigma[2] = sigma[2].hypot(SLOPE);
        // The outer rings hang on the ground's level to within some micrometres.
        let mean = self.mean(view);
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

    /// Minus twice the logarithm of the likelihood of pictures under a view's conditions, with large misfits bounded.
    fn cost(&self, view: &View, seen: &Seen) -> f64 {
        let of_picture = |(&height_m, statistics): (&f64, &[f64; COUNT])| {
            let mut view = *view;
            view.conditions.height_m = height_m;
            let mean = self.mean(&view);
            let factor = self.factor(&view);
            let mut left = DVector::from_fn(COUNT, |k, _| statistics[k] - mean[k]);
            // The ground's level says nothing of the grains.
            left[0] = 0.0;
            factor.solve_lower_triangular_mut(&mut left);
            // A misfit that nothing explains must not decide alone.
            let bounded: f64 = left.iter().map(|v| 9.0 * (1.0 + v * v / 9.0).ln()).sum();
            bounded + 2.0 * factor.diagonal().iter().map(|v| v.ln()).sum::<f64>()
        };
        seen.heights_m.iter().zip(&seen.statistics).map(of_picture).sum()
    }

    /// Conditions near which pictures like these are poured: the likeliest of many draws, refined by smaller and smaller steps.
    pub(super) fn nearest(&self, ranges: &Ranges, seen: &Seen, effects: Effects) -> View {
        let allowed = |view: View| if effects == Effects::None { view.of_baseline() } else { view };
        let draw = |k: u64| {
            let mut rng = ChaCha8Rng::seed_from_u64(0x9e3);
            rng.set_stream(k);
            let blur: f64 = if k.is_multiple_of(3) { rng.random::<f64>() * MOST_BLUR_PX } else { 0.0 };
            allowed(View { conditions: ranges.draw(0x51, k), blur_px2: blur * blur })
        };
        let drawn: Vec<(f64, View)> =
            (0..DRAWS).into_par_iter().map(|k| (self.cost(&draw(k), seen), draw(k))).collect();
        let Some(mut best) = drawn.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)) else { return draw(0) };
        for round in 0..ROUNDS {
            let size = 0.5 * 0.85_f64.powi(round);
            let step = |k: u64| {
                let mut rng = ChaCha8Rng::seed_from_u64(round as u64);
                rng.set_stream(k);
                let view = allowed(best.1.stepped(ranges, || size * (2.0 * rng.random::<f64>() - 1.0)));
                (self.cost(&view, seen), view)
            };
            let tried: Vec<(f64, View)> = (0..TRIES).into_par_iter().map(step).collect();
            for one in tried {
                if one.0 < best.0 {
                    best = one;
                }
            }
        }
        best.1
    }
}
