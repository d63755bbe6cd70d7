//! The full model of a recording of the domain `motion`.

use joint_laws::Number;
use joint_laws::friction::DryFriction;
use joint_laws::integrate::{Ceiling, Contact, Integrator, Machine as _};
use joint_laws::sensor::Sensor;
use joint_laws::signal::{Drive, Signal};
use missing_physics::data::Run;
use missing_physics::model::{Extensions, Model, MultimodalModel, PredictError, Spec};

use super::effects::{Effects, OfInput, OfJoint, OfOutput, Role};
use super::equations::{Equations, Start};
use super::machine::{Driven, JointLaws};
use super::scales::Scales;
use crate::dual::{DualModel, JacobianRequest};

/// The model: equations, and every effect that may act beside them.
#[derive(Debug)]
pub struct MotionModel {
    equations: Equations,
    spec: Spec,
    roles: Vec<Role>,
    /// Value at which each shared parameter is off.
    off: Vec<f64>,
    /// Nuisance slots of the recording's parameters of each run, and of the states that are free at its start.
    per_run: Vec<Option<usize>>,
    free_states: Vec<Option<usize>>,
    /// Middle of each joint's range: a stop stands on the side where its position is.
    middles: Vec<f64>,
    /// Largest step of the integration, s.
    step_s: f64,
    scales: Scales,
}

/// States and their derivatives along a run.
pub(super) struct Course {
    pub(super) states: Vec<Vec<f64>>,
    pub(super) rates: Vec<Vec<f64>>,
}

impl MotionModel {
    /// The equations alone, from the parameters' stated starts.
    pub(super) fn baseline(equations: Equations, step_s: f64) -> Self {
        let starts: Vec<f64> = equations.parameters.iter().map(|p| p.value).collect();
        let scales = Scales { states: vec![1.0; equations.states.len()], step_s, ..Scales::default() };
        Self::build(equations, scales, step_s, &starts, false)
    }

    /// The full model: fits of the recording's parameters begin at `starts` (one for each of them).
    pub(super) fn full(self, scales: Scales, starts: &[f64]) -> Self {
        Self::build(self.equations, scales, self.step_s, starts, true)
    }

    fn build(equations: Equations, scales: Scales, step_s: f64, starts: &[f64], all: bool) -> Self {
        let (spec, roles) = {
            let mut effects = Effects::new(&equations, &scales);
            effects.stated(starts);
            if all {
                effects.all();
            }
            (effects.builder.build_unchecked(), effects.roles)
        };
        let off = spec
            .parameters
            .iter()
            .filter(|p| p.scope == missing_physics::model::Scope::Shared)
            .map(|p| p.start)
            .collect();
        let mut next = 0;
        let mut slot = |taken: bool| {
            taken.then(|| {
                next += 1;
                next - 1
            })
        };
        let per_run = equations.parameters.iter().map(|p| slot(p.per_run && !p.known)).collect();
        let free_states = equations.states.iter().map(|s| slot(s.start == Start::Free)).collect();
        let middles = scales.joints.iter().map(|j| 0.5 * (j.range[0] + j.range[1])).collect();
        Self { equations, spec, roles, off, per_run, free_states, middles, step_s, scales }
    }

    /// The equations.
    pub(super) fn equations(&self) -> &Equations {
        &self.equations
    }

    /// Sets the largest step of the integration, s.
    pub(super) fn set_step(&mut self, step_s: f64) {
        self.step_s = step_s;
    }

    /// The largest step of the integration, s.
    pub(super) fn step_s(&self) -> f64 {
        self.step_s
    }

    /// The recording's parameters from the shared ones.
    pub(super) fn stated(&self, shared: &[f64]) -> Vec<f64> {
        let mut values: Vec<f64> = self.equations.parameters.iter().map(|p| p.value).collect();
        for (role, value) in self.roles.iter().zip(shared) {
            if let Role::Stated(k) = role {
                values[*k] = *value;
            }
        }
        values
    }

