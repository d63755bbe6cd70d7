//! A machine at given parameters: the recording's equations and the laws that act beside them.

use joint_laws::Number;
use joint_laws::friction::DryFriction;
use joint_laws::hysteresis::bouc_wen_rate;
use joint_laws::integrate::{Ceiling, Contact, Machine};
use joint_laws::signal::Signal;
use joint_laws::spring::{cogging, end_stop};

use super::equations::{Equations, Joint};

/// What acts on a joint beside the equations; every coefficient is 0 where it is off.
#[derive(Debug, Clone, Copy)]
pub(super) struct JointLaws<T> {
    /// Dry friction, where any is on.
    pub(super) dry: Option<DryFriction<T>>,
    /// Coefficients of -v, -|v| v, -v^3.
    pub(super) damping: [T; 3],
    /// Coefficients of -x, -x^2, -x^3.
    pub(super) stiffness: [T; 3],
    pub(super) constant: T,
    /// Amplitude, phase, periods a turn.
    pub(super) cogging: Option<[T; 3]>,
    /// Position and stiffness of a stop, and whether it stands above the free range.
    pub(super) stop: Option<(T, T, bool)>,
    /// All accelerations are smaller by 1 plus this.
    pub(super) inertia: T,
    /// Stiffness and yield of a spring that yields, and the state of its deflection.
    pub(super) hysteresis: Option<(T, T, usize)>,
}

impl<T: Number> JointLaws<T> {
    pub(super) fn none() -> Self {
        let zero = T::from(0.0);
        Self {
            dry: None,
            damping: [zero; 3],
            stiffness: [zero; 3],
            constant: zero,
            cogging: None,
            stop: None,
            inertia: zero,
            hysteresis: None,
        }
    }

    /// The smooth force on the joint.
    fn force(&self, x: T, v: T, states: &[T]) -> T {
        let [d1, d2, d3] = self.damping;
        let [k1, k2, k3] = self.stiffness;
        let mut force =
            self.constant - v * (d1 + d2 * v.modulus() + d3 * v * v) - x * (k1 + x * (k2 + k3 * x));
        if let Some([amplitude, phase, periods]) = self.cogging {
            force += cogging(x, amplitude, phase, periods);
        }
        if let Some((position, stiffness, above)) = self.stop {
            force += end_stop(x, position, stiffness, above);
        }
        if let Some((stiffness, _, state)) = self.hysteresis {
            force -= stiffness * states[state];
        }
        force
    }
}

/// A machine at given parameters, driven by given signals.
pub(super) struct Driven<'a, T> {
    pub(super) equations: &'a Equations,
    pub(super) laws: Vec<JointLaws<T>>,
    /// Rates of leaks, by level.
    pub(super) leaks: Vec<T>,
    pub(super) signals: Vec<Signal<T>>,
    /// How many pieces of each signal have begun.
    pub(super) begun: Vec<usize>,
    /// True seconds in a second of the clock.
    pub(super) pace: T,
    pub(super) contacts: Vec<Contact>,
    /// The joint of each contact.
    pub(super) joint_of: Vec<usize>,
    pub(super) ceilings: Vec<Ceiling<T>>,
    /// States, inputs, parameters and time, as expressions name them.
    pub(super) values: Vec<T>,
    pub(super) stack: Vec<T>,
}

impl<T: Number> Driven<'_, T> {
    /// Puts states, inputs and time where expressions find them.
    fn look(&mut self, t: T, x: &[T]) {
        let states = self.equations.states.len();
        self.values[..states].copy_from_slice(&x[..states]);
        for (k, signal) in self.signals.iter().enumerate() {
            self.values[states + k] = signal.value(self.begun[k], t);
        }
        if let Some(last) = self.values.last_mut() {
            *last = t;
        }
    }

    fn rate(&mut self, state: usize) -> T {
        self.equations.states[state].rate.value(&self.values, &mut self.stack)
    }

    /// What output `output` should read.
    pub(super) fn output(&mut self, output: usize, t: T, x: &[T]) -> T {
        self.look(t, x);
        self.equations.outputs[output].expression.value(&self.values, &mut self.stack)
    }

    /// The derivative of a state where an input has another value.
    fn rate_at(&mut self, state: usize, input: usize, value: T) -> T {
        let place = self.equations.input_name(input);
        let before = std::mem::replace(&mut self.values[place], value);
        let rate = self.rate(state);
        self.values[place] = before;
        rate
    }

    /// The force by which its drive moves a joint: the derivative of its velocity less what it were without the drive (a command of
    /// zero, or of the position where the joint is).
    fn load(&mut self, joint: &Joint) -> T {
        let Some(drive) = joint.drive else { return T::from(0.0) };
        let idle = if self.equations.follows(joint) { self.values[joint.position] } else { T::from(0.0) };
        let without = self.rate_at(joint.velocity, drive, idle);
        self.rate(joint.velocity) - without
    }
}

