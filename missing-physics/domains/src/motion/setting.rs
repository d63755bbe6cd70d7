//! What the parameters of the full model make of a machine.

use joint_laws::Number;
use joint_laws::friction::DryFriction;
use joint_laws::integrate::{Ceiling, Edge};
use joint_laws::sensor::Sensor;
use joint_laws::signal::Drive;

use super::effects::Role;
use super::equations::Equations;
use super::machine::{Force, JointLaws};
use crate::mechanics::{InputEffect, JointEffect, JointSizes, OutputEffect};

/// All that parameters decide.
pub(super) struct Setting<T> {
    /// States, inputs, parameters and time, as expressions name them: the parameters are filled in.
    pub(super) values: Vec<T>,
    pub(super) laws: Vec<JointLaws<T>>,
    pub(super) leaks: Vec<Option<T>>,
    pub(super) ceilings: Vec<Ceiling<T>>,
    pub(super) edges: Vec<Edge<T>>,
    /// What acts on each input, and whether its jumps are moved in time.
    pub(super) drives: Vec<(Drive<T>, bool)>,
    /// What was commanded of each before the run, where that is not its first command.
    pub(super) before: Vec<Option<f64>>,
    pub(super) sensors: Vec<Sensor<T>>,
    /// Delays of outputs.
    pub(super) delays: Vec<Option<T>>,
    pub(super) pace: Option<T>,
    /// Terms of an unknown law, with their coefficients.
    pub(super) terms: Vec<(usize, T)>,
    /// States beside the equations': deflections of springs that yield.
    pub(super) further_states: usize,
    /// The shortest time in which the laws change, s.
    pub(super) shortest_s: f64,
}

/// The shared parameters, what they are, which of them are on, and what else is known of the joints.
pub(super) struct Shared<'a, T> {
    pub(super) equations: &'a Equations,
    pub(super) roles: &'a [Role],
    pub(super) values: &'a [T],
    pub(super) on: &'a dyn Fn(usize) -> bool,
    /// The number of the run, where runs are cut into windows.
    pub(super) run: usize,
    /// How each joint moves.
    pub(super) joints: &'a [JointSizes],
}

impl<T: Number> Shared<'_, T> {
    /// The value of a parameter of a joint.
    fn of_joint(&self, joint: usize, what: JointEffect) -> T {
        let at = self.roles.iter().position(|r| *r == Role::Joint(joint, what));
        at.map_or(T::from(0.0), |slot| self.values[slot])
    }

    /// What they make of the machine; `values` are those of the names that the recording's own parameters do not give.
    pub(super) fn setting(&self, values: Vec<T>) -> Setting<T> {
        let equations = self.equations;
        let zero = T::from(0.0);
        let mut setting = Setting {
            values,
            laws: vec![JointLaws::none(); equations.joints.len()],
            leaks: vec![None; equations.levels.len()],
            ceilings: Vec::new(),
            edges: Vec::new(),
            drives: vec![(Drive::perfect(), false); equations.inputs.len()],
            before: vec![None; equations.inputs.len()],
            sensors: vec![Sensor::perfect(); equations.outputs.len()],
            delays: vec![None; equations.outputs.len()],
            pace: None,
            terms: Vec::new(),
            further_states: 0,
            shortest_s: f64::INFINITY,
        };
        for (slot, role) in self.roles.iter().enumerate() {
            let value = self.values[slot];
            match *role {
                Role::Stated(k) => setting.values[equations.parameter_name(k)] = value,
                Role::OfRun(k, run) => {
                    if run == self.run {
                        setting.values[equations.parameter_name(k)] = value;
                    }
                }
                _ if !(self.on)(slot) => {}
                Role::Joint(joint, JointEffect::Gap) => {
                    if let Some(drive) = equations.joints[joint].drive {
                        setting.drives[drive].0.play = Some((value, zero));
                    }
                }
                Role::Joint(joint, what) => self.joint(&mut setting, joint, what, value),
                Role::Input(input, what) => setting.input(input, what, value),
                Role::Output(output, what) => setting.output(output, what, value),
                Role::Overflow(level) => {
                    setting.ceilings.push(Ceiling { state: equations.levels[level], height: value });
                }
                Role::Leak(level) => setting.leaks[level] = Some(value),
                Role::Clock => setting.pace = Some((value + 1.0).recip()),
                Role::Term(term) => setting.terms.push((term, value)),
            }
        }
        setting
    }

    fn joint(&self, setting: &mut Setting<T>, joint: usize, what: JointEffect, value: T) {
        let states = &self.equations.joints[joint];
        let laws = &mut setting.laws[joint];
        let without = DryFriction::none(self.of_joint(joint, JointEffect::StribeckSpeed));
        let dry = &mut laws.dry;
        match what {
            JointEffect::Coulomb => dry.get_or_insert(without).level = value,
            JointEffect::Asymmetry => dry.get_or_insert(without).forward_less_backward = value,
            JointEffect::StribeckLevel => {
                let law = dry.get_or_insert(without);
                law.stribeck_level = value;
                let fades = law.stribeck_speed.re();
                setting.no_slower_than(fades / self.joints[joint].force);
            }
            JointEffect::LoadFraction => dry.get_or_insert(without).load_fraction = value,
            JointEffect::Damping(power) => laws.forces.push(Force::Damping(power, value)),
            JointEffect::Stiffness(power) => laws.forces.push(Force::Stiffness(power, value)),
            JointEffect::Constant => laws.forces.push(Force::Constant(value)),
            JointEffect::CogAmplitude => {
                let phase = self.of_joint(joint, JointEffect::CogPhase);
                let periods = self.of_joint(joint, JointEffect::CogPeriods);
                laws.forces.push(Force::Cogging([value, phase, periods]));
                setting.no_slower_than((periods.re() * self.joints[joint].speed).recip());
            }
            JointEffect::StopStiffness => {
                let at = self.of_joint(joint, JointEffect::StopPosition);
                // A stop stands on the side of the middle where its position is.
                let [low, high] = self.joints[joint].range;
                let above = at.re() > 0.5 * (low + high);
                laws.forces.push(Force::Stop(at, value, above, setting.edges.len()));
                setting.edges.push(Edge { state: states.position, at });
                setting.no_slower_than(value.re().max(0.0).sqrt().recip());
            }
            JointEffect::Inertia => laws.inertia = Some(value),
            JointEffect::YieldStiffness => {
                let yields = self.of_joint(joint, JointEffect::Yield);
                let state = self.equations.states.len() + setting.further_states;
                setting.further_states += 1;
                let edge = setting.edges.len();
                laws.forces.push(Force::Yielding(value, yields, state, [edge, edge + 1]));
                setting.edges.push(Edge { state: states.velocity, at: T::from(0.0) });
                setting.edges.push(Edge { state, at: T::from(0.0) });
                setting.no_slower_than(value.re().max(0.0).sqrt().recip());
                setting.no_slower_than(yields.re() / self.joints[joint].speed);
            }
            // They shape what others switch on; a gap is the drive's.
            JointEffect::StribeckSpeed
            | JointEffect::CogPhase
            | JointEffect::CogPeriods
            | JointEffect::StopPosition
            | JointEffect::Yield
            | JointEffect::Gap => {}
        }
    }
}

