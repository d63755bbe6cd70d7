//! A machine at given parameters: the recording's equations and the laws that act beside them.

use joint_laws::Number;
use joint_laws::friction::DryFriction;
use joint_laws::hysteresis::bouc_wen_rate;
use joint_laws::integrate::{Ceiling, Contact, Edge, Machine, Point};
use joint_laws::signal::Signal;
use joint_laws::spring::{cogging, end_stop};

use super::equations::{Equations, Joint};
use super::law::{Adds, LawTerm};

/// A smooth force on a joint.
#[derive(Debug, Clone, Copy)]
pub(super) enum Force<T> {
    /// `-c v`, `-c |v| v` or `-c v^3`, by the number of further speeds.
    Damping(usize, T),
    /// `-k x`, `-k x^2` or `-k x^3`, by the number of further positions.
    Stiffness(usize, T),
    Constant(T),
    /// Amplitude, phase, periods a turn.
    Cogging([T; 3]),
    /// Position, stiffness, whether it stands above the free range, and the edge.
    Stop(T, T, bool, usize),
    /// Stiffness and yield of a spring that yields, the state of its deflection, the edges of velocity and deflection.
    Yielding(T, T, usize, [usize; 2]),
}

/// What acts on a joint beside the equations.
#[derive(Debug, Clone)]
pub(super) struct JointLaws<T> {
    /// Dry friction, where any is on.
    pub(super) dry: Option<DryFriction<T>>,
    pub(super) forces: Vec<Force<T>>,
    /// All accelerations are smaller by 1 plus this.
    pub(super) inertia: Option<T>,
}

impl<T: Number> JointLaws<T> {
    pub(super) fn none() -> Self {
        Self { dry: None, forces: Vec::new(), inertia: None }
    }

    /// The smooth force on the joint at a position with a velocity.
    #[inline(always)]
    fn force(&self, x: T, v: T, states: &[T], beyond: &[bool]) -> T {
        let mut sum = T::from(0.0);
        for force in &self.forces {
            match *force {
                Force::Damping(0, c) => sum -= c * v,
                Force::Damping(1, c) => sum -= c * v * v.modulus(),
                Force::Damping(_, c) => sum -= c * v * v * v,
                Force::Stiffness(0, k) => sum -= k * x,
                Force::Stiffness(1, k) => sum -= k * x * x,
                Force::Stiffness(_, k) => sum -= k * x * x * x,
                Force::Constant(f) => sum += f,
                Force::Cogging([amplitude, phase, periods]) => sum += cogging(x, amplitude, phase, periods),
                Force::Stop(at, stiffness, above, edge) => {
                    sum += end_stop(x, at, stiffness, beyond[edge] == above);
                }
                Force::Yielding(stiffness, _, state, _) => sum -= stiffness * states[state],
            }
        }
        sum
    }
}

/// Two effects of a drive that differ by less than this part of them are the same.
const EVEN: f64 = 1e-6;

/// A machine at given parameters, driven by given signals.
pub(super) struct Driven<'a, T> {
    pub(super) equations: &'a Equations,
    pub(super) laws: Vec<JointLaws<T>>,
    /// Terms of an unknown law, with their coefficients, and registers to evaluate them in.
    pub(super) terms: Vec<(&'a LawTerm, T)>,
    pub(super) room: Vec<T>,
    /// Rates of leaks, by level.
    pub(super) leaks: Vec<Option<T>>,
    pub(super) signals: Vec<Signal<T>>,
    /// How many pieces of each signal have begun.
    pub(super) begun: Vec<usize>,
    /// True seconds in a second of the clock, where the two differ.
    pub(super) pace: Option<T>,
    pub(super) contacts: Vec<Contact>,
    /// The joint of each contact.
    pub(super) joint_of: Vec<usize>,
    pub(super) ceilings: Vec<Ceiling<T>>,
    pub(super) edges: Vec<Edge<T>>,
    /// Which of them are passed.
    pub(super) beyond: Vec<bool>,
    /// Registers of the rates' tape and of the outputs': states, inputs, parameters and time first, as expressions name them.
    pub(super) values: Vec<T>,
    pub(super) seen: Vec<T>,
    /// Registers of the rates' tape under another command, and the derivatives there.
    pub(super) idle: Vec<T>,
    pub(super) other: Vec<T>,
    /// By joint: what a unit of its drive does to its velocity's derivative where all states are zero, of joints that a drive moves more or less
    /// by the machine's pose: there its forces are what they are called.
    pub(super) nominal: Vec<Option<T>>,
    /// By joint: operations of the rates' tape that its drive enters.
    pub(super) driven: Vec<Vec<usize>>,
    /// Time and number of pieces of inputs for which the rates' registers hold, if they do for any.
    pub(super) looked: (f64, usize),
}