impl<T: Number> Machine<T> for Driven<'_, T> {
    fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    fn ceilings(&self) -> &[Ceiling<T>] {
        &self.ceilings
    }

    fn smooth(&mut self, t: T, x: &[T], rates: &mut [T]) {
        self.look(t, x);
        let states = self.equations.states.len();
        for (state, rate) in rates.iter_mut().enumerate().take(states) {
            *rate = self.rate(state);
        }
        let equations = self.equations;
        for (k, joint) in equations.joints.iter().enumerate() {
            let laws = self.laws[k];
            let (position, v) = (x[joint.position], x[joint.velocity]);
            let force = laws.force(position, v, x);
            if reacts(self.equations, joint) {
                for (state, rate) in rates.iter_mut().enumerate().take(states) {
                    *rate += self.share(joint, state) * force;
                }
            } else {
                rates[joint.velocity] += force;
            }
            rates[joint.velocity] /= laws.inertia + 1.0;
            if let Some((_, yields, state)) = laws.hysteresis {
                rates[state] = bouc_wen_rate(v, x[state], yields);
            }
        }
        for (leak, &level) in self.leaks.iter().zip(&self.equations.levels) {
            rates[level] -= *leak * x[level];
        }
        for rate in rates.iter_mut() {
            *rate *= self.pace;
        }
    }

    fn direction(&mut self, contact: usize, t: T, x: &[T], direction: &mut [T]) {
        let equations = self.equations;
        let joint = &equations.joints[self.joint_of[contact]];
        direction.fill(T::from(0.0));
        if reacts(self.equations, joint) {
            self.look(t, x);
            for (state, d) in direction.iter_mut().enumerate().take(self.equations.states.len()) {
                *d = self.share(joint, state);
            }
        }
        direction[joint.velocity] = T::from(1.0);
    }

    fn resistance(&mut self, contact: usize, forward: bool, t: T, x: &[T]) -> T {
        let k = self.joint_of[contact];
        let laws = self.laws[k];
        let Some(dry) = laws.dry else { return T::from(0.0) };
        let equations = self.equations;
        let joint = &equations.joints[k];
        self.look(t, x);
        let load = self.load(joint);
        dry.resistance(forward, x[joint.velocity], load) * self.pace / (laws.inertia + 1.0)
    }
}

impl<T: Number> Driven<'_, T> {
    /// By how much a unit of a joint's force changes a state's derivative: in proportion to what its drive does there.
    fn share(&mut self, joint: &Joint, state: usize) -> T {
        let one = T::from(1.0);
        let Some(drive) = joint.drive.filter(|_| state != joint.velocity) else {
            return if state == joint.velocity { one } else { T::from(0.0) };
        };
        let place = self.equations.input_name(drive);
        if !self.equations.states[state].rate.has(place) {
            return T::from(0.0);
        }
        let now = self.values[place];
        let (a, b) = (self.rate(state), self.rate_at(state, drive, now + 1.0));
        let (c, d) = (self.rate(joint.velocity), self.rate_at(joint.velocity, drive, now + 1.0));
        if (d - c).re() == 0.0 { T::from(0.0) } else { (b - a) / (d - c) }
    }
}

/// Whether a joint's drive acts on other states than the joint's velocity too.
pub(super) fn reacts(equations: &Equations, joint: &Joint) -> bool {
    joint.drive.is_some_and(|drive| {
        let place = equations.input_name(drive);
        let mut others = equations.states.iter().enumerate().filter(|(s, _)| *s != joint.velocity);
        others.any(|(_, s)| s.rate.has(place)) && equations.states[joint.velocity].rate.has(place)
    })
}
