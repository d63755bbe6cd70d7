//! The full model of a decaying wave: physics from `liquid-haptics`, the arm and the sensor, and all parameters.

use std::f64::consts::TAU;
use std::sync::Arc;

use liquid_haptics::slosh::{Decay, Effects, SloshError, UprightCylinder};
use missing_physics::data::Run;
use missing_physics::model::{DerivedPerRun, Model, PredictError, Scope, Spec};

use super::cylinder;
use crate::domains::builder::{ANY, At, Builder};

/// What was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// The torque about the horizontal axis across the motion.
    Torque,
    /// The sideways force.
    Force,
}

impl Channel {
    /// Name of the column.
    pub fn name(self) -> &'static str {
        if self == Self::Torque { "tau_z_nm" } else { "fx_n" }
    }

    /// Unit of the readings.
    pub fn unit(self) -> &'static str {
        if self == Self::Torque { "N m" } else { "N" }
    }

    /// The unit as a suffix of a parameter's name.
    fn suffix(self) -> &'static str {
        if self == Self::Torque { "nm" } else { "n" }
    }
}

/// What is known of the set-up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setup {
    /// Inner radius of the cylinder in m.
    pub radius_m: f64,
    /// Its length in m, where it is known.
    pub length_m: Option<f64>,
    /// Volume of the liquid in m^3.
    pub volume_m3: f64,
    /// Density of the liquid in kg/m^3.
    pub density_kg_m3: f64,
    /// Gravity in m/s^2.
    pub gravity_m_s2: f64,
    /// What was measured.
    pub channel: Channel,
}

/// Shares of the recorded volume that a run may have in its container, by [`Run::kind`].
pub const FILLS: [f64; 4] = [1.0, 0.25, 0.5, 1.5];

/// Where each parameter stands.
#[derive(Debug, Clone, Copy, Default)]
struct Places {
    viscosity: At,
    tension: At,
    frequency: At,
    friction: At,
    quadratic: At,
    second_omega: At,
    second_damping: At,
    arm_omega: At,
    arm_damping: At,
    lag: At,
    cos: At,
    sin: At,
    second_cos: At,
    second_sin: At,
    arm_cos: At,
    arm_sin: At,
    transient: At,
}