impl<T: Number> Driven<'_, T> {
    /// Puts states, inputs and time where expressions find them, and computes the equations' derivatives, unless they are there.
    fn look(&mut self, t: f64, x: &[T]) {
        self.look_here(t, x);
    }

    /// The same, compiled for whatever processor the caller is compiled for.
    #[inline(always)]
    fn look_here(&mut self, t: f64, x: &[T]) {
        let states = self.equations.states.len();
        // Pieces begin one after the other and none is taken back: their number tells which have.
        let now = (t, self.begun.iter().sum());
        if self.looked == now && self.values[..states] == x[..states] {
            return;
        }
        let begins = self.looked.1 != now.1;
        self.looked = now;
        self.values[..states].copy_from_slice(&x[..states]);
        for (k, signal) in self.signals.iter().enumerate() {
            if begins || !signal.is_flat() {
                self.values[states + k] = signal.value(self.begun[k], t);
            }
        }
        let last = self.equations.names() - 1;
        self.values[last] = T::from(t);
        self.equations.rates.run(&mut self.values);
    }

    #[inline(always)]
    fn rate(&self, state: usize) -> T {
        self.equations.rates.result(&self.values, state)
    }

    /// What the outputs should read: `read` gets the number and the value of each of those that are `wanted`. Where derivatives are not
    /// said, the machine stands still.
    pub(super) fn outputs(
        &mut self,
        t: f64,
        Point { x, rates }: Point<'_, T>,
        wanted: impl Fn(usize) -> bool,
        mut read: impl FnMut(usize, T),
    ) {
        let states = self.equations.states.len();
        self.seen[..states].copy_from_slice(&x[..states]);
        for (k, signal) in self.signals.iter().enumerate() {
            self.seen[states + k] = signal.value(self.begun[k], t);
        }
        let last = self.equations.names() - 1;
        self.seen[last] = T::from(t);
        if self.equations.reads_rates {
            // Derivatives in true time.
            let rate = |state: usize| rates.get(state).copied().unwrap_or(T::from(0.0));
            let paced = |rate: T| self.pace.map_or(rate, |pace| rate / pace);
            (0..states).for_each(|state| self.seen[last + 1 + state] = paced(rate(state)));
        }
        self.equations.readings.run(&mut self.seen);
        for c in (0..self.equations.outputs.len()).filter(|c| wanted(*c)) {
            let mut reading = self.equations.readings.result(&self.seen, c);
            for (term, coefficient) in self.terms.iter().filter(|(term, _)| term.adds == Adds::Reading(c)) {
                self.room[..=last].copy_from_slice(&self.seen[..=last]);
                reading += *coefficient * term.value(&mut self.room);
            }
            read(c, reading);
        }
    }

    /// Adds what the terms of an unknown law do to the states' derivatives.
    fn unknown_law(&mut self, t: f64, x: &[T], rates: &mut [T]) {
        let names = self.equations.names();
        for k in 0..self.terms.len() {
            let (term, coefficient) = self.terms[k];
            self.look(t, x);
            self.room[..names].copy_from_slice(&self.values[..names]);
            match term.adds {
                Adds::Force(joint) => {
                    let force = coefficient * term.value(&mut self.room);
                    self.exert(joint, force, t, x, rates);
                }
                Adds::Rate(state) => rates[state] += coefficient * term.value(&mut self.room),
                Adds::Reading(_) => {}
            }
        }
    }

    /// The equations' derivatives where a joint's drive has another value, into `other`.
    fn under(&mut self, joint: usize, drive: usize, value: T) {
        let equations = self.equations;
        self.idle.copy_from_slice(&self.values);
        self.idle[equations.input_name(drive)] = value;
        equations.rates.again(&self.driven[joint], &mut self.idle);
        for (state, other) in self.other.iter_mut().enumerate().take(equations.states.len()) {
            *other = equations.rates.result(&self.idle, state);
        }
    }

    /// The force by which its drive moves a joint: the derivative of its velocity less what it were without the drive (a command of
    /// zero, or of the position where the joint is).
    fn load(&mut self, joint: usize) -> T {
        let Joint { drive, follows, position, velocity, .. } = self.equations.joints[joint];
        let Some(drive) = drive else { return T::from(0.0) };
        let idle = if follows { self.values[position] } else { T::from(0.0) };
        self.under(joint, drive, idle);
        self.rate(velocity) - self.other[velocity]
    }

    /// What `step` more of a joint's drive does to the derivative of its velocity, here; the derivatives there stand in `other`.
    fn effect(&mut self, number: usize, step: f64) -> Option<T> {
        let joint = &self.equations.joints[number];
        let drive = joint.drive?;
        let now = self.values[self.equations.input_name(drive)];
        self.under(number, drive, now + step);
        Some(self.other[joint.velocity] - self.rate(joint.velocity))
    }

    /// What a unit of a joint's drive does to the derivative of its velocity at a pose, where all units do the same.
    pub(super) fn effect_at(&mut self, number: usize, t: f64, x: &[T]) -> Option<T> {
        self.look(t, x);
        let (more, less) = (self.effect(number, 1.0)?, self.effect(number, -1.0)?);
        let even = (more.re() + less.re()).abs() <= EVEN * more.re().abs();
        even.then_some(more)
    }

    /// How much further a force on a joint takes its velocity's derivative here than it is called: where a drive moves joints that carry one
    /// another, by as much as it does the drive's.
    #[inline(always)]
    fn lever(&mut self, number: usize, t: f64, x: &[T]) -> Option<T> {
        let nominal = self.nominal[number]?;
        self.look(t, x);
        Some(self.effect(number, 1.0)? / nominal)
    }

    /// By how much a unit of a joint's force changes other states' derivatives: in proportion to what its drive does there. The shares
    /// stand in `other` for the states that the drive acts on.
    fn shares(&mut self, number: usize, own: T) {
        let joint = &self.equations.joints[number];
        for &state in &joint.reacts {
            let change = self.other[state] - self.rate(state);
            self.other[state] = if own.re() == 0.0 { T::from(0.0) } else { change / own };
        }
    }
}

