//! The full model of a recording of the domain `motion`.

use joint_laws::integrate::{Contact, Integrator, Machine as _, Method, Point, Reading};
use joint_laws::signal::Signal;
use joint_laws::{Dual, Number};
use missing_physics::data::Run;
use missing_physics::model::{
    Extensions, FEWEST_RUNS_THAT_DIFFER, JointLimits, Model, MultimodalModel, PredictError, Scope, Spec,
    WindowedModel,
};

use super::detents::detents;
use super::effects::{Effects, Role};
use super::equations::{Equations, Joint, Start};
use super::late::{before_run, readings};
use super::law::{self, LawTerm};
use super::machine::{Driven, Force};
use super::scales::{Range, Scales};
use super::setting::{Setting, Shared};
use super::windows;
use crate::mechanics::JointEffect;

/// Steps of the integration in the shortest time in which a law changes.
const STEPS_IN_SHORTEST: f64 = 2.0;
/// The same for Heun's method, whose order is lower.
const STEPS_OF_HEUN: f64 = 10.0;
/// The largest error of a state in a step that is cut for a law's sake, in parts of its typical size.
const ERROR: f64 = 1e-6;
/// The same of the deflection of a spring that yields, in parts of where it yields.
const DEFLECTION_ERROR: f64 = 1e-4;
/// Steps are cut at the most to this part of the time between rows for a law's sake.
const FINEST_FOR_LAWS: f64 = 0.125;

/// An end stop is stiffer by this factor than what it takes to bring the joint to its largest position with its typical acceleration: what
/// yields more is a spring.
const STIFFER: f64 = 3.0;

/// Derivatives that a number carries at the most; of more parameters eight at a time.
const MOST_DERIVATIVES: usize = 12;

/// Some dry friction, in parts of a joint's typical acceleration.
const RUBS: f64 = 0.1;

/// How the motion is followed: by which method, in which steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pace {
    /// The method of steps that are all as long.
    pub(super) method: Method,
    /// Largest step, s.
    pub(super) step_s: f64,
    /// Steps are cut to this where they err by more than the states' sizes allow; as long as the largest, where none is cut.
    pub(super) finest_s: f64,
}

impl Pace {
    /// Steps that are all as long.
    pub(super) fn fixed(method: Method, step_s: f64) -> Self {
        Self { method, step_s, finest_s: step_s }
    }
}

impl Default for Pace {
    /// For a model that predicts nothing yet.
    fn default() -> Self {
        Self::fixed(Method::Kutta, 0.01)
    }
}

/// The model: equations, and every effect that may act beside them.
#[derive(Debug, Clone)]
pub struct MotionModel {
    equations: Equations,
    spec: Spec,
    roles: Vec<Role>,
    /// Value at which each shared parameter is off.
    off: Vec<f64>,
    /// Nuisance slots of the recording's parameters of each run, and of the states that are free at its start.
    per_run: Vec<Option<usize>>,
    /// The same of changes of those that all runs share, where they may differ.
    changes: Vec<Option<usize>>,
    free_states: Vec<Option<usize>>,
    pace: Pace,
    scales: Scales,
    /// Candidate terms of an unknown law.
    terms: Vec<LawTerm>,
    /// Where runs are cut into windows: the runs.
    pub(super) cut: Option<Vec<Whole>>,
}

/// A run that is cut into windows.
#[derive(Debug, Clone)]
pub(super) struct Whole {
    label: String,
    /// Times, and what each input is then.
    pub(super) inputs: Vec<Vec<f64>>,
}

impl Whole {
    fn begin_s(&self) -> Option<f64> {
        self.inputs[0].first().copied()
    }
}

/// States and their derivatives along a run.
pub(super) struct Course {
    pub(super) states: Vec<Vec<f64>>,
    pub(super) rates: Vec<Vec<f64>>,
}

/// A place in time on the way through a run where a piece of an input begins.
struct Break<T> {
    t: T,
    input: usize,
}