impl<T: Number> Setting<T> {
    fn no_slower_than(&mut self, time_s: f64) {
        if time_s > 0.0 {
            self.shortest_s = self.shortest_s.min(time_s);
        }
    }

    fn input(&mut self, input: usize, what: InputEffect, value: T) {
        let (drive, delayed) = &mut self.drives[input];
        match what {
            InputEffect::Gain => drive.gain = value,
            InputEffect::Offset => drive.offset = value,
            InputEffect::Delay => {
                drive.delay_s = value;
                *delayed = true;
            }
            InputEffect::Lag => {
                drive.lag_s = Some(value);
                *delayed = true;
                self.no_slower_than(value.re());
            }
            InputEffect::Upper => drive.upper = value,
            InputEffect::Lower => drive.lower = value,
            InputEffect::DeadZone => drive.dead_zone = value,
        }
    }

    fn output(&mut self, output: usize, what: OutputEffect, value: T) {
        let sensor = &mut self.sensors[output];
        match what {
            OutputEffect::Gain => sensor.gain = value,
            OutputEffect::Offset => sensor.offset = value,
            OutputEffect::Drift => sensor.drift_per_s = value,
            OutputEffect::Delay => self.delays[output] = Some(value),
            OutputEffect::Lag => sensor.lag_s = Some(value),
            OutputEffect::Upper => sensor.upper = value,
            OutputEffect::Lower => sensor.lower = value,
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use joint_laws::integrate::Method;
    use missing_physics::data::Run;
    use missing_physics::model::{Model as _, Scope};

    use crate::motion::equations::Equations;
    use crate::motion::model::{MotionModel, Pace};
    use crate::motion::scales::Scales;

    /// A joint that turns back and forth passes speeds at which its friction fades in a fifth of a row: the motion is that of steps which
    /// are a hundred times finer.
    #[test]
    fn steps_resolve_friction_that_fades_between_two_rows() {
        let all = Equations::example();
        let starts: Vec<f64> = all.parameters.iter().map(|p| p.value).collect();
        let times: Vec<f64> = (0..400).map(|k| 0.005 * f64::from(k)).collect();
        let wave: Vec<f64> = times.iter().map(|t| (5.0 * t).sin()).collect();
        let run = Run {
            label: "1".into(),
            inputs: vec![times.clone(), wave],
            outputs: vec![vec![0.0; times.len()]; all.outputs.len()],
            kind: 0,
        };
        let mut scales = Scales::of_example(&all);
        (scales.step_s, scales.joints[0].force) = (0.005, 20.0);
        let pace = |step_s| Pace::fixed(Method::Kutta, step_s);
        let mut model = MotionModel::baseline(all, pace(0.005)).full(scales, &starts, None);
        let spec = model.spec();
        let (mut shared, nuisance) = (spec.starts(Scope::Shared), spec.starts(Scope::PerRun));
        let stribeck = model.spec().mechanisms.iter().find(|m| m.id == "stribeck-friction").unwrap();
        let slots = model.spec().slots();
        let [level, speed] = stribeck.parameters[..] else { panic!("two parameters") };
        (shared[slots[level]], shared[slots[speed]]) = (10.0, 0.02);
        let predict = |model: &MotionModel| {
            let mut out = vec![0.0; times.len()];
            model.predict(&run, &shared, &nuisance, &mut out).unwrap();
            out
        };
        let found = predict(&model);
        model.set_pace(pace(5e-6));
        let fine = predict(&model);
        let worst = found.iter().zip(&fine).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let reach = fine.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        assert!(reach > 0.3 && worst < 1e-5, "{worst} of {reach}");
    }
}
