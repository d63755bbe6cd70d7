//! The full model of a bouncing ball: by how much each impact is off, for every effect at once.

use std::collections::HashMap;

use missing_physics::data::Run;
use missing_physics::model::{
    ErrorModel, Extensions, Model, MultimodalModel, ParameterRef, PredictError, Spec,
};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

use super::array::{Microphones, Wrong};
use super::chance::null_errors;
use super::drop::{Drop, PER_IMPACT};
use super::effects::Effects;
use super::rows::Rows;
use super::setup::Setup;
use super::spec::{Layout, build, hand};
use super::weights::{Linear, Spread, Weights};

/// A drop with its weights and the errors that the engine is shown as its data.
#[derive(Debug)]
pub(super) struct ShownDrop {
    pub(super) weights: Weights,
    shown: Vec<f64>,
    /// Where each impact was heard, and when by each microphone.
    heard: Vec<([f64; 2], Vec<f64>)>,
    pub(super) rows: Rows,
    /// What chance alone may do to it, in sigmas, `[world][copy][channel][row]`.
    null_samples: Vec<Vec<Vec<Vec<f64>>>>,
}

/// Simulated drops for each measured one and each plausible spread, where so many were measured.
///
/// A single drop makes no more null worlds than it has simulated ones: a thousand, as many as a test asks for. Null worlds that are alike
/// hide in each other's tail, and the data, of which there is one, look rarer than they are.
pub(super) fn copies(drops: usize) -> usize {
    const OF_ONE: usize = 64;
    const FEWEST: usize = 5;
    OF_ONE.div_ceil(drops.max(1)).max(FEWEST)
}

/// The model of the domain `bounce`.
#[derive(Debug)]
pub(super) struct BounceModel {
    setup: Setup,
    spec: Spec,
    layout: Layout,
    spread: Spread,
    /// Other spreads that the drops leave possible.
    plausible: Vec<Spread>,
    nominal: Effects,
    microphones: Microphones,
    drops: HashMap<String, ShownDrop>,
}

impl BounceModel {
    pub(super) fn new(
        setup: Setup,
        nominal: Effects,
        (spread, plausible): (Spread, Vec<Spread>),
        microphones: Microphones,
    ) -> Self {
        let (mut builder, mut layout) = build(&setup, nominal.restitution);
        if setup.dropped && setup.released {
            layout.hand = Some(hand(&mut builder, &nominal));
        }
        if setup.listened {
            layout.walk = Some(builder.shared("onset_walk_s", "s", 0.0, [-1e-4, 1e-4], 1e-6));
        }
        Self {
            setup,
            spec: builder.build_unchecked(),
            layout,
            spread,
            plausible,
            microphones,
            nominal,
            drops: HashMap::new(),
        }
    }

    /// A drop by its label.
    pub(super) fn shown(&self, label: &str) -> Option<&ShownDrop> {
        self.drops.get(label)
    }

    pub(super) fn setup(&self) -> &Setup {
        &self.setup
    }

    /// Standard errors of places along x and y, m.
    pub(super) fn place_errors_m(&self) -> [f64; 2] {
        self.spread.place_m
    }

    /// Whether some flights seem to hide impacts that went unheard.
    pub(super) fn hides_impacts(&self) -> bool {
        self.layout.unheard.is_some()
    }

    pub(super) fn nominal(&self) -> &Effects {
        &self.nominal
    }

    /// A drop that was not measured, about itself; `None` where it makes no sense, or a drop is called so already.
    pub(super) fn imagined(&mut self, label: &str, drop: &Drop, numbers: &[f64]) -> Option<Run> {
        if self.drops.contains_key(label) {
            return None;
        }
        let linear = Linear::new(drop, &self.nominal);
        self.run(label, linear, drop, numbers, 0)
    }

