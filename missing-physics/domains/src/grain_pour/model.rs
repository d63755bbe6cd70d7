//! The full model of pours: an emulator of what their pictures show.

use std::collections::HashMap;

use granular_infer::campaign::Conditions;
use granular_infer::emulator::{Emulator, EmulatorError};
use granular_infer::statistics::{COUNT, STATISTICS};
use missing_physics::data::Run;
use missing_physics::model::{ErrorModel, Extensions, Model, PredictError, Spec};
use missing_physics::observer::Observer;
use nalgebra::{DMatrix, DVector};

use super::campaign::{Campaign, Scale};
use super::law::{Effects, PictureLaw, Seen, View, statistics_of};
use super::learning::{counts, in_sight, samples};
use super::read::{Picture, Read};
use super::spec::{Layout, build};

/// A run as the engine is to see it: statistics less `centre`, made independent and of variance one.
#[derive(Debug, Clone)]
struct WhitenedRun {
    height_m: f64,
    centre: [f64; COUNT],
    factor: DMatrix<f64>,
}

/// The model of the domain `grain-pour`.
#[derive(Debug)]
pub(super) struct PourModel {
    pub(super) law: PictureLaw,
    spec: Spec,
    layout: Layout,
    pub(super) scale: Scale,
    runs: HashMap<String, WhitenedRun>,
    /// Where statistics spread as they do in the recording.
    near: View,
}

impl PourModel {
    pub(super) fn new(
        campaign: &Campaign,
        read: &Read,
        observer: &dyn Observer,
    ) -> Result<Self, EmulatorError> {
        let (ranges, scale) = (&campaign.ranges, campaign.scale);
        let seen = Seen::of(read, scale.length);
        let samples = in_sight(samples(campaign, read, observer), &seen.statistics, read.rig.count);
        let emulator = Emulator::learn(ranges, &samples)?;
        let mut law = PictureLaw { emulator, diameter_m: read.rig.diameter_m, pictures: read.pictures.len() };
        // Grains like these count for more: a polynomial is nearer to the truth the smaller its range is.
        let likely = [Effects::Any, Effects::None].map(|e| law.nearest(ranges, &seen, e).conditions);
        law.emulator =
            Emulator::learn_weighted(ranges, &samples, |s| counts(ranges, &s.conditions, &likely))?;
        let near = law.nearest(ranges, &seen, Effects::Any);
        let c = near.conditions;
        let start = [c.sliding_friction, c.rolling_friction, c.restitution, c.rolling_damping];
        let [lowest, highest] = read.heights_m();
        let (spec, layout) = build(&scale.up(ranges), start, lowest, highest);
        let mut model = Self { law, spec, layout, scale, runs: HashMap::new(), near };
        for (label, height) in read.pictures.iter().map(|p| (p.label.clone(), p.height_m)) {
            model.add(label, height);
        }
        Ok(model)
    }

    /// A view near which pictures like the recording's are poured, from a height in m.
    fn view(&self, height_m: f64) -> View {
        let mut view = self.near;
        view.conditions.height_m = height_m / self.scale.length;
        view
    }

    /// Adds a run at a height in m.
    fn add(&mut self, label: String, height_m: f64) {
        let view = self.view(height_m);
        let (centre, factor) = (self.law.mean(&view), self.law.factor(&view));
        self.runs.insert(label, WhitenedRun { height_m, centre, factor });
    }

    /// Another run, for an experiment, with the spread of an existing one.
    pub(super) fn propose(&mut self, label: &str, height_m: f64) {
        if let Some(shown) = self
            .runs
            .values()
            .min_by(|a, b| (a.height_m - height_m).abs().total_cmp(&(b.height_m - height_m).abs()))
        {
            let shown = WhitenedRun { height_m, ..shown.clone() };
            self.runs.insert(label.to_owned(), shown);
        }
    }

    /// The likeliest baseline of a recording, at no height in particular.
    pub(super) fn nearest_baseline(&self, read: &Read, campaign: &Campaign) -> Conditions {
        self.law.nearest(&campaign.ranges, &Seen::of(read, self.scale.length), Effects::None).conditions
    }

    /// Mean statistics of each picture under the likeliest baseline.
    pub(super) fn baseline(&self, read: &Read, campaign: &Campaign) -> Vec<[f64; COUNT]> {
        let near = self.nearest_baseline(read, campaign);
        read.pictures
            .iter()
            .map(|p| {
                let conditions = Conditions { height_m: p.height_m / self.scale.length, ..near };
                self.law.emulator.mean(&conditions, 0.0)
            })
            .collect()
    }

    /// What the engine is to see of a picture.
    pub(super) fn whitened(&self, picture: &Picture, read: &Read) -> Vec<f64> {
        match self.runs.get(&picture.label) {
            Some(shown) => whiten(shown, statistics_of(picture, read)),
            None => vec![f64::NAN; COUNT],
        }
    }

    /// One sigma of each statistic of a picture from a height in m, as the engine weighs it.
    pub(super) fn sigma(&self, height_m: f64) -> [f64; COUNT] {
        let factor = self.law.factor(&self.view(height_m));
        std::array::from_fn(|k| factor.row(k).norm())
    }

    /// Under which conditions a picture is poured from a height in m, in the campaign's lengths, and how much it is blurred (px^2).
    pub(super) fn poured(&self, height_m: f64, shared: &[f64]) -> View {
        let conditions = self.scale.down(&self.conditions(height_m, shared));
        View { conditions, blur_px2: shared[self.layout.blur_px2.slot] }
    }

    /// Under which conditions a picture is poured from a height in m.
    fn conditions(&self, height_m: f64, shared: &[f64]) -> Conditions {
        let p = &self.layout;
        let at = |place: missing_physics::model::ParameterRef| shared[place.slot];
        Conditions {
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
        }
    }

    /// Mean statistics of a picture at shared parameters.
    pub(super) fn mean(&self, height_m: f64, shared: &[f64]) -> [f64; COUNT] {
        let p = &self.layout;
        let at = |place: missing_physics::model::ParameterRef| shared[place.slot];
        let View { conditions, blur_px2 } = self.poured(height_m, shared);
        let mut mean = self.law.emulator.mean(&conditions, blur_px2);
        mean[0] += at(p.depth_offset) / self.law.diameter_m;
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

/// Statistics less what is expected, independent and of variance one.
fn whiten(shown: &WhitenedRun, statistics: [f64; COUNT]) -> Vec<f64> {
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