    /// States and derivatives at each row of a run.
    pub(super) fn course(&self, run: &Run, shared: &[f64], nuisance: &[f64]) -> Result<Course, String> {
        let mut course = Course {
            states: vec![Vec::with_capacity(run.len()); self.equations.states.len()],
            rates: vec![Vec::with_capacity(run.len()); self.equations.states.len()],
        };
        let mut rates = Vec::new();
        self.follow(run, shared, nuisance, &[], |machine, _, t, x, row| {
            if row.channel.is_none_or(|c| c == 0) {
                rates.resize(x.len(), 0.0);
                machine.smooth(t, x, &mut rates);
                for (k, (states, list)) in course.states.iter_mut().zip(&mut course.rates).enumerate() {
                    states.push(x[k]);
                    list.push(rates[k]);
                }
            }
        })?;
        Ok(course)
    }

    /// Sets up the machine of these parameters and leads it through a run; `at_row` is called wherever a row is read.
    fn follow<T: Number>(
        &self,
        run: &Run,
        shared: &[T],
        nuisance: &[T],
        moving: &[usize],
        mut at_row: impl FnMut(&mut Driven<'_, T>, &Reading<T>, T, &[T], &Stop<T>),
    ) -> Result<(), String> {
        let zero = T::from(0.0);
        let setting = self.setting(shared, nuisance, moving);
        let states = self.equations.states.len() + setting.yielding;
        let mut x = vec![zero; states];
        for (state, s) in self.equations.states.iter().enumerate() {
            x[state] = match s.start {
                Start::Known(value) => T::from(value),
                Start::Measured(output) => {
                    T::from(run.outputs[output].iter().copied().find(|v| v.is_finite()).unwrap_or(0.0))
                }
                Start::Free => self.free_states[state].map_or(zero, |slot| nuisance[slot]),
            };
        }
        let times = &run.inputs[0];
        let Some(&begin) = times.first() else { return Ok(()) };
        let delayed = setting.drives.iter().any(|d| d.1);
        let signals: Vec<Signal<T>> = setting
            .drives
            .iter()
            .enumerate()
            .map(|(k, (drive, _))| {
                let mut drive = *drive;
                if let (Some((_, follower)), Some(joint)) =
                    (&mut drive.play, self.equations.joints.iter().find(|j| j.drive == Some(k)))
                {
                    *follower = x[joint.position];
                }
                let between = self.equations.inputs[k].between;
                Signal::new(times, &run.inputs[1 + k], between, &drive, self.step_s)
            })
            .collect();
        let stops = stops(times, &signals, &setting.reading, delayed);
        let joints = self.equations.joints.len();
        let joint_of: Vec<usize> = (0..joints).filter(|&j| setting.laws[j].dry.is_some()).collect();
        let contacts =
            joint_of.iter().map(|&j| Contact { velocity: self.equations.joints[j].velocity }).collect();
        let mut machine = Driven {
            equations: &self.equations,
            laws: setting.laws,
            leaks: setting.leaks,
            begun: vec![0; signals.len()],
            signals,
            pace: setting.pace,
            contacts,
            joint_of,
            ceilings: setting.ceilings,
            values: setting.values,
            stack: Vec::with_capacity(16),
        };
        let mut integrator = Integrator::new(states, self.step_s);
        let mut t = T::from(begin);
        let hybrid = !machine.contacts.is_empty() || !machine.ceilings.is_empty();
        let mut settled = false;
        let mut rates = vec![zero; states];
        let mut early = vec![zero; states];
        for stop in &stops {
            if let Some(input) = stop.input {
                if stop.t.re() > begin || delayed {
                    self.go(&mut integrator, &mut machine, &mut t, &mut x, stop.t, &mut settled)?;
                }
                machine.begun[input] += 1;
                settled = !hybrid;
                continue;
            }
            if stop.t.re() < begin {
                // A reading that is older than the run: along the tangent.
                machine.smooth(t, &x, &mut rates);
                for (e, (x, r)) in early.iter_mut().zip(x.iter().zip(&rates)) {
                    *e = *x + *r * (stop.t - t);
                }
                at_row(&mut machine, &setting.reading, stop.t, &early, stop);
                continue;
            }
            self.go(&mut integrator, &mut machine, &mut t, &mut x, stop.t, &mut settled)?;
            at_row(&mut machine, &setting.reading, stop.t, &x, stop);
        }
        Ok(())
    }

    fn go<T: Number>(
        &self,
        integrator: &mut Integrator<T>,
        machine: &mut Driven<'_, T>,
        t: &mut T,
        x: &mut [T],
        to: T,
        settled: &mut bool,
    ) -> Result<(), String> {
        if !*settled {
            integrator.settle(machine, *t, x);
            *settled = true;
        }
        integrator.advance(machine, t, x, to).map_err(|e| {
            let name = self.equations.states.get(e.state).map_or("a deflection", |s| s.name.as_str());
            format!("{name} is {:.3e} at t = {:.6} s", e.value, e.t_s)
        })
    }

    /// What all parameters make of the machine.
    fn setting<T: Number>(&self, shared: &[T], nuisance: &[T], moving: &[usize]) -> Setting<T> {
        let equations = &self.equations;
        let zero = T::from(0.0);
        let mut values = vec![zero; equations.names()];
        for (k, p) in equations.parameters.iter().enumerate() {
            let place = equations.parameter_name(k);
            values[place] = self.per_run[k].map_or(T::from(p.value), |slot| nuisance[slot]);
        }
        let mut setting = Setting {
            values,
            laws: vec![JointLaws::none(); equations.joints.len()],
            leaks: vec![zero; equations.levels.len()],
            ceilings: Vec::new(),
            drives: vec![(Drive::perfect(), false); equations.inputs.len()],
            reading: Reading {
                sensors: vec![Sensor::perfect(); equations.outputs.len()],
                delays: vec![None; equations.outputs.len()],
            },
            pace: T::from(1.0),
            yielding: 0,
        };
        for (slot, (role, value)) in self.roles.iter().zip(shared).enumerate() {
            let on = value.re() != self.off[slot] || moving.contains(&slot);
            match *role {
                Role::Stated(k) => setting.values[equations.parameter_name(k)] = *value,
                _ if !on => {}
                Role::Joint(joint, what) => self.joint(&mut setting, joint, what, *value, shared),
                Role::Input(input, what) => {
                    let (drive, delayed) = &mut setting.drives[input];
                    match what {
                        OfInput::Gain => drive.gain = *value,
                        OfInput::Offset => drive.offset = *value,
                        OfInput::Delay => {
                            drive.delay_s = *value;
                            *delayed = true;
                        }
                        OfInput::Lag => {
                            drive.lag_s = Some(*value);
                            *delayed = true;
                        }
                        OfInput::Upper => drive.upper = *value,
                        OfInput::Lower => drive.lower = *value,
                        OfInput::DeadZone => drive.dead_zone = *value,
                    }
                }
                Role::Output(output, what) => {
                    let sensor = &mut setting.reading.sensors[output];
                    match what {
                        OfOutput::Gain => sensor.gain = *value,
                        OfOutput::Offset => sensor.offset = *value,
                        OfOutput::Drift => sensor.drift_per_s = *value,
                        OfOutput::Delay => setting.reading.delays[output] = Some(*value),
                        OfOutput::Lag => sensor.lag_s = Some(*value),
                        OfOutput::Upper => sensor.upper = *value,
                        OfOutput::Lower => sensor.lower = *value,
                    }
                }
                Role::Overflow(level) => {
                    setting.ceilings.push(Ceiling { state: equations.levels[level], height: *value });
                }
                Role::Leak(level) => setting.leaks[level] = *value,
                Role::Clock => setting.pace = (*value + 1.0).recip(),
            }
        }
        // A gap is between the command and its joint.
        for (slot, role) in self.roles.iter().enumerate() {
            if let Role::Joint(joint, OfJoint::Gap) = role
                && (shared[slot].re() != self.off[slot] || moving.contains(&slot))
                && let Some(drive) = equations.joints[*joint].drive
            {
                setting.drives[drive].0.play = Some((shared[slot], zero));
            }
        }
        setting
    }

    /// The value of another parameter of the same joint.
    fn of_joint<T: Number>(&self, joint: usize, what: OfJoint, shared: &[T]) -> T {
        let at = self.roles.iter().position(|r| *r == Role::Joint(joint, what));
        at.map_or(T::from(0.0), |slot| shared[slot])
    }

    fn joint<T: Number>(
        &self,
        setting: &mut Setting<T>,
        joint: usize,
        what: OfJoint,
        value: T,
        shared: &[T],
    ) {
        let laws = &mut setting.laws[joint];
        let speed = || self.of_joint(joint, OfJoint::StribeckSpeed, shared);
        match what {
            OfJoint::Coulomb => laws.dry.get_or_insert_with(|| DryFriction::none(speed())).level = value,
            OfJoint::Asymmetry => {
                laws.dry.get_or_insert_with(|| DryFriction::none(speed())).forward_less_backward = value;
            }
            OfJoint::StribeckLevel => {
                laws.dry.get_or_insert_with(|| DryFriction::none(speed())).stribeck_level = value;
            }
            OfJoint::LoadFraction => {
                laws.dry.get_or_insert_with(|| DryFriction::none(speed())).load_fraction = value;
            }
            OfJoint::Damping(power) => laws.damping[power] = value,
            OfJoint::Stiffness(power) => laws.stiffness[power] = value,
            OfJoint::Constant => laws.constant = value,
            OfJoint::CogAmplitude => {
                let phase = self.of_joint(joint, OfJoint::CogPhase, shared);
                let periods = self.of_joint(joint, OfJoint::CogPeriods, shared);
                laws.cogging = Some([value, phase, periods]);
            }
            OfJoint::StopStiffness => {
                let position = self.of_joint(joint, OfJoint::StopPosition, shared);
                laws.stop = Some((position, value, position.re() > self.middles[joint]));
            }
            OfJoint::Inertia => laws.inertia = value,
            OfJoint::YieldStiffness => {
                let yields = self.of_joint(joint, OfJoint::Yield, shared);
                let state = self.equations.states.len() + setting.yielding;
                setting.yielding += 1;
                setting.laws[joint].hysteresis = Some((value, yields, state));
            }
            // They shape what others switch on; a gap is the drive's.
            OfJoint::StribeckSpeed
            | OfJoint::CogPhase
            | OfJoint::CogPeriods
            | OfJoint::StopPosition
            | OfJoint::Yield
            | OfJoint::Gap => {}
        }
    }
}

/// What a sensor and its delay make of each output.
struct Reading<T> {
    sensors: Vec<Sensor<T>>,
    delays: Vec<Option<T>>,
}

/// All that parameters decide.
struct Setting<T> {
    values: Vec<T>,
    laws: Vec<JointLaws<T>>,
    leaks: Vec<T>,
    ceilings: Vec<Ceiling<T>>,
    /// What acts on each input, and whether its jumps are moved in time.
    drives: Vec<(Drive<T>, bool)>,
    reading: Reading<T>,
    pace: T,
    /// Springs that yield, each with a state.
    yielding: usize,
}

/// A time at which something is done on the way through a run.
struct Stop<T> {
    t: T,
    /// A piece of this input begins.
    input: Option<usize>,
    /// This row is read: of one channel, or of all that have no delay.
    row: usize,
    channel: Option<usize>,
}

/// Times at which inputs jump or rows are read, in order.
///
/// At one time, inputs come first: a row is read under its own commands. Where jumps may move, rows come first: what jumps a moment later
/// has not acted yet.
fn stops<T: Number>(
    times: &[f64],
    signals: &[Signal<T>],
    reading: &Reading<T>,
    delayed: bool,
) -> Vec<Stop<T>> {
    let mut stops = Vec::new();
    let inputs = |stops: &mut Vec<Stop<T>>| {
        for (k, signal) in signals.iter().enumerate() {
            stops.extend(signal.begins().map(|t| Stop { t, input: Some(k), row: 0, channel: None }));
        }
    };
    let rows = |stops: &mut Vec<Stop<T>>| {
        if reading.delays.iter().any(Option::is_none) {
            stops.extend((0..times.len()).map(|row| Stop {
                t: T::from(times[row]),
                input: None,
                row,
                channel: None,
            }));
        }
        for (c, delay) in reading.delays.iter().enumerate() {
            if let Some(delay) = delay {
                let late = |row: usize| T::from(times[row]) - *delay;
                stops.extend((0..times.len()).map(|row| Stop {
                    t: late(row),
                    input: None,
                    row,
                    channel: Some(c),
                }));
            }
        }
    };
    if delayed {
        rows(&mut stops);
        inputs(&mut stops);
    } else {
        inputs(&mut stops);
        rows(&mut stops);
    }
    stops.sort_by(|a, b| a.t.re().total_cmp(&b.t.re()));
    stops
}

impl DualModel for MotionModel {
    fn predict_dual<T: num_dual::DualNum<Primitive = f64, Real = f64> + Copy>(
        &self,
        run: &Run,
        shared: &[T],
        nuisance: &[T],
        moving: &[usize],
        out: &mut [T],
    ) -> Result<(), String> {
        let n = run.len();
        let mut sensors = Vec::new();
        let outputs = self.equations.outputs.len();
        self.follow(run, shared, nuisance, moving, |machine, reading, t, x, stop| {
            if sensors.is_empty() {
                sensors.clone_from(&reading.sensors);
            }
            match stop.channel {
                Some(c) => out[c * n + stop.row] = machine.output(c, t, x),
                None => {
                    for c in (0..outputs).filter(|c| reading.delays[*c].is_none()) {
                        out[c * n + stop.row] = machine.output(c, t, x);
                    }
                }
            }
        })?;
        let times: Vec<T> = run.inputs[0].iter().map(|t| T::from(*t)).collect();
        for (sensor, column) in sensors.iter().zip(out.chunks_mut(n.max(1))) {
            sensor.read(&times, column);
        }
        match out.iter().position(|v| !v.re().is_finite()) {
            None => Ok(()),
            Some(at) => {
                let name = &self.equations.outputs[at / n.max(1)].name;
                Err(format!("{name} is no number at t = {} s", run.inputs[0][at % n.max(1)]))
            }
        }
    }
}

impl Model for MotionModel {
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
        self.predict_dual(run, shared, nuisance, &[], out)
            .map_err(|reason| PredictError { run: run.label.clone(), reason })
    }

    fn nuisance_start(&self, run: &Run, nuisance: &mut [f64]) {
        super::start::states(&self.equations, run, &self.free_states, nuisance);
    }

    fn extensions(&self) -> Extensions<'_> {
        Extensions { modes: Some(self), ..Extensions::default() }
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
        JacobianRequest { run, shared, nuisance, shared_free, nuisance_free }.fill(self, out, jacobian)
    }
}

impl MultimodalModel for MotionModel {
    fn starts(&self, mechanism: usize, _: &[Run], _: &[Vec<Vec<f64>>]) -> Vec<Vec<(usize, f64)>> {
        super::start::mechanism(&self.spec.mechanisms[mechanism], &self.spec, &self.roles, &self.scales)
    }
}