/// The model of the domain `slosh`.
#[derive(Debug)]
pub struct SloshModel {
    setup: Setup,
    spec: Spec,
    places: Places,
    cylinders: Vec<UprightCylinder>,
    largest: f64,
    /// Indices of the mechanisms `arm-compliance`, `second-mode` and `contact-line-friction`.
    arm: usize,
    second: usize,
    friction: usize,
    /// Index of each shared and each own parameter.
    shared: Vec<usize>,
    own: Vec<usize>,
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
        let (spec, places) = build(&setup, &cylinders[0], largest, viscosity);
        let find = |id: &str| spec.mechanisms.iter().position(|m| m.id == id).unwrap_or(usize::MAX);
        let (arm, second) = (find("arm-compliance"), find("second-mode"));
        let friction = find("contact-line-friction");
        let of = |scope| (0..spec.parameters.len()).filter(|&i| spec.parameters[i].scope == scope).collect();
        let (shared, own) = (of(Scope::Shared), of(Scope::PerRun));
        Ok(Self { setup, spec, places, cylinders, largest, arm, second, friction, shared, own })
    }

    /// Whether a run of this kind fits into the container.
    pub fn holds(&self, kind: usize) -> bool {
        let capacity = self.setup.length_m.map_or(f64::INFINITY, |length| {
            std::f64::consts::PI * self.setup.radius_m * self.setup.radius_m * length
        });
        FILLS.get(kind).is_some_and(|share| share * self.setup.volume_m3 <= capacity)
    }

    /// Own parameters of a run in which the wave starts from its crest at the given reading.
    pub fn wave(&self, amplitude: f64) -> Vec<f64> {
        let mut own = vec![0.0; self.spec.count(Scope::PerRun)];
        own[self.places.cos.slot] = amplitude;
        own
    }

    /// The largest amplitude with which a run begins.
    pub fn largest(&self) -> f64 {
        self.largest
    }

    fn cylinder(&self, run: &Run) -> &UprightCylinder {
        self.cylinders.get(run.kind as usize).unwrap_or(&self.cylinders[0])
    }

    /// The first mode.
    fn wave_at(&self, run: &Run, shared: &[f64], own: &[f64], out: &mut [f64]) -> Result<(), String> {
        let (p, cylinder) = (&self.places, self.cylinder(run));
        let mode = Decay {
            omega_rad_s: cylinder
                .angular_frequency_rad_s(0, shared[p.tension.slot] / self.setup.density_kg_m3),
            damping_ratio: cylinder.damping_ratio(shared[p.viscosity.slot]).min(0.999),
            effects: Effects {
                friction: shared[p.friction.slot],
                quadratic_per_reading: shared[p.quadratic.slot],
                frequency_change: shared[p.frequency.slot],
                largest_amplitude: self.largest,
            },
        };
        let times = run.inputs.first().ok_or("there is no column of times")?;
        mode.read(times, [own[p.cos.slot], own[p.sin.slot]], out).map_err(|e| e.to_string())
    }

    /// What is added to the first mode's reading: other oscillations, and the sensor's transient.
    fn add_others(&self, run: &Run, shared: &[f64], own: &[f64], out: &mut [f64]) -> Result<(), String> {
        let (p, cylinder) = (&self.places, self.cylinder(run));
        let times = run.inputs.first().ok_or("there is no column of times")?;
        let mode =
            |omega_rad_s, damping_ratio| Decay { omega_rad_s, damping_ratio, effects: Effects::default() };
        // With another fill the second mode moves by as much as theory says.
        let moved =
            cylinder.angular_frequency_rad_s(1, 0.0) / self.cylinders[0].angular_frequency_rad_s(1, 0.0);
        let second = mode(moved * shared[p.second_omega.slot], shared[p.second_damping.slot]);
        let arm = mode(shared[p.arm_omega.slot], shared[p.arm_damping.slot]);
        let mut more = Vec::new();
        for (mode, cos, sin) in [(second, p.second_cos, p.second_sin), (arm, p.arm_cos, p.arm_sin)] {
            let start = [own[cos.slot], own[sin.slot]];
            if start != [0.0; 2] {
                more.resize(times.len(), 0.0);
                mode.read(times, start, &mut more).map_err(|e| e.to_string())?;
                out.iter_mut().zip(&more).for_each(|(y, x)| *y += x);
            }
        }
        let transient = own[p.transient.slot];
        if transient != 0.0 {
            for (y, t) in out.iter_mut().zip(times) {
                *y += transient * (-t / shared[p.lag.slot]).exp();
            }
        }
        Ok(())
    }

    /// Whether a parameter acts on what is added to the first mode, and not on that mode.
    fn is_added(&self, shared: bool, slot: usize) -> bool {
        let p = &self.places;
        if shared {
            [p.second_omega, p.second_damping, p.arm_omega, p.arm_damping, p.lag]
                .iter()
                .any(|a| a.slot == slot)
        } else {
            slot != p.cos.slot && slot != p.sin.slot
        }
    }
}

impl Model for SloshModel {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn predict(&self, run: &Run, shared: &[f64], own: &[f64], out: &mut [f64]) -> Result<(), PredictError> {
        self.wave_at(run, shared, own, out)
            .and_then(|()| self.add_others(run, shared, own, out))
            .map_err(|reason| PredictError { run: run.label.clone(), reason })
    }

    fn jacobian(
        &self,
        run: &Run,
        shared: &[f64],
        own: &[f64],
        shared_free: &[usize],
        own_free: &[usize],
        out: &mut [f64],
        jacobian: &mut [f64],
    ) -> Result<(), PredictError> {
        self.predict(run, shared, own, out)?;
        let (mut shared, mut own) = (shared.to_vec(), own.to_vec());
        let mut below = vec![0.0; out.len()];
        let free = shared_free.iter().map(|&s| (true, s)).chain(own_free.iter().map(|&s| (false, s)));
        for ((is_shared, slot), column) in free.zip(jacobian.chunks_exact_mut(out.len().max(1))) {
            let info = &self.spec.parameters[if is_shared { self.shared[slot] } else { self.own[slot] }];
            let value = if is_shared { shared[slot] } else { own[slot] };
            let step = 1e-5 * info.scale.max(1e-3 * value.abs());
            let (high, low) = ((value + step).min(info.upper), (value - step).max(info.lower));
            for (x, target) in [(high, &mut *column), (low, &mut below)] {
                *(if is_shared { &mut shared[slot] } else { &mut own[slot] }) = x;
                let done = if self.is_added(is_shared, slot) {
                    target.fill(0.0);
                    self.add_others(run, &shared, &own, target)
                } else {
                    self.wave_at(run, &shared, &own, target)
                };
                done.map_err(|reason| PredictError { run: run.label.clone(), reason })?;
            }
            *(if is_shared { &mut shared[slot] } else { &mut own[slot] }) = value;
            column.iter_mut().zip(&below).for_each(|(d, b)| *d = (*d - b) / (high - low));
        }
        Ok(())
    }

