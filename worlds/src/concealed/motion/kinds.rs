//! The mechanisms of the domain `motion`: what they are called, how large they are, and what they do in a machine.

use rand_chacha::ChaCha8Rng;

use super::super::draw::{between, sign, whole};
use super::super::key::{Key, Place};
use super::sizes::Sizes;
use crate::physics::machine::{Effects, MachineWorld};

/// A mechanism with the number of its joint or output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Coulomb(usize),
    Asymmetric(usize),
    Stribeck(usize),
    /// By the power of the speed, less one.
    Damping(usize, usize),
    LoadDependent(usize),
    /// By the power of the position, less one.
    Stiffness(usize, usize),
    Constant(usize),
    Cogging(usize),
    EndStop(usize),
    Inertia(usize),
    Hysteresis(usize),
    Backlash,
    InputGain,
    InputOffset,
    InputDelay,
    InputLag,
    InputSaturation,
    DeadZone,
    SensorGain(usize),
    SensorOffset(usize),
    SensorDrift(usize),
    SensorDelay(usize),
    SensorLag(usize),
    SensorSaturation(usize),
    Overflow,
    Leak,
    Clock,
}

use Kind as K;

/// What effects look like, whatever their size.
pub(super) struct Shapes {
    sign: f64,
    /// Of the typical speed.
    stribeck_speed: f64,
    phase_rad: f64,
    periods: usize,
    stop_stiffness: f64,
    /// Of the reach.
    yields: f64,
    /// Which bounds there are: above, below.
    bounds: [bool; 2],
}

impl Shapes {
    pub(super) fn draw(rng: &mut ChaCha8Rng) -> Self {
        let bounds = [[true, false], [false, true], [true, true]][whole(rng, 0, 2)];
        Self {
            sign: sign(rng),
            stribeck_speed: between(rng, 0.1, 0.4),
            phase_rad: between(rng, -2.5, 2.5),
            periods: whole(rng, 4, 20),
            stop_stiffness: between(rng, 10.0, 60.0),
            yields: between(rng, 0.04, 0.2),
            bounds,
        }
    }
}

/// All mechanisms that act in a machine.
pub(super) fn all(world: &MachineWorld) -> Vec<Kind> {
    let mut kinds = Vec::new();
    for joint in world.plant.joints() {
        let j = joint.number;
        kinds.extend([K::Coulomb(j), K::Asymmetric(j), K::Stribeck(j)]);
        kinds.extend((0..3).map(|power| K::Damping(j, power)));
        kinds.extend((0..3).map(|power| K::Stiffness(j, power)));
        kinds.extend([K::Constant(j), K::EndStop(j), K::Inertia(j), K::Hysteresis(j)]);
        if joint.driven {
            kinds.push(K::LoadDependent(j));
        }
        if joint.turns {
            kinds.push(K::Cogging(j));
        }
    }
    if world.plant.follows() {
        kinds.push(K::Backlash);
    }
    if world.runs.iter().any(|run| !run.command.is_empty()) {
        kinds.extend([K::InputGain, K::InputOffset, K::InputDelay, K::InputLag]);
        kinds.extend([K::InputSaturation, K::DeadZone]);
    }
    for o in 0..world.plant.outputs().len() {
        kinds.extend([K::SensorGain(o), K::SensorOffset(o), K::SensorDrift(o)]);
        kinds.extend([K::SensorDelay(o), K::SensorLag(o), K::SensorSaturation(o)]);
    }
    if world.plant.level().is_some() {
        kinds.extend([K::Overflow, K::Leak]);
    }
    kinds.push(K::Clock);
    kinds
}

impl Kind {
    /// Where it acts: two that act on one thing that is no joint are not hidden together, since their order would matter.
    pub(super) fn place(self) -> usize {
        match self {
            K::Backlash
            | K::InputGain
            | K::InputOffset
            | K::InputDelay
            | K::InputLag
            | K::InputSaturation
            | K::DeadZone => 100,
            K::SensorGain(o)
            | K::SensorOffset(o)
            | K::SensorDrift(o)
            | K::SensorDelay(o)
            | K::SensorLag(o)
            | K::SensorSaturation(o) => 200 + o,
            K::Overflow | K::Leak => 300,
            K::Clock => 400,
            _ => 0,
        }
    }