impl MotionModel {
    /// The equations alone, from the parameters' stated starts.
    pub(super) fn baseline(equations: Equations, pace: Pace) -> Self {
        let starts: Vec<f64> = equations.parameters.iter().map(|p| p.value).collect();
        let scales =
            Scales { states: vec![1.0; equations.states.len()], step_s: pace.step_s, ..Scales::default() };
        Self::build(equations, scales, pace, &starts, (false, None))
    }

    /// The full model: fits of the recording's parameters begin at `starts` (one for each of them). `cut` are the runs, where they are
    /// cut into windows.
    pub(super) fn full(self, scales: Scales, starts: &[f64], cut: Option<&[Run]>) -> Self {
        Self::build(self.equations, scales, self.pace, starts, (true, cut))
    }

    fn build(
        equations: Equations,
        scales: Scales,
        pace: Pace,
        starts: &[f64],
        (all, cut): (bool, Option<&[Run]>),
    ) -> Self {
        let labels: Option<Vec<String>> = cut.map(|runs| runs.iter().map(|r| r.label.clone()).collect());
        let terms = if all { law::terms(&equations, &scales) } else { Vec::new() };
        let mut changes = Vec::new();
        let (spec, roles) = {
            let mut effects = Effects::new(&equations, &scales);
            effects.stated(starts, labels.as_deref());
            if all {
                effects.all();
                effects.terms(&terms);
            }
            // The windows of a run share its parameters.
            if all && cut.is_none() && scales.runs >= FEWEST_RUNS_THAT_DIFFER {
                changes = effects.between_runs();
            }
            (effects.builder.build_unchecked(), effects.roles)
        };
        let off = spec.starts(Scope::Shared);
        let mut next = 0;
        let mut slot = |taken: bool| {
            taken.then(|| {
                next += 1;
                next - 1
            })
        };
        let per_run =
            equations.parameters.iter().map(|p| slot(p.per_run && !p.known && cut.is_none())).collect();
        let free_states =
            equations.states.iter().map(|s| slot(cut.is_some() || s.start == Start::Free)).collect();
        let whole = |run: &Run| Whole { label: run.label.clone(), inputs: run.inputs.clone() };
        let cut = cut.map(|runs| runs.iter().map(whole).collect());
        Self { equations, spec, roles, off, per_run, changes, free_states, pace, scales, terms, cut }
    }

    /// The same model under equations that only take their inputs otherwise.
    pub(super) fn under(&self, equations: Equations) -> Self {
        Self { equations, ..self.clone() }
    }

    /// Shared parameters with some dry friction in every joint.
    pub(super) fn rubbing(&self, shared: &[f64]) -> Vec<f64> {
        let mut rubbing = shared.to_vec();
        for (role, value) in self.roles.iter().zip(&mut rubbing) {
            if let Role::Joint(joint, JointEffect::Coulomb) = *role {
                *value = RUBS * self.scales.joints[joint].force;
            }
        }
        rubbing
    }

    /// A run's nuisance parameters, from where fits begin.
    pub(super) fn nuisance(&self, run: &Run) -> Vec<f64> {
        let mut nuisance = self.spec.starts(Scope::PerRun);
        self.nuisance_start(run, &mut nuisance);
        nuisance
    }

    /// The same of a run that begins where another did, with no joint moving.
    pub(super) fn at_rest(&self, run: &Run) -> Vec<f64> {
        let mut nuisance = self.nuisance(run);
        for joint in &self.equations.joints {
            if let Some(slot) = self.free_states[joint.velocity] {
                nuisance[slot] = 0.0;
            }
        }
        nuisance
    }

    /// The equations.
    pub(super) fn equations(&self) -> &Equations {
        &self.equations
    }

    /// Sets how the motion is followed.
    pub(super) fn set_pace(&mut self, pace: Pace) {
        self.pace = pace;
    }

    /// Sets the sizes of the states by which the errors of steps are judged.
    pub(super) fn set_state_sizes(&mut self, sizes: Vec<f64>) {
        self.scales.states = sizes;
    }