    /// The run of a drop: what is known of each of its impacts, and their errors. `None` where the drop makes no sense.
    /// Chance is asked `copies` times what it would have done in its place.
    pub(super) fn run(
        &mut self,
        label: &str,
        linear: Linear,
        drop: &Drop,
        numbers: &[f64],
        copies: usize,
    ) -> Option<Run> {
        let heard: Vec<([f64; 2], Vec<f64>)> =
            drop.places_m.iter().copied().zip(drop.arrivals_s.iter().cloned()).collect();
        let rows = Rows::of(drop, self.microphones.spare());
        let of_row = |column: &[f64]| column[rows.heard.clone()].to_vec();
        let places = &linear.drop.places_m;
        let mut inputs = vec![of_row(numbers), of_row(&linear.drop.speeds(&self.nominal))];
        // Likely places: their errors, unlike the measured ones', have nothing to do with those of the impacts.
        inputs.extend((0..2).map(|k| of_row(&places.iter().map(|p| p[k]).collect::<Vec<f64>>())));
        let null_samples = self.null_samples(&linear, drop, &rows, copies);
        let weights = Weights::new(linear, self.spread)?;
        let shown = weights.errors(&self.nominal, &[])?.as_slice().to_vec();
        if shown.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let of = |k: usize| -> Vec<f64> {
            (0..rows.heard.len())
                .map(|row| rows.known(row).map_or(f64::NAN, |impact| shown[drop.row(impact, k)]))
                .collect()
        };
        let mut outputs: Vec<Vec<f64>> = (0..PER_IMPACT).map(of).collect();
        outputs.extend((0..self.microphones.spare()).map(|k| {
            // A drop that is only imagined is heard as it should be.
            let misfit = |i: usize| {
                heard.get(i).map_or(0.0, |(p, t)| self.microphones.misfit(*p, t, &Wrong::default())[k])
            };
            rows.heard.clone().map(misfit).collect::<Vec<f64>>()
        }));
        self.drops.insert(label.to_owned(), ShownDrop { weights, shown, heard, rows, null_samples });
        Some(Run { label: label.to_owned(), inputs, outputs, kind: 0 })
    }

    fn null_samples(
        &self,
        likely: &Linear,
        drop: &Drop,
        rows: &Rows,
        copies: usize,
    ) -> Vec<Vec<Vec<Vec<f64>>>> {
        let mut rng = ChaCha8Rng::seed_from_u64(0xba11);
        rng.set_stream(self.drops.len() as u64);
        let sigmas = self.spread.of_channels();
        let mut world = |truth: &Spread| {
            let errors = null_errors(likely, &self.nominal, [truth, &self.spread], copies, &mut rng);
            let mut shaped = |errors: Vec<f64>| {
                let of = |k: usize| -> Vec<f64> {
                    let error = |impact: usize| errors[drop.row(impact, k)] / sigmas[k];
                    (0..rows.heard.len()).map(|row| rows.known(row).map_or(f64::NAN, error)).collect()
                };
                let mut channels: Vec<Vec<f64>> = (0..PER_IMPACT).map(of).collect();
                let mut white = || rows.heard.clone().map(|_| StandardNormal.sample(&mut rng)).collect();
                channels.extend((0..self.microphones.spare()).map(|_| white()));
                channels
            };
            errors.into_iter().map(&mut shaped).collect::<Vec<_>>()
        };
        let worlds: Vec<_> = self.plausible.iter().map(&mut world).collect();
        // A drop that can hardly be simulated has no law of its own.
        if worlds.iter().all(|copies| !copies.is_empty()) { worlds } else { Vec::new() }
    }

    fn wrong(&self, shared: &[f64]) -> Wrong {
        let p = &self.layout;
        let scale = p.position.map_or(0.0, |at| shared[at.slot]);
        let Some([x, y, which]) = p.microphone else { return Wrong { scale, ..Wrong::default() } };
        let which = shared[which.slot];
        let microphone = (which >= 0.0).then_some(which as usize);
        Wrong { microphone, offset_m: [shared[x.slot], shared[y.slot]], scale }
    }

    /// By how much each impact of a drop moves in time and place if the array is wrong; nothing where no array heard it.
    fn moved(&self, drop: &ShownDrop, array: &Wrong) -> Vec<[f64; 3]> {
        if *array == Wrong::default() || drop.heard.len() < drop.weights.linear.drop.times_s.len() {
            return Vec::new();
        }
        let moved =
            drop.heard.iter().map(|(place, arrivals)| self.microphones.moved(*place, arrivals, array));
        moved.collect::<Option<_>>().unwrap_or_default()
    }