impl<T: Number> Driven<'_, T> {
    /// Adds what a force on a joint does to the states' derivatives: as much as it is to that of the joint's velocity.
    #[inline(always)]
    pub(super) fn act(&mut self, number: usize, force: T, t: f64, x: &[T], rates: &mut [T]) {
        self.act_by(number, |_| force, t, x, rates);
    }

    /// The same of a force by what it is called, which goes further or less far by the pose.
    #[inline(always)]
    fn exert(&mut self, number: usize, force: T, t: f64, x: &[T], rates: &mut [T]) {
        let nominal = self.nominal[number];
        self.act_by(number, |own| nominal.map_or(force, |nominal| own / nominal * force), t, x, rates);
    }

    /// Adds what a force on a joint does to the states' derivatives, the force by what a unit of the joint's drive does to that of its velocity; of a
    /// joint whose drive acts on nothing else, by no matter what.
    #[inline(always)]
    fn act_by(&mut self, number: usize, force: impl Fn(T) -> T, t: f64, x: &[T], rates: &mut [T]) {
        let joint = &self.equations.joints[number];
        if joint.reacts.is_empty() {
            rates[joint.velocity] += force(T::from(1.0));
            return;
        }
        self.look(t, x);
        let Some(own) = self.effect(number, 1.0) else { return };
        let force = force(own);
        rates[joint.velocity] += force;
        self.shares(number, own);
        joint.reacts.iter().for_each(|&state| rates[state] += self.other[state] * force);
    }
}

impl<T: Number> Machine<T> for Driven<'_, T> {
    fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    fn ceilings(&self) -> &[Ceiling<T>] {
        &self.ceilings
    }

    fn edges(&self) -> &[Edge<T>] {
        &self.edges
    }

    fn reads_rates(&self) -> bool {
        self.equations.reads_rates
    }

    fn cross(&mut self, edge: usize, beyond: bool) {
        self.beyond[edge] = beyond;
    }

    #[inline(always)]
    fn smooth(&mut self, t: f64, x: &[T], rates: &mut [T]) {
        self.look_here(t, x);
        let equations = self.equations;
        for (state, rate) in rates.iter_mut().enumerate().take(equations.states.len()) {
            *rate = self.rate(state);
        }
        if !self.terms.is_empty() {
            self.unknown_law(t, x, rates);
        }
        for (k, joint) in equations.joints.iter().enumerate() {
            if !self.laws[k].forces.is_empty() {
                let v = x[joint.velocity];
                let force = self.laws[k].force(x[joint.position], v, x, &self.beyond);
                self.exert(k, force, t, x, rates);
                for law in &self.laws[k].forces {
                    if let Force::Yielding(_, yields, state, [forward, stretched]) = *law {
                        let signs = (self.beyond[forward], self.beyond[stretched]);
                        rates[state] = bouc_wen_rate(v, x[state], yields, signs.0, signs.1);
                    }
                }
            }
            if let Some(inertia) = self.laws[k].inertia {
                rates[joint.velocity] = rates[joint.velocity] / (inertia + 1.0);
            }
        }
        for (leak, &level) in self.leaks.iter().zip(&equations.levels) {
            if let Some(leak) = leak {
                rates[level] -= *leak * x[level];
            }
        }
        if let Some(pace) = self.pace {
            rates.iter_mut().for_each(|rate| *rate = *rate * pace);
        }
    }

    #[inline(always)]
    fn push(&mut self, contact: usize, force: T, t: f64, x: &[T], rates: &mut [T]) {
        self.act(self.joint_of[contact], force, t, x, rates);
    }

    #[inline(always)]
    fn resistance(&mut self, contact: usize, forward: bool, t: f64, x: &[T]) -> T {
        let k = self.joint_of[contact];
        let rests_on_load = |dry: &DryFriction<T>| dry.load_fraction != T::from(0.0);
        let load = if self.laws[k].dry.as_ref().is_some_and(rests_on_load) {
            self.look(t, x);
            self.load(k)
        } else {
            T::from(0.0)
        };
        let Some(dry) = &self.laws[k].dry else { return T::from(0.0) };
        let joint = &self.equations.joints[k];
        let mut resistance = dry.resistance(forward, x[joint.velocity], load);
        if let Some(lever) = self.lever(k, t, x) {
            resistance = resistance * lever;
        }
        if let Some(inertia) = self.laws[k].inertia {
            resistance = resistance / (inertia + 1.0);
        }
        self.pace.map_or(resistance, |pace| resistance * pace)
    }
}