    /// The equations alone with every state free at a run's start, followed as this model is.
    pub(super) fn freed(&self) -> Self {
        let mut free = Self::baseline(self.equations.free(), self.pace);
        free.scales.states.clone_from(&self.scales.states);
        free
    }

    /// How the motion is followed.
    pub(super) fn pace(&self) -> Pace {
        self.pace
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

    /// The states at a run's first row.
    pub(super) fn begins(&self, run: &Run, nuisance: &[f64]) -> Vec<f64> {
        self.start(run, nuisance, self.equations.states.len())
    }

    /// Leads the machine through a run: `at_row` gets it at each row, the time and the states. How many evaluations of the equations
    /// that took.
    pub(super) fn along(
        &self,
        run: &Run,
        shared: &[f64],
        nuisance: &[f64],
        mut at_row: impl FnMut(&mut Driven<'_, f64>, f64, &[f64]),
    ) -> Result<usize, String> {
        let mut setting = self.setting(run, shared, nuisance, &[]);
        setting.before = self.commanded_before(run, &setting, [shared, nuisance], &[]);
        // A row is where the machine is then, whatever its sensors are late by.
        setting.delays.fill(None);
        self.follow(run, setting, nuisance, |machine, reading, at, _| at_row(machine, reading.t_s, at.x))
    }

    /// A typical size of each state.
    pub(super) fn state_sizes(&self) -> &[f64] {
        &self.scales.states
    }

    /// How far an output ranges.
    pub(super) fn output_size(&self, output: usize) -> f64 {
        self.scales.outputs.get(output).map_or(1.0, |Range { range: [low, high] }| high - low)
    }

    /// States and derivatives at each row of a run.
    pub(super) fn course(&self, run: &Run, shared: &[f64], nuisance: &[f64]) -> Result<Course, String> {
        let mut course = Course {
            states: vec![Vec::with_capacity(run.len()); self.equations.states.len()],
            rates: vec![Vec::with_capacity(run.len()); self.equations.states.len()],
        };
        let mut rates = Vec::new();
        self.along(run, shared, nuisance, |machine, t, x| {
            rates.resize(x.len(), 0.0);
            machine.smooth(t, x, &mut rates);
            for (k, (states, list)) in course.states.iter_mut().zip(&mut course.rates).enumerate() {
                states.push(x[k]);
                list.push(rates[k]);
            }
        })?;
        Ok(course)
    }

    pub(super) fn setting<T: Number>(
        &self,
        run: &Run,
        shared: &[T],
        nuisance: &[T],
        moving: &[usize],
    ) -> Setting<T> {
        let equations = &self.equations;
        let mut values = vec![T::from(0.0); equations.rates.registers()];
        for (k, p) in equations.parameters.iter().enumerate() {
            let place = equations.parameter_name(k);
            values[place] = self.per_run[k].map_or(T::from(p.value), |slot| nuisance[slot]);
        }
        let changes: Vec<(usize, T)> = (self.changes.iter().enumerate())
            .filter_map(|(k, slot)| Some((equations.parameter_name(k), nuisance[(*slot)?])))
            .collect();
        let on = |slot: usize| shared[slot].re() != self.off[slot] || moving.contains(&slot);
        let shared = Shared {
            equations,
            roles: &self.roles,
            values: shared,
            on: &on,
            run: windows::of_run(run),
            joints: &self.scales.joints,
        };
        let mut setting = shared.setting(values);
        changes.into_iter().for_each(|(place, change)| setting.values[place] += change);
        setting
    }

    /// The finest step under these laws, s: the model's, halved until it resolves them.
    fn step_s<T>(&self, setting: &Setting<T>) -> f64 {
        let wanted = (setting.shortest_s / STEPS_IN_SHORTEST).max(FINEST_FOR_LAWS * self.scales.step_s);
        let halvings = (self.pace.finest_s / wanted).log2().ceil();
        self.pace.finest_s * 0.5_f64.powi(halvings.max(0.0) as i32)
    }

    /// What follows the motion under these laws: steps of the model's pace, and where laws change faster than these or the pace cuts
    /// steps, as short as the error of each asks for.
    fn integrator<T: Number>(&self, setting: &Setting<T>, states: usize) -> Integrator<T> {
        let Pace { method, step_s, .. } = self.pace;
        let finest_s = self.step_s(setting);
        if finest_s >= step_s {
            let smooth = setting.shortest_s >= STEPS_OF_HEUN * step_s;
            let method = if method == Method::Heun && !smooth { Method::Kutta } else { method };
            return Integrator::new(method, states, step_s);
        }
        let mut errors: Vec<f64> = self.scales.states.iter().map(|size| ERROR * size).collect();
        errors.resize(states, f64::INFINITY);
        for force in setting.laws.iter().flat_map(|laws| &laws.forces) {
            if let Force::Yielding(_, yields, state, _) = force {
                errors[*state] = DEFLECTION_ERROR * yields.re().abs();
            }
        }
        Integrator::new(Method::DormandPrince, states, step_s).controlled(finest_s, errors)
    }

    /// Leads a machine through a run; `at_row` is called wherever a row is read: of all outputs without a delay (shift 0), or of one
    /// output (its number is one less than the shift). Of a reading that is older than the run it gets the states along the tangent of the
    /// motion and those at the run's beginning. How many evaluations of the equations that took.
    fn follow<T: Number>(
        &self,
        run: &Run,
        setting: Setting<T>,
        nuisance: &[T],
        mut at_row: impl FnMut(&mut Driven<'_, T>, &Reading, Point<'_, T>, Option<&[T]>),
    ) -> Result<usize, String> {
        let times = &run.inputs[0];
        let Some(&begin) = times.first() else { return Ok(0) };
        let states = self.equations.states.len() + setting.further_states;
        let mut integrator = self.integrator(&setting, states);
        let mut x = self.start(run, nuisance, states);
        let delayed = setting.drives.iter().any(|d| d.1);
        let (reads, shifts) = readings(times, &setting.delays);
        let mut machine = self.machine(run, setting, &x);
        let breaks = self.breaks(&mut machine, begin, delayed);
        let blown = |e: joint_laws::integrate::Diverged| {
            let name = self.equations.states.get(e.state).map_or("a deflection", |s| s.name.as_str());
            format!("{name} is {:.3e} at t = {:.6} s", e.value, e.t_s)
        };
        let mut t = begin;
        integrator.settle(&mut machine, t, &mut x);
        let mut next = 0;
        while let Some(read) = reads.get(next).filter(|r| r.t_s < begin) {
            let away = shifts[read.shift] + (read.t_s - begin);
            let early = integrator.along_tangent(&mut machine, t, &x, away);
            at_row(&mut machine, read, early, Some(&x));
            next += 1;
        }
        let mut at_row = |machine: &mut _, read: &Reading, at: Point<'_, T>| at_row(machine, read, at, None);
        // A row is read under its own commands; where jumps may move, what jumps a moment later has not acted yet.
        for change in breaks.iter().map(Some).chain([None]) {
            let until = change.map_or_else(|| reads.last().map_or(begin, |r| r.t_s), |b| b.t.re());
            let before = |r: &Reading| change.is_none() || r.t_s < until || delayed && r.t_s == until;
            let end = next + reads[next..].partition_point(before);
            if until > t || end > next {
                let to = until.max(t);
                integrator
                    .advance(&mut machine, &mut t, &mut x, to, &reads[next..end], &shifts, &mut at_row)
                    .map_err(blown)?;
            }
            next = end;
            if let Some(change) = change {
                let late = change.t.infinitesimal();
                integrator.nudge(&mut machine, t, &mut x, late);
                machine.begun[change.input] += 1;
                integrator.settle(&mut machine, t, &mut x);
                integrator.nudge(&mut machine, t, &mut x, -late);
            }
        }
        Ok(integrator.evaluations())
    }

    /// The same in any numbers, with room for as many states.
    fn start<T: Number>(&self, run: &Run, nuisance: &[T], states: usize) -> Vec<T> {
        let zero = T::from(0.0);
        let mut x = vec![zero; states];
        let free = self.cut.is_some() && windows::continues(run);
        for (state, s) in self.equations.states.iter().enumerate() {
            let start = if free { Start::Free } else { s.start };
            x[state] = match start {
                Start::Known(value) => T::from(value),
                Start::Measured(output) => {
                    T::from(run.outputs[output].iter().copied().find(|v| v.is_finite()).unwrap_or(0.0))
                }
                Start::Free => self.free_states[state].map_or(zero, |slot| nuisance[slot]),
            };
        }
        x
    }

    fn machine<T: Number>(&self, run: &Run, setting: Setting<T>, x: &[T]) -> Driven<'_, T> {
        let equations = &self.equations;
        let shortest_s = 0.25 * self.scales.step_s;
        let signals: Vec<Signal<T>> =
            (0..equations.inputs.len()).map(|k| self.signal(run, &setting, k, x, shortest_s)).collect();
        let joint_of: Vec<usize> =
            (0..setting.laws.len()).filter(|&j| setting.laws[j].dry.is_some()).collect();
        let contacts = joint_of.iter().map(|&j| Contact { velocity: equations.joints[j].velocity }).collect();
        let mut values = setting.values;
        let mut seen = vec![T::from(0.0); equations.readings.registers()];
        seen[..equations.names()].copy_from_slice(&values[..equations.names()]);
        equations.rates.prepare(&mut values);
        equations.readings.prepare(&mut seen);
        let rates = &equations.rates;
        let of_drive = |joint: &Joint| joint.drive.map(|drive| rates.behind(equations.input_name(drive)));
        let mut driven = Driven {
            equations,
            nominal: vec![None; equations.joints.len()],
            laws: setting.laws,
            terms: setting
                .terms
                .iter()
                .map(|(term, coefficient)| (&self.terms[*term], *coefficient))
                .collect(),
            room: Vec::new(),
            leaks: setting.leaks,
            looked: (f64::NAN, usize::MAX),
            driven: equations.joints.iter().map(|joint| of_drive(joint).unwrap_or_default()).collect(),
            begun: vec![0; signals.len()],
            signals,
            pace: setting.pace,
            contacts,
            joint_of,
            ceilings: setting.ceilings,
            beyond: vec![false; setting.edges.len()],
            edges: setting.edges,
            idle: values.clone(),
            values,
            seen,
            other: vec![T::from(0.0); equations.states.len()],
        };
        let room = driven.terms.iter().map(|(term, _)| term.registers()).max();
        driven.room.resize(room.unwrap_or(0), T::from(0.0));
        for joint in (0..self.scales.levers.len()).filter(|joint| self.scales.levers[*joint]) {
            let zero = vec![T::from(0.0); equations.states.len()];
            driven.nominal[joint] = driven.effect_at(joint, 0.0, &zero);
            driven.looked = (f64::NAN, usize::MAX);
        }
        driven
    }

    /// Where pieces of inputs begin behind a run's start, in order; what holds from the start on has begun.
    fn breaks<T: Number>(&self, machine: &mut Driven<'_, T>, begin: f64, delayed: bool) -> Vec<Break<T>> {
        let mut breaks = Vec::new();
        for (input, signal) in machine.signals.iter().enumerate() {
            for t in signal.begins() {
                if t.re() < begin || t.re() <= begin && !delayed {
                    machine.begun[input] += 1;
                } else {
                    breaks.push(Break { t, input });
                }
            }
        }
        if machine.signals.len() > 1 {
            breaks.sort_by(|a, b| a.t.re().total_cmp(&b.t.re()));
        }
        breaks
    }

    /// Predicts in any numbers; `moving` are the shared slots that carry a derivative.
    fn predict_in<T: Number>(
        &self,
        run: &Run,
        shared: &[T],
        nuisance: &[T],
        moving: &[usize],
        out: &mut [T],
    ) -> Result<(), String> {
        let mut setting = self.setting(run, shared, nuisance, moving);
        setting.before = self.commanded_before(run, &setting, [shared, nuisance], moving);
        self.predict_under(run, setting, nuisance, out)
    }

    /// Predicts a run under a setting.
    pub(super) fn predict_under<T: Number>(
        &self,
        run: &Run,
        setting: Setting<T>,
        nuisance: &[T],
        out: &mut [T],
    ) -> Result<(), String> {
        let n = run.len();
        let sensors = setting.sensors.clone();
        let delays: Vec<Option<f64>> = setting.delays.iter().map(|d| d.map(|delay| delay.re())).collect();
        // Readings of each output that are older than the run, as if the machine had stood still before it: row, value.
        let mut still: Vec<Vec<(usize, T)>> = vec![Vec::new(); sensors.len()];
        self.follow(run, setting, nuisance, |machine, reading, at, begins| {
            let wanted =
                |c: usize| if reading.shift == 0 { delays[c].is_none() } else { c + 1 == reading.shift };
            machine.outputs(reading.t_s, at, wanted, |c, value| out[c * n + reading.row] = value);
            if let Some(x) = begins {
                let at = Point { x, rates: &[] };
                machine.outputs(reading.t_s, at, wanted, |c, value| still[c].push((reading.row, value)));
            }
        })?;
        let times = &run.inputs[0];
        for (c, column) in out.chunks_mut(n.max(1)).enumerate() {
            if let Some(delay_s) = delays[c] {
                before_run(&still[c], (times, delay_s), &run.outputs[c], &sensors[c], column);
            }
        }
        let of_run = self.cut.as_ref().and_then(|runs| runs.get(windows::of_run(run)));
        let begin = of_run.and_then(Whole::begin_s).or(times.first().copied()).unwrap_or(0.0);
        for (c, (sensor, column)) in sensors.iter().zip(out.chunks_mut(n.max(1))).enumerate() {
            sensor.read(begin, times, &run.outputs[c], column);
        }
        match out.iter().position(|v| !v.re().is_finite()) {
            None => Ok(()),
            Some(at) => {
                let name = &self.equations.outputs[at / n.max(1)].name;
                Err(format!("{name} is no number at t = {} s", run.inputs[0][at % n.max(1)]))
            }
        }
    }

    /// The columns of at most `N` free parameters: (column, whether it is shared, slot).
    fn columns<const N: usize>(
        &self,
        (run, shared, nuisance): (&Run, &[f64], &[f64]),
        free: &[(usize, bool, usize)],
        out: &mut [f64],
        jacobian: &mut [f64],
    ) -> Result<(), String> {
        let mut shared: Vec<Dual<N>> = shared.iter().map(|v| (*v).into()).collect();
        let mut nuisance: Vec<Dual<N>> = nuisance.iter().map(|v| (*v).into()).collect();
        for (number, &(_, is_shared, slot)) in free.iter().enumerate() {
            let target = if is_shared { &mut shared[slot] } else { &mut nuisance[slot] };
            *target = Dual::parameter(target.re, number);
        }
        let moving: Vec<usize> = free.iter().filter(|f| f.1).map(|f| f.2).collect();
        let rows = out.len();
        let mut values = vec![Dual::<N>::from(0.0); rows];
        self.predict_in(run, &shared, &nuisance, &moving, &mut values)?;
        for (row, value) in values.iter().enumerate() {
            out[row] = value.re;
            for (derivative, (column, ..)) in value.eps.iter().zip(free) {
                jacobian[column * rows + row] = *derivative;
            }
        }
        Ok(())
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
        self.predict_in(run, shared, nuisance, &[], out)
            .map_err(|reason| PredictError { run: run.label.clone(), reason })
    }

    fn nuisance_start(&self, run: &Run, nuisance: &mut [f64]) {
        for (parameter, slot) in self.equations.parameters.iter().zip(&self.per_run) {
            if let (Some(slot), Some(start)) = (slot, parameter.start_of(&run.label)) {
                nuisance[*slot] = start;
            }
        }
        let knows = self.cut.is_none() || !windows::continues(run);
        super::start::states(&self.equations, run, knows, &self.free_states, nuisance);
    }

    fn extensions(&self) -> Extensions<'_> {
        Extensions {
            modes: Some(self),
            limits: Some(self),
            local_causes: Some(self),
            windows: self.cut.is_some().then_some(self as &dyn WindowedModel),
            ..Extensions::default()
        }
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
        let of_run = nuisance_free.iter().enumerate().map(|(k, &s)| (shared_free.len() + k, false, s));
        // What is of another run than this window's has no effect here.
        let here =
            |slot: usize| !matches!(self.roles[slot], Role::OfRun(_, of) if of != windows::of_run(run));
        let shared_free = shared_free.iter().enumerate().filter(|(_, slot)| here(**slot));
        let free: Vec<(usize, bool, usize)> = shared_free.map(|(k, &s)| (k, true, s)).chain(of_run).collect();
        jacobian.fill(0.0);
        if free.is_empty() {
            return self.predict(run, shared, nuisance, out);
        }
        let at = (run, shared, nuisance);
        // Numbers no longer than needed: most time goes into their derivatives.
        let together = if free.len() <= MOST_DERIVATIVES { MOST_DERIVATIVES } else { 8 };
        for chunk in free.chunks(together) {
            match chunk.len() {
                1 => self.columns::<1>(at, chunk, out, jacobian),
                2 | 3 => self.columns::<3>(at, chunk, out, jacobian),
                4 | 5 => self.columns::<5>(at, chunk, out, jacobian),
                6 => self.columns::<6>(at, chunk, out, jacobian),
                7 | 8 => self.columns::<8>(at, chunk, out, jacobian),
                9 | 10 => self.columns::<10>(at, chunk, out, jacobian),
                _ => self.columns::<MOST_DERIVATIVES>(at, chunk, out, jacobian),
            }
            .map_err(|reason| PredictError { run: run.label.clone(), reason })?;
        }
        Ok(())
    }
}

