//! The full model of a decaying wave: physics from `liquid-haptics`, the arm and the sensor, and all parameters.

use liquid_haptics::slosh::{SloshError, UprightCylinder};
use missing_physics::data::Run;
use missing_physics::model::{Extensions, JointLimits, Model, MultimodalModel, PredictError, Scope, Spec};

use super::reading::{Free, Reading};
use super::setup::{Channel, Setup, cylinder};
use super::spec::{ARM_RAD_S, Layout, build, second_band};
use super::start::{first_wave, peaks, viscosity_guess};

/// Shares of the recorded volume that a run may have in its container, by [`Run::kind`].
pub const FILLS: [f64; 4] = [1.0, 0.25, 0.5, 1.5];

/// The model of the domain `slosh`.
#[derive(Debug)]
pub struct SloshModel {
    setup: Setup,
    spec: Spec,
    layout: Layout,
    cylinders: Vec<UprightCylinder>,
    largest: f64,
    /// Indices of the mechanisms `arm-compliance`, `second-mode` and `contact-line-friction`.
    arm: usize,
    second: usize,
    friction: usize,
    /// Index of each shared and each nuisance parameter.
    shared: Vec<usize>,
    nuisance: Vec<usize>,
}

impl SloshModel {
    /// The model of a set-up; amplitudes and viscosity start from what the runs show.
    ///
    /// # Errors
    /// [`SloshError`] where the liquid has no depth.
    pub fn new(setup: Setup, runs: &[Run]) -> Result<Self, SloshError> {
        let fits = |share: &&f64| {
            setup.length_m.is_none_or(|length| {
                let capacity = std::f64::consts::PI * setup.radius_m * setup.radius_m * length;
                **share * setup.volume_m3 <= capacity * (1.0 + 1e-6)
            })
        };
        // Fills that the container cannot hold are never proposed; their place is kept.
        let cylinders = FILLS
            .iter()
            .map(|share| cylinder(&setup, if fits(&share) { *share } else { 1.0 }))
            .collect::<Result<Vec<_>, _>>()?;
        let viscosity = viscosity_guess(&cylinders[0], runs);
        let amplitudes = runs.iter().filter_map(|run| first_wave(&cylinders[0], viscosity, run));
        let largest = amplitudes.map(|[a, b]| a.hypot(b)).fold(0.0, f64::max);
        let readings = runs.iter().flat_map(|r| &r.outputs[0]).filter(|v| v.is_finite());
        let largest = if largest > 0.0 { largest } else { readings.fold(0.0, |m: f64, v| m.max(v.abs())) };
        let largest = if largest > 0.0 { largest } else { 1.0 };
        let (spec, layout) = build(&setup, &cylinders[0], largest, viscosity);
        let find = |id: &str| spec.mechanisms.iter().position(|m| m.id == id).unwrap_or(usize::MAX);
        let (arm, second) = (find("arm-compliance"), find("second-mode"));
        let friction = find("contact-line-friction");
        let of = |scope| (0..spec.parameters.len()).filter(|&i| spec.parameters[i].scope == scope).collect();
        let (shared, nuisance) = (of(Scope::Shared), of(Scope::PerRun));
        Ok(Self { setup, spec, layout, cylinders, largest, arm, second, friction, shared, nuisance })
    }

    /// Whether a run of this kind fits into the container.
    pub fn holds(&self, kind: usize) -> bool {
        let capacity = self.setup.length_m.map_or(f64::INFINITY, |length| {
            std::f64::consts::PI * self.setup.radius_m * self.setup.radius_m * length
        });
        FILLS.get(kind).is_some_and(|share| share * self.setup.volume_m3 <= capacity)
    }

    /// Nuisance parameters of a run in which the wave starts from its crest at the given reading.
    pub fn wave(&self, amplitude: f64) -> Vec<f64> {
        let mut nuisance = vec![0.0; self.spec.count(Scope::PerRun)];
        nuisance[self.layout.cos.slot] = amplitude;
        nuisance
    }

    /// What was measured.
    pub fn channel(&self) -> Channel {
        self.setup.channel
    }

    /// The largest amplitude with which a run begins.
    pub fn largest(&self) -> f64 {
        self.largest
    }

    fn cylinder(&self, run: &Run) -> &UprightCylinder {
        self.cylinders.get(run.kind as usize).unwrap_or(&self.cylinders[0])
    }

    /// Angular frequency (rad/s) and damping ratio of a run's first mode.
    pub(super) fn first_mode(&self, run: &Run, parameters: [&[f64]; 2]) -> [f64; 2] {
        self.reading(run).first_mode(parameters)
    }

    fn reading<'a>(&'a self, run: &'a Run) -> Reading<'a> {
        let [density_kg_m3, largest] = [self.setup.density_kg_m3, self.largest];
        Reading {
            layout: &self.layout,
            full: &self.cylinders[0],
            cylinder: self.cylinder(run),
            density_kg_m3,
            largest,
            run,
        }
    }
}