    /// The smallest and the largest plausible size.
    pub(super) fn bounds(self, s: &Sizes) -> [f64; 2] {
        let of = |scale: f64, low: f64, high: f64| [low * scale, high * scale];
        match self {
            K::Coulomb(j) | K::Stribeck(j) | K::Constant(j) | K::Cogging(j) | K::Asymmetric(j) => {
                of(s.joints[j].acceleration, 1e-4, 0.5)
            }
            K::Damping(j, power) => {
                let joint = &s.joints[j];
                of(joint.acceleration / joint.speed.powi(power as i32 + 1), 1e-4, 1.0)
            }
            K::Stiffness(j, power) => {
                let joint = &s.joints[j];
                of(joint.acceleration / joint.reach.powi(power as i32 + 1), 1e-4, 0.7)
            }
            K::Hysteresis(j) => of(s.joints[j].acceleration / s.joints[j].reach, 1e-3, 3.0),
            K::EndStop(j) => of(s.joints[j].span(), 1e-3, 0.2),
            K::LoadDependent(_) | K::Inertia(_) | K::InputGain | K::SensorGain(_) => [1e-4, 0.4],
            K::Backlash => of(s.joints[0].reach, 1e-4, 0.3),
            K::InputOffset => of(s.command_span(), 1e-4, 0.3),
            K::InputDelay | K::SensorDelay(_) => of(s.row_s, 0.02, 12.0),
            K::InputLag | K::SensorLag(_) => of(s.row_s, 0.1, 12.0),
            K::InputSaturation => of(s.command_span(), 1e-3, 0.35),
            K::DeadZone => of(s.command[0].abs().max(s.command[1].abs()), 1e-3, 0.3),
            K::SensorOffset(o) => of(s.output_span(o), 1e-4, 0.3),
            K::SensorDrift(o) => of(s.output_span(o) / s.duration_s, 1e-4, 0.3),
            K::SensorSaturation(o) => of(s.output_span(o), 1e-3, 0.3),
            K::Overflow => of(s.output_span(0), 1e-3, 0.3),
            K::Leak => of(1.0 / s.duration_s, 1e-4, 1.0),
            K::Clock => [1e-5, 0.1],
        }
    }

    /// Puts it to work.
    pub(super) fn apply(self, e: &mut Effects, size: f64, shapes: &Shapes, s: &Sizes) {
        let sign = shapes.sign;
        let cut = |[low, high]: [f64; 2]| {
            let [above, below] = shapes.bounds;
            [above.then_some(high - size), below.then_some(low + size)]
        };
        match self {
            K::Coulomb(j) => e.joints[j].coulomb = size,
            K::Asymmetric(j) => e.joints[j].asymmetry = sign * size.min(1.8 * e.joints[j].coulomb),
            K::Stribeck(j) => e.joints[j].stribeck = [size, shapes.stribeck_speed * s.joints[j].speed],
            K::Damping(j, power) => e.joints[j].damping[power] = size,
            K::LoadDependent(j) => e.joints[j].load_fraction = size,
            K::Stiffness(j, power) => e.joints[j].stiffness[power] = sign * size,
            K::Constant(j) => e.joints[j].constant = sign * size,
            K::Cogging(j) => e.joints[j].cogging = [size, shapes.phase_rad, shapes.periods as f64],
            K::EndStop(j) => {
                let joint = &s.joints[j];
                let stiffness = shapes.stop_stiffness * joint.acceleration / joint.reach;
                e.joints[j].stop = Some([joint.range[1] - size, stiffness]);
            }
            K::Inertia(j) => e.joints[j].inertia = sign * size,
            K::Hysteresis(j) => e.joints[j].hysteresis = [size, shapes.yields * s.joints[j].reach],
            K::Backlash => e.input.gap = size,
            K::InputGain => e.input.gain = sign * size,
            K::InputOffset => e.input.offset = sign * size,
            K::InputDelay => e.input.delay_s = size,
            K::InputLag => e.input.lag_s = size,
            K::InputSaturation => [e.input.upper, e.input.lower] = cut(s.command),
            K::DeadZone => e.input.dead_zone = size,
            K::SensorGain(o) => e.outputs[o].gain = sign * size,
            K::SensorOffset(o) => e.outputs[o].offset = sign * size,
            K::SensorDrift(o) => e.outputs[o].drift_per_s = sign * size,
            K::SensorDelay(o) => e.outputs[o].delay_s = size,
            K::SensorLag(o) => e.outputs[o].lag_s = size,
            K::SensorSaturation(o) => [e.outputs[o].upper, e.outputs[o].lower] = cut(s.outputs[o]),
            K::Overflow => e.level.overflow = Some(s.outputs[0][1] - size),
            K::Leak => e.level.leak_per_s = size,
            K::Clock => e.clock_rate = sign * size,
        }
    }