impl WindowedModel for MotionModel {
    fn whole(&self, window: &Run) -> Option<&str> {
        let run = self.cut.as_ref()?.get(windows::of_run(window))?;
        Some(&run.label)
    }
}

impl MultimodalModel for MotionModel {
    fn starts(&self, mechanism: usize, runs: &[Run], residual: &[Vec<Vec<f64>>]) -> Vec<Vec<(usize, f64)>> {
        let mechanism = &self.spec.mechanisms[mechanism];
        let mut starts = super::start::mechanism(mechanism, &self.spec, &self.roles, &self.scales);
        if let [amplitude, phase, periods] = mechanism.parameters[..]
            && let Role::Joint(joint, JointEffect::CogAmplitude) = self.roles[self.spec.slots()[amplitude]]
        {
            let position = self.equations.joints[joint].position;
            if let Some(channel) = self.equations.outputs.iter().position(|o| o.state == Some(position)) {
                let told = detents(runs, channel, residual).into_iter().map(|detent| {
                    vec![(amplitude, detent.amplitude), (phase, detent.phase), (periods, detent.periods)]
                });
                starts.extend(told);
            }
        }
        starts
    }
}

impl JointLimits for MotionModel {
    fn implausible(&self, mechanism: usize, shared: &[f64]) -> Option<String> {
        let first = *self.spec.mechanisms[mechanism].parameters.first()?;
        let slot =
            |index: usize| self.spec.parameters[..index].iter().filter(|p| p.scope == Scope::Shared).count();
        let Role::Joint(joint, JointEffect::StopPosition) = *self.roles.get(slot(first))? else {
            return None;
        };
        let at = self.roles.iter().position(|r| *r == Role::Joint(joint, JointEffect::StopStiffness))?;
        let sizes = &self.scales.joints[joint];
        let least = STIFFER * sizes.force / sizes.reach;
        (shared[at] < least)
            .then(|| format!("a stop of {:.3} 1/s^2 gives way like the joint's own spring", shared[at]))
    }
}