impl Model for SloshModel {
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
        self.reading(run)
            .all(shared, nuisance, out)
            .map_err(|reason| PredictError { run: run.label.clone(), reason })
    }

    fn jacobian(
        &self,
        run: &Run,
        shared: &[f64],
        nuisance: &[f64],
        shared_free: &[usize],
        nuisance_free: &[usize],
        out: &mut [f64],
        jacobian: &mut [f64],
    ) -> Result<(), PredictError> {
        let by = |is_shared: bool, slot: usize, value: f64| {
            let index = if is_shared { self.shared[slot] } else { self.nuisance[slot] };
            let parameter = &self.spec.parameters[index];
            let step = DIFFERENCE * parameter.scale.max(1e-3 * value.abs());
            let step = if value + step <= parameter.upper { step } else { -step };
            Free { is_shared, slot, step }
        };
        let of_shared = shared_free.iter().map(|&slot| by(true, slot, shared[slot]));
        let of_run = nuisance_free.iter().map(|&slot| by(false, slot, nuisance[slot]));
        let free: Vec<Free> = of_shared.chain(of_run).collect();
        self.reading(run)
            .linearised([shared, nuisance], &free, out, jacobian)
            .map_err(|reason| PredictError { run: run.label.clone(), reason })
    }

    fn nuisance_start(&self, run: &Run, nuisance: &mut [f64]) {
        let viscosity = self.spec.parameters[self.layout.viscosity.index].start;
        if let Some([a, b]) = first_wave(&self.cylinders[0], viscosity, run) {
            nuisance[self.layout.cos.slot] = a;
            nuisance[self.layout.sin.slot] = b;
        }
    }

    fn extensions(&self) -> Extensions<'_> {
        Extensions {
            modes: Some(self),
            limits: Some(self),
            local_causes: Some(self),
            ..Extensions::default()
        }
    }
}

impl MultimodalModel for SloshModel {
    fn starts(&self, mechanism: usize, runs: &[Run], residual: &[Vec<Vec<f64>>]) -> Vec<Vec<(usize, f64)>> {
        let p = &self.layout;
        if mechanism == self.friction {
            // Faint friction beside the viscosity that was found, and what the wave's envelope says.
            let omega = self.cylinders[0].angular_frequency_rad_s(0, 0.0);
            let faint = [0.0, 0.006, 0.02].map(|share| vec![(p.friction.index, share * self.largest)]);
            let shown = super::envelope::starts(runs, omega, self.largest, ENVELOPES).into_iter();
            let much = shown.map(|[ratio, friction]| {
                let viscosity = self.cylinders[0].kinematic_viscosity_m2_s(ratio);
                vec![(p.friction.index, friction), (p.viscosity.index, viscosity)]
            });
            return faint.into_iter().chain(much).collect();
        }
        let (omega, damping, band) = if mechanism == self.arm {
            (p.arm_omega.index, p.arm_damping.index, ARM_RAD_S)
        } else if mechanism == self.second {
            (p.second_omega.index, p.second_damping.index, second_band(&self.cylinders[0]))
        } else {
            return Vec::new();
        };
        peaks(runs, residual, band)
            .into_iter()
            .filter(|w| mechanism == self.second || !self.is_slosh(*w))
            .take(PEAKS)
            .flat_map(|w| [0.003, 0.03].map(|ratio| vec![(omega, w), (damping, ratio)]))
            .collect()
    }
}

impl JointLimits for SloshModel {
    fn implausible(&self, mechanism: usize, shared: &[f64]) -> Option<String> {
        let omega = shared[self.layout.arm_omega.slot];
        (mechanism == self.arm && self.is_slosh(omega))
            .then(|| format!("{omega:.4} rad/s is the frequency of a slosh mode"))
    }
}

/// An oscillation nearer to the first mode than this share of its frequency is that mode.
const FIRST_BAND: f64 = 0.08;

impl SloshModel {
    /// Whether a frequency is that of the first or second slosh mode.
    fn is_slosh(&self, omega: f64) -> bool {
        let first = self.cylinders[0].angular_frequency_rad_s(0, 0.0);
        let [low, high] = second_band(&self.cylinders[0]);
        (omega / first - 1.0).abs() < FIRST_BAND || (low..=high).contains(&omega)
    }
}

/// The step of a difference, in scales of its parameter: readings are exact to 1e-12 of the wave.
const DIFFERENCE: f64 = 1e-6;
/// How many points of the envelope's search are tried.
const ENVELOPES: usize = 8;
/// How many peaks of a residual's spectrum are tried.
const PEAKS: usize = 6;

#[cfg(test)]
mod tests;