    fn start(&self, run: &Run, own: &mut [f64]) {
        let viscosity = self.spec.parameters[self.places.viscosity.index].start;
        if let Some([a, b]) = first_wave(&self.cylinders[0], viscosity, run) {
            own[self.places.cos.slot] = a;
            own[self.places.sin.slot] = b;
        }
    }

    fn starts(&self, mechanism: usize, runs: &[Run], residual: &[Vec<Vec<f64>>]) -> Vec<Vec<(usize, f64)>> {
        let p = &self.places;
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

    fn implausible(&self, mechanism: usize, shared: &[f64]) -> Option<String> {
        let omega = shared[self.places.arm_omega.slot];
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

/// Where the second mode's frequency may lie, rad/s: surface tension raises it above that of gravity alone.
fn second_band(cylinder: &UprightCylinder) -> [f64; 2] {
    let omega = cylinder.angular_frequency_rad_s(1, 0.0);
    [0.97 * omega, 1.06 * omega]
}

/// Bounds of the arm's frequency, rad/s.
const ARM_RAD_S: [f64; 2] = [1.0, 1000.0];
/// How many places of the envelope's search are tried.
const ENVELOPES: usize = 8;
/// How many peaks of a residual's spectrum are tried.
const PEAKS: usize = 6;

/// Frequencies (rad/s) at which the residual's spectrum, summed over the runs, is highest.
fn peaks(runs: &[Run], residual: &[Vec<Vec<f64>>], [lowest, highest]: [f64; 2]) -> Vec<f64> {
    let (mut longest, mut gap): (f64, f64) = (0.0, f64::INFINITY);
    for run in runs {
        let Some(times) = run.inputs.first() else { continue };
        if let (Some(first), Some(last)) = (times.first(), times.last()) {
            longest = longest.max(last - first);
            gap = gap.min((last - first) / (times.len().max(2) - 1) as f64);
        }
    }
    if !(longest > 0.0 && gap > 0.0) {
        return Vec::new();
    }
    let step = 0.25 * TAU / longest;
    let (lowest, highest) = (lowest.max(4.0 * step), highest.min(0.5 * TAU / gap));
    let frequencies: Vec<f64> =
        (0..20_000).map(|k| lowest + f64::from(k) * step).take_while(|w| *w < highest).collect();
    let power: Vec<f64> = frequencies
        .iter()
        .map(|w| {
            runs.iter()
                .zip(residual)
                .map(|(run, left)| {
                    let (mut re, mut im) = (0.0, 0.0);
                    for (t, r) in run.inputs[0].iter().zip(&left[0]).filter(|(_, r)| r.is_finite()) {
                        let (s, c) = (w * t).sin_cos();
                        (re, im) = (re + r * c, im + r * s);
                    }
                    re * re + im * im
                })
                .sum()
        })
        .collect();
    let mut tops: Vec<usize> = (1..power.len().saturating_sub(1))
        .filter(|&i| power[i] >= power[i - 1] && power[i] > power[i + 1])
        .collect();
    tops.sort_by(|&a, &b| power[b].total_cmp(&power[a]));
    tops.into_iter().map(|i| frequencies[i]).collect()
}

/// Amplitudes at t = 0 of the cosine and the sine of a run's wave: least squares of a decaying sine over its first cycles.
fn first_wave(cylinder: &UprightCylinder, viscosity: f64, run: &Run) -> Option<[f64; 2]> {
    /// So many that noise averages out, so few that what bends the decay has not begun to.
    const CYCLES: f64 = 3.0;
    let (times, values) = (run.inputs.first()?, run.outputs.first()?);
    let (w, ratio) = (cylinder.angular_frequency_rad_s(0, 0.0), cylinder.damping_ratio(viscosity).min(0.5));
    let (mut cc, mut cs, mut ss, mut cy, mut sy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (t, y) in times.iter().zip(values).filter(|(t, y)| **t < CYCLES * TAU / w && y.is_finite()) {
        let fade = (-ratio * w * t).exp();
        let (s, c) = (w * (1.0 - ratio * ratio).sqrt() * t).sin_cos();
        let (s, c) = (fade * s, fade * c);
        (cc, cs, ss, cy, sy) = (cc + c * c, cs + c * s, ss + s * s, cy + c * y, sy + s * y);
    }
    let determinant = cc * ss - cs * cs;
    (determinant > 1e-9 * cc * ss)
        .then(|| [(cy * ss - sy * cs) / determinant, (sy * cc - cy * cs) / determinant])
}

/// A viscosity to begin with: from how much of the wave is left in the later half of the runs.
fn viscosity_guess(cylinder: &UprightCylinder, runs: &[Run]) -> f64 {
    let w = cylinder.angular_frequency_rad_s(0, 0.0);
    let mut ratios: Vec<f64> = runs
        .iter()
        .filter_map(|run| {
            let (times, values) = (run.inputs.first()?, run.outputs.first()?);
            let span = times.last()? - times.first()?;
            let middle = times.first()? + 0.3 * span;
            let power = |early: bool| {
                let part = times.iter().zip(values).filter(|(t, v)| (**t < middle) == early && v.is_finite());
                let (sum, n) = part.fold((0.0, 0.0), |(s, n), (_, v)| (s + v * v, n + 1.0));
                sum / f64::max(n, 1.0)
            };
            // Mean powers half a run apart fall by exp(-gamma omega span).
            let fall = (power(true) / power(false)).ln() / (w * span);
            (fall.is_finite() && fall > 0.0).then_some(fall)
        })
        .collect();
    ratios.sort_by(f64::total_cmp);
    let ratio = ratios.get(ratios.len() / 2).copied().unwrap_or(0.01).clamp(1e-4, 0.3);
    cylinder.kinematic_viscosity_m2_s(ratio)
}

fn build(setup: &Setup, cylinder: &UprightCylinder, largest: f64, viscosity: f64) -> (Spec, Places) {
    let mut b = Builder::default();
    let mut p = Places::default();
    let (unit, suffix) = (setup.channel.unit(), setup.channel.suffix());
    let amplitude = 0.1 * largest;
    b.spec.baseline = "the first antisymmetric mode of an upright cylinder with linear viscous damping; every run has its own amplitude and phase".into();
    p.viscosity = b.shared(
        "kinematic_viscosity_m2_s",
        "m^2/s",
        viscosity,
        [1e-12, cylinder.kinematic_viscosity_m2_s(0.9)],
        viscosity,
    );
    p.cos = b.own(&format!("cos_{suffix}"), unit, ANY, largest);
    p.sin = b.own(&format!("sin_{suffix}"), unit, ANY, largest);
    let (omega, at_rest) = (cylinder.angular_frequency_rad_s(0, 0.0), 0.02);
    // Liquids near room temperature have 0.015 to 0.073 N/m, liquid metals up to 0.6.
    let strongest = if setup.density_kg_m3 > 5000.0 { 0.7 } else { 0.09 };
    p.tension = b.shared("surface_tension_n_m", "N/m", 0.0, [0.0, strongest], 0.03);
    b.mechanism(
        "surface-tension",
        &[p.tension],
        [
            "surface tension",
            "The surface's tension stiffens the wave, more so in narrow containers.",
            "omega^2 = (g k + sigma k^3 / rho) tanh(k h), k = 1.841 / R",
            "Ibrahim 2005, Liquid Sloshing Dynamics, doi:10.1017/CBO9780511536656, ch. 1",
        ],
        &["nonlinear-frequency"],
    );
    p.frequency = b.shared("coefficient", "", 0.0, [-0.3, 0.3], 0.01);
    b.mechanism(
        "nonlinear-frequency",
        &[p.frequency],
        [
            "frequency that depends on the amplitude",
            "High waves are slower or faster than low ones.",
            "omega (1 + c A^2 / A_max^2), A_max the largest amplitude of a run",
            "Miles 1984, doi:10.1017/S0022112084002834",
        ],
        &["surface-tension"],
    );
    p.friction = b.shared(&format!("friction_{suffix}"), unit, 0.0, [0.0, largest], at_rest * largest);
    b.mechanism(
        "contact-line-friction",
        &[p.friction],
        [
            "friction of the contact line",
            "The edge of the surface sticks to the wall: the amplitude falls in a straight line and stops.",
            "x'' + 2 gamma omega x' + omega^2 (x + f sign x') = 0; a cycle loses 4 f",
            "Hocking 1987, doi:10.1017/S0022112087001514; Cocciaro, Faetti and Festa 1993, doi:10.1017/S0022112093000035",
        ],
        &["quadratic-damping"],
    );
    p.quadratic = b.shared(
        &format!("coefficient_per_{suffix}"),
        &format!("1/({unit})"),
        0.0,
        [0.0, 10.0 / largest],
        0.02 / largest,
    );
    b.mechanism(
        "quadratic-damping",
        &[p.quadratic],
        [
            "quadratic damping",
            "Eddies and breaking take more from high waves than from low ones.",
            "x'' + 2 gamma omega x' + c |x'| x' + omega^2 x = 0",
            "Faltinsen and Timokha 2009, Sloshing, ISBN 978-0-521-88111-1, ch. 6",
        ],
        &["contact-line-friction"],
    );
    modes(&mut b, &mut p, cylinder, (unit, suffix), amplitude);
    p.lag = b.shared("tau_s", "s", 1.0 / omega, [1e-3, 100.0], 1.0 / omega);
    p.transient = b.own(&format!("transient_{suffix}"), unit, ANY, amplitude);
    let mechanism = b.mechanism(
        "sensor-lag",
        &[p.lag],
        [
            "lag of the sensor",
            "The sensor follows the load with a delay; what is left of its reading at t = 0 dies away.",
            "tau y' + y = x: the same mode at another amplitude and phase, plus c exp(-t / tau)",
            "Doebelin 2003, Measurement Systems, ISBN 978-0-07-243886-3, ch. 3",
        ],
        &["arm-compliance"],
    );
    mechanism.companions = vec![p.transient.index];
    mechanism.shapes = vec![p.lag.index];
    (b.spec, p)
}

fn modes(
    b: &mut Builder,
    p: &mut Places,
    cylinder: &UprightCylinder,
    (unit, suffix): (&str, &str),
    amplitude: f64,
) {
    let [low, high] = second_band(cylinder);
    p.second_omega =
        b.shared("omega_rad_s", "rad/s", cylinder.angular_frequency_rad_s(1, 0.0), [low, high], 0.3);
    p.second_damping = b.shared("damping_ratio", "", 0.01, [1e-4, 0.5], 0.01);
    p.second_cos = b.own(&format!("second_cos_{suffix}"), unit, ANY, amplitude);
    p.second_sin = b.own(&format!("second_sin_{suffix}"), unit, ANY, amplitude);
    let second = b.mechanism(
        "second-mode",
        &[p.second_omega, p.second_damping],
        [
            "second slosh mode",
            "A second antisymmetric wave is on the surface, at the frequency that theory gives it.",
            "+ A2 exp(-gamma2 omega2 t) cos(omega2 t + phi2), omega2^2 = g k2 tanh(k2 h), k2 = 5.331 / R",
            "Ibrahim 2005, Liquid Sloshing Dynamics, doi:10.1017/CBO9780511536656, ch. 1",
        ],
        &["arm-compliance", "sensor-lag"],
    );
    second.companions = vec![p.second_cos.index, p.second_sin.index];
    second.derived_per_run = vec![amplitude_of(p.second_cos, p.second_sin, suffix, unit)];
    second.shapes = vec![p.second_omega.index, p.second_damping.index];
    p.arm_omega = b.shared("omega_rad_s", "rad/s", 40.0, ARM_RAD_S, 1.0);
    p.arm_damping = b.shared("damping_ratio", "", 0.01, [1e-4, 0.9], 0.01);
    p.arm_cos = b.own(&format!("arm_cos_{suffix}"), unit, ANY, amplitude);
    p.arm_sin = b.own(&format!("arm_sin_{suffix}"), unit, ANY, amplitude);
    let arm = b.mechanism(
        "arm-compliance",
        &[p.arm_omega, p.arm_damping],
        [
            "compliance of the arm",
            "Arm and gripper ring at a frequency of their own.",
            "+ A exp(-gamma omega t) cos(omega t + phi)",
            "Siciliano et al. 2009, Robotics, doi:10.1007/978-1-84628-642-1, ch. 7",
        ],
        &["second-mode"],
    );
    arm.companions = vec![p.arm_cos.index, p.arm_sin.index];
    arm.derived_per_run = vec![amplitude_of(p.arm_cos, p.arm_sin, suffix, unit)];
    arm.shapes = vec![p.arm_omega.index, p.arm_damping.index];
}

/// The amplitude at t = 0 of a wave that each run has in two parts.
fn amplitude_of(cos: At, sin: At, suffix: &str, unit: &str) -> DerivedPerRun {
    DerivedPerRun {
        name: format!("amplitude_{suffix}"),
        unit: unit.into(),
        value: Arc::new(move |_, own| own[cos.slot].hypot(own[sin.slot])),
    }
}