    pub(super) fn effects(&self, shared: &[f64]) -> Effects {
        let p = &self.layout;
        let at = |at: Option<ParameterRef>| at.map_or(0.0, |at| shared[at.slot]);
        Effects {
            gravity_m_s2: self.setup.gravity_m_s2,
            restitution: shared[p.restitution.slot],
            slope_s_m: shared[p.slope.slot],
            drag_per_m: shared[p.drag.slot] * self.setup.drag_unit.unwrap_or(1.0),
            table: [0, 1].map(|k| at(p.table.map(|t| t[k])) + at(p.curved.map(|c| c[1 + k]))),
            curved_per_m: at(p.curved.map(|c| c[0])),
            walk_s: at(p.walk),
            heads: p.hand.map_or(self.nominal.heads, |[x, y, _]| [shared[x.slot], shared[y.slot]]),
            outwards_per_m: p.hand.map_or(self.nominal.outwards_per_m, |[.., out]| shared[out.slot]),
            friction: at(p.friction),
            clock_rate: at(p.clock),
            position_scale: at(p.position),
            heard_scale: 0.0,
            unheard: at(p.unheard),
            terms: [at(p.terms.map(|t| t[0])), at(p.terms.map(|t| t[1])), shared[p.squared.slot]],
        }
    }
}

impl Model for BounceModel {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn predict(
        &self,
        run: &Run,
        shared: &[f64],
        nuisance: &[f64],
        out: &mut [f64],
    ) -> Result<(), PredictError> {
        let wrong = |reason: &str| PredictError { run: run.label.clone(), reason: reason.into() };
        let drop = self.drops.get(&run.label).ok_or_else(|| wrong("no such drop"))?;
        let array = self.wrong(shared);
        let moved = self.moved(drop, &array);
        let mut effects = self.effects(shared);
        effects.restitution *= 1.0 + nuisance[self.layout.of_run.slot];
        if !moved.is_empty() {
            effects.heard_scale = std::mem::take(&mut effects.position_scale);
        }
        let errors = drop
            .weights
            .errors(&effects, &moved)
            .ok_or_else(|| wrong("the covariance of its errors has no root"))?;
        let n = run.len();
        let (impacts, heard) = out.split_at_mut(PER_IMPACT * n);
        let listened = if heard.is_empty() { 0 } else { n };
        for (row, (place, arrivals)) in
            drop.heard.iter().skip(drop.rows.heard.start).take(listened).enumerate()
        {
            let right = self.microphones.misfit(*place, arrivals, &Wrong::default());
            let by = moved.get(drop.rows.heard.start + row).map_or([0.0; 2], |[_, x, y]| [*x, *y]);
            let now = self.microphones.misfit([place[0] + by[0], place[1] + by[1]], arrivals, &array);
            for (k, (right, now)) in right.iter().zip(&now).enumerate() {
                heard[k * n + row] = right - now;
            }
        }
        for (channel, values) in impacts.chunks_exact_mut(n.max(1)).enumerate() {
            for (row, value) in values.iter_mut().enumerate() {
                *value = drop.rows.known(row).map_or(0.0, |impact| {
                    let at = drop.weights.linear.drop.row(impact, channel);
                    drop.shown[at] - errors[at]
                });
            }
        }
        Ok(())
    }

    fn extensions(&self) -> Extensions<'_> {
        Extensions {
            errors: Some(self),
            modes: Some(self),
            local_causes: Some(self),
            ..Extensions::default()
        }
    }
}

impl MultimodalModel for BounceModel {
    fn starts(&self, mechanism: usize, _runs: &[Run], _residual: &[Vec<Vec<f64>>]) -> Vec<Vec<(usize, f64)>> {
        match self.layout.microphone {
            Some([.., which])
                if self.spec.mechanisms[mechanism].integer_parameters.contains(&which.index) =>
            {
                (0..self.setup.microphones).map(|k| vec![(which.index, k as f64)]).collect()
            }
            _ => Vec::new(),
        }
    }
}

impl ErrorModel for BounceModel {
    fn prediction_is_clean(&self) -> bool {
        false
    }

    fn null_samples(&self, run: &Run) -> &[Vec<Vec<Vec<f64>>>] {
        self.drops.get(&run.label).map_or(&[], |drop| &drop.null_samples)
    }

    /// Errors come apart by their own covariance.
    fn longest_correlation(&self) -> f64 {
        0.0
    }
}

#[cfg(test)]
mod tests;