    /// Writes it into the key, by the names of the recordings' format.
    pub(super) fn describe(self, e: &Effects, world: &MachineWorld, key: &mut Key) {
        let joints = world.plant.joints();
        let outputs = world.plant.outputs();
        let of_joint = |kind: &str, j: usize| match joints {
            [_] => kind.to_owned(),
            _ => format!("{kind}@{}", joints[j].name),
        };
        let of_output = |kind: &str, o: usize| match outputs {
            [_] => kind.to_owned(),
            _ => format!("{kind}@{}", outputs[o].0),
        };
        let bounds = |upper: Option<f64>, lower: Option<f64>| {
            let named = [("upper", upper), ("lower", lower)];
            named.into_iter().filter_map(|(name, bound)| Some((name, bound?))).collect::<Vec<_>>()
        };
        let (id, parameters) = match self {
            K::Coulomb(j) => (of_joint("coulomb-friction", j), vec![("level", e.joints[j].coulomb)]),
            K::Asymmetric(j) => {
                (of_joint("asymmetric-friction", j), vec![("forward_less_backward", e.joints[j].asymmetry)])
            }
            K::Stribeck(j) => {
                let [level, speed] = e.joints[j].stribeck;
                (of_joint("stribeck-friction", j), vec![("level", level), ("speed", speed)])
            }
            K::Damping(j, power) => {
                let kind = ["viscous-friction", "quadratic-damping", "cubic-damping"][power];
                let name = if power == 0 { "rate_per_s" } else { "coefficient" };
                (of_joint(kind, j), vec![(name, e.joints[j].damping[power])])
            }
            K::LoadDependent(j) => {
                (of_joint("load-dependent-friction", j), vec![("fraction", e.joints[j].load_fraction)])
            }
            K::Stiffness(j, power) => {
                let kind = ["stiffness", "quadratic-stiffness", "cubic-stiffness"][power];
                (of_joint(kind, j), vec![("coefficient", e.joints[j].stiffness[power])])
            }
            K::Constant(j) => (of_joint("constant-force", j), vec![("level", e.joints[j].constant)]),
            K::Cogging(j) => {
                let [amplitude, phase, periods] = e.joints[j].cogging;
                let parameters = vec![("amplitude", amplitude), ("phase_rad", phase), ("periods", periods)];
                (of_joint("cogging", j), parameters)
            }
            K::EndStop(j) => {
                let [position, stiffness] = e.joints[j].stop.unwrap_or_default();
                if let Some((name, _)) = outputs.iter().find(|o| o.1 == joints[j].position) {
                    key.place = Some(Place::new(name, position, f64::INFINITY));
                }
                (of_joint("end-stop", j), vec![("position", position), ("stiffness", stiffness)])
            }
            K::Inertia(j) => (of_joint("inertia", j), vec![("fraction", e.joints[j].inertia)]),
            K::Hysteresis(j) => {
                let [stiffness, yields] = e.joints[j].hysteresis;
                (of_joint("hysteresis", j), vec![("stiffness", stiffness), ("yield", yields)])
            }
            K::Backlash => ("backlash".into(), vec![("gap", e.input.gap)]),
            K::InputGain => ("input-gain".into(), vec![("gain", e.input.gain)]),
            K::InputOffset => ("input-offset".into(), vec![("offset", e.input.offset)]),
            K::InputDelay => ("input-delay".into(), vec![("delay_s", e.input.delay_s)]),
            K::InputLag => ("input-lag".into(), vec![("tau_s", e.input.lag_s)]),
            K::InputSaturation => ("input-saturation".into(), bounds(e.input.upper, e.input.lower)),
            K::DeadZone => ("input-dead-zone".into(), vec![("width", e.input.dead_zone)]),
            K::SensorGain(o) => (of_output("sensor-gain", o), vec![("gain", e.outputs[o].gain)]),
            K::SensorOffset(o) => (of_output("sensor-offset", o), vec![("offset", e.outputs[o].offset)]),
            K::SensorDrift(o) => {
                (of_output("sensor-drift", o), vec![("rate_per_s", e.outputs[o].drift_per_s)])
            }
            K::SensorDelay(o) => (of_output("sensor-delay", o), vec![("delay_s", e.outputs[o].delay_s)]),
            K::SensorLag(o) => (of_output("sensor-lag", o), vec![("tau_s", e.outputs[o].lag_s)]),
            K::SensorSaturation(o) => {
                (of_output("sensor-saturation", o), bounds(e.outputs[o].upper, e.outputs[o].lower))
            }
            K::Overflow => {
                let height = e.level.overflow.unwrap_or_default();
                key.place = Some(Place::new(outputs[0].0, height, f64::INFINITY));
                ("overflow".into(), vec![("height", height)])
            }
            K::Leak => ("leak".into(), vec![("rate_per_s", e.level.leak_per_s)]),
            K::Clock => ("clock-rate".into(), vec![("rate", e.clock_rate)]),
        };
        key.add(&id, &parameters);
    }
}
