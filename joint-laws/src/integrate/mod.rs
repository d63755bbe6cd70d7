//! Motion with dry friction and ceilings, integrated from event to event.
//!
//! Between events the motion is smooth, and a Runge-Kutta scheme of high order follows it ([`Method`]). An event (a joint comes to rest, a
//! force overcomes what holds it, a level reaches its ceiling, a law changes its form) is found to rounding, and the next step begins
//! there: no smoothed sign function, no width that decides the answer (Filippov 1988, doi:10.1007/978-94-015-7793-9).
//!
//! Times are real. In dual numbers the time of an event has an infinitesimal part: the motion is led there by the rates before it and
//! back by those behind it, so that its derivatives are exact across the event (the saltation matrix; Leine and Nijmeijer 2004,
//! doi:10.1007/978-3-540-44398-8).

mod events;
mod scheme;

use crate::Number;
pub use scheme::Method;
use scheme::Scheme;

/// A joint that dry friction may hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Contact {
    /// Index of the state that is its velocity.
    pub velocity: usize,
}

/// A state that cannot exceed a value; what comes beyond it is lost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ceiling<T> {
    /// Index of the state.
    pub state: usize,
    /// Its largest value.
    pub height: T,
}

/// A value of a state where a law changes its form, continuously.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge<T> {
    /// Index of the state.
    pub state: usize,
    /// The value.
    pub at: T,
}

/// The equations of motion of a machine.
///
/// `smooth`, `push` and `resistance` are where the time goes. What of them is `#[inline(always)]` is compiled for the vector instructions
/// that the processor turns out to have.
pub trait Machine<T: Number> {
    /// Joints with dry friction.
    fn contacts(&self) -> &[Contact];

    /// States with a ceiling.
    fn ceilings(&self) -> &[Ceiling<T>];

    /// Where laws change their form: a step ends there.
    fn edges(&self) -> &[Edge<T>] {
        &[]
    }

    /// The motion is now beyond an edge, or before it; the laws keep the form of that side until the next call.
    fn cross(&mut self, _edge: usize, _beyond: bool) {}

    /// Whether readings depend on the states' derivatives, as an accelerometer's do.
    fn reads_rates(&self) -> bool {
        false
    }

    /// The states' derivatives without dry friction.
    fn smooth(&mut self, t: f64, x: &[T], rates: &mut [T]);

    /// Adds what a contact's force does to the states' derivatives: as much as it is to that of its own velocity.
    fn push(&mut self, contact: usize, force: T, t: f64, x: &[T], rates: &mut [T]);

    /// The friction that opposes sliding forward or backward.
    fn resistance(&mut self, contact: usize, forward: bool, t: f64, x: &[T]) -> T;
}

/// A motion that could not be followed.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("state {state} is {value} at t = {t_s} s")]
pub struct Diverged {
    /// Index of the state that is no number, or beyond all bounds.
    pub state: usize,
    /// Its value.
    pub value: f64,
    /// When, s.
    pub t_s: f64,
}

/// A time at which the motion is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// When, s.
    pub t_s: f64,
    /// What for, in the caller's numbers.
    pub row: usize,
    /// Which of the caller's infinitesimal shifts in time it has.
    pub shift: usize,
}

/// The motion at a reading.
#[derive(Debug, Clone, Copy)]
pub struct Point<'a, T> {
    /// The states.
    pub x: &'a [T],
    /// Their derivatives, friction and ceilings included, of a machine that [reads](Machine::reads_rates) them; else nothing.
    pub rates: &'a [T],
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mode {
    Forward,
    Backward,
    Rest,
}

/// Events in one step that are located; more are a chatter below the step's resolution.
const MOST_EVENTS: usize = 40;
/// A state beyond this has blown up.
const LARGEST: f64 = 1e12;

/// Errors by which steps are made shorter.
#[derive(Debug, Clone)]
struct Control {
    /// Steps are not cut below this, s.
    finest_s: f64,
    /// The largest error of each state in a step.
    errors: Vec<f64>,
    /// The step to be tried next, s.
    next_s: f64,
}

/// Follows a machine's motion; holds the room that this takes.
#[derive(Debug, Clone)]
pub struct Integrator<T> {
    scheme: Scheme,
    /// Largest step, s.
    step_s: f64,
    control: Option<Control>,
    /// Trial steps made.
    tried: usize,
    /// What this processor can do.
    arch: pulp::Arch,
    modes: Vec<Mode>,
    full: Vec<bool>,
    beyond: Vec<bool>,
    /// Rates at each stage of the last trial step.
    rates: Vec<Vec<T>>,
    /// Whether the first of them are those at the present point.
    fresh: bool,
    stage: Vec<T>,
    trial: Vec<T>,
    point: Vec<T>,
    spare: Vec<T>,
}

/// One step, compiled for each kind of processor.
struct Trial<'a, T, M> {
    integrator: &'a mut Integrator<T>,
    machine: &'a mut M,
    t: f64,
    x: &'a [T],
    h: f64,
}

impl<T: Number, M: Machine<T>> pulp::NullaryFnOnce for Trial<'_, T, M> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.integrator.try_step(self.machine, self.t, self.x, self.h);
    }
}

impl<T: Number> Integrator<T> {
    /// An integrator with steps of at most `step_s` for a machine of `states` states.
    pub fn new(method: Method, states: usize, step_s: f64) -> Self {
        let room = || vec![T::from(0.0); states];
        let scheme = method.scheme();
        Self {
            scheme,
            step_s,
            control: None,
            tried: 0,
            arch: pulp::Arch::new(),
            modes: Vec::new(),
            full: Vec::new(),
            beyond: Vec::new(),
            rates: scheme.nodes.iter().map(|_| room()).collect(),
            fresh: false,
            stage: room(),
            trial: room(),
            point: room(),
            spare: room(),
        }
    }

    /// Cuts steps, to `finest_s` at the least, where the embedded scheme differs by more than a state's error; of a method that has none
    /// all steps are as fine. States without an error are not asked.
    #[must_use]
    pub fn controlled(mut self, finest_s: f64, errors: Vec<f64>) -> Self {
        if self.scheme.error.is_empty() {
            self.step_s = finest_s;
        } else {
            self.control = Some(Control { finest_s, errors, next_s: finest_s });
        }
        self
    }

    /// Evaluations of the states' derivatives so far in steps, those included that were made again shorter: what an integration costs.
    pub fn evaluations(&self) -> usize {
        self.tried * (self.scheme.nodes.len() - usize::from(self.scheme.last_is_end))
    }

    /// Finds out which joints rest, which levels are full and which edges are passed: at the beginning, and wherever an input jumps.
    pub fn settle(&mut self, machine: &mut impl Machine<T>, t: f64, x: &mut [T]) {
        self.fresh = false;
        let (contacts, ceilings) = (machine.contacts().len(), machine.ceilings().len());
        self.modes.resize(contacts, Mode::Rest);
        self.full.resize(ceilings, false);
        self.beyond.resize(machine.edges().len(), false);
        for e in 0..self.beyond.len() {
            let Edge { state, at } = machine.edges()[e];
            let mut beyond = x[state].re() > at.re();
            if x[state].re() == at.re() {
                let rate = self.smooth_rate(machine, t, x, state).re();
                beyond = rate > 0.0;
            }
            self.beyond[e] = beyond;
            machine.cross(e, beyond);
        }
        for c in 0..ceilings {
            let Ceiling { state, height } = machine.ceilings()[c];
            self.full[c] = x[state].re() >= height.re();
            if self.full[c] {
                x[state] = height;
                self.full[c] = self.smooth_rate(machine, t, x, state).re() > 0.0;
            }
        }
        for c in 0..contacts {
            let v = x[machine.contacts()[c].velocity].re();
            self.modes[c] = if v > 0.0 {
                Mode::Forward
            } else if v < 0.0 {
                Mode::Backward
            } else {
                self.at_rest(machine, c, t, x)
            };
        }
    }

    /// Moves the states by an infinitesimal time.
    pub fn nudge(&mut self, machine: &mut impl Machine<T>, t: f64, x: &mut [T], by: T) {
        if by == T::from(0.0) {
            return;
        }
        let mut rates = std::mem::take(&mut self.spare);
        self.derivative(machine, t, x, &mut rates);
        x.iter_mut().zip(&rates).for_each(|(x, r)| *x += *r * by);
        self.spare = rates;
        self.fresh = false;
    }

    /// The motion along its tangent, a time away.
    pub fn along_tangent(&mut self, machine: &mut impl Machine<T>, t: f64, x: &[T], away: T) -> Point<'_, T> {
        let mut rates = std::mem::take(&mut self.spare);
        self.derivative(machine, t, x, &mut rates);
        self.point.clear();
        self.point.extend(x.iter().zip(&rates).map(|(x, r)| *x + *r * away));
        self.spare = rates;
        Point { x: &self.point, rates: if machine.reads_rates() { &self.spare } else { &[] } }
    }

    /// Reads the motion where the states are `x`.
    fn read<M: Machine<T>>(
        &mut self,
        machine: &mut M,
        reading: &Reading,
        x: &[T],
        read: &mut impl FnMut(&mut M, &Reading, Point<'_, T>),
    ) {
        if !machine.reads_rates() {
            return read(machine, reading, Point { x, rates: &[] });
        }
        let mut rates = std::mem::take(&mut self.spare);
        self.derivative(machine, reading.t_s, x, &mut rates);
        read(machine, reading, Point { x, rates: &rates });
        self.spare = rates;
    }

    fn smooth_rate(&mut self, machine: &mut impl Machine<T>, t: f64, x: &[T], state: usize) -> T {
        machine.smooth(t, x, &mut self.spare);
        self.spare[state]
    }

    /// What a contact does whose velocity is zero.
    fn at_rest(&mut self, machine: &mut impl Machine<T>, c: usize, t: f64, x: &[T]) -> Mode {
        self.modes[c] = Mode::Rest;
        let force = -self.holding(machine, c, t, x).re();
        if force > machine.resistance(c, true, t, x).re() {
            Mode::Forward
        } else if force < -machine.resistance(c, false, t, x).re() {
            Mode::Backward
        } else {
            Mode::Rest
        }
    }

    /// The force that keeps a resting contact where it is.
    fn holding(&mut self, machine: &mut impl Machine<T>, c: usize, t: f64, x: &[T]) -> T {
        let at = machine.contacts()[c].velocity;
        let mut rates = std::mem::take(&mut self.spare);
        machine.smooth(t, x, &mut rates);
        for other in (0..self.modes.len()).filter(|o| *o != c) {
            if self.modes[other] != Mode::Rest {
                self.slide(machine, other, t, x, &mut rates);
            }
        }
        let force = -rates[at];
        self.spare = rates;
        force
    }

    /// Adds the friction of a sliding contact.
    #[inline(always)]
    fn slide(&self, machine: &mut impl Machine<T>, c: usize, t: f64, x: &[T], rates: &mut [T]) {
        let forward = self.modes[c] == Mode::Forward;
        let friction = machine.resistance(c, forward, t, x);
        machine.push(c, if forward { -friction } else { friction }, t, x, rates);
    }

    /// The states' derivatives, friction and ceilings included.
    fn derivative(&mut self, machine: &mut impl Machine<T>, t: f64, x: &[T], rates: &mut [T]) {
        self.derivative_here(machine, t, x, rates);
    }

    /// The same, compiled for whatever processor the caller is compiled for.
    #[inline(always)]
    fn derivative_here(&mut self, machine: &mut impl Machine<T>, t: f64, x: &[T], rates: &mut [T]) {
        machine.smooth(t, x, rates);
        for c in 0..self.modes.len() {
            if self.modes[c] != Mode::Rest {
                self.slide(machine, c, t, x, rates);
            }
        }
        let resting = self.modes.iter().filter(|m| **m == Mode::Rest).count();
        // Forces that hold one contact may load another: a few sweeps settle them.
        for _ in 0..if resting > 1 { 20 } else { resting } {
            for c in 0..self.modes.len() {
                if self.modes[c] == Mode::Rest {
                    let force = -rates[machine.contacts()[c].velocity];
                    machine.push(c, force, t, x, rates);
                }
            }
        }
        for (c, mode) in self.modes.iter().enumerate() {
            if *mode == Mode::Rest {
                rates[machine.contacts()[c].velocity] = T::from(0.0);
            }
        }
        for (c, full) in self.full.iter().enumerate() {
            if *full {
                rates[machine.ceilings()[c].state] = T::from(0.0);
            }
        }
    }

    /// One step, whatever happens in it, into `trial`.
    fn step(&mut self, machine: &mut impl Machine<T>, t: f64, x: &[T], h: f64) {
        self.arch.dispatch(Trial { integrator: self, machine, t, x, h });
    }

    /// The same, compiled for whatever processor the caller is compiled for.
    #[inline(always)]
    fn try_step(&mut self, machine: &mut impl Machine<T>, t: f64, x: &[T], h: f64) {
        self.tried += 1;
        let mut rates = std::mem::take(&mut self.rates);
        let mut stage = std::mem::take(&mut self.stage);
        for k in usize::from(self.fresh)..rates.len() {
            let (before, at) = rates.split_at_mut(k);
            let row = k.checked_sub(1).map_or(&[][..], |k| self.scheme.stages[k]);
            combine(x, before, row.iter().map(|part| part * h), &mut stage);
            self.derivative_here(machine, t + self.scheme.nodes[k] * h, &stage, &mut at[0]);
        }
        self.fresh = true;
        self.rates = rates;
        self.stage = stage;
        if self.scheme.last_is_end {
            self.trial.copy_from_slice(&self.stage);
        } else {
            let mut trial = std::mem::take(&mut self.trial);
            self.within(x, h, 1.0, &mut trial);
            self.trial = trial;
        }
    }

    /// The states a part of the way through the trial step.
    #[inline]
    fn within(&self, x: &[T], h: f64, part: f64, into: &mut [T]) {
        combine(x, &self.rates, self.scheme.weights.iter().map(|w| h * Scheme::weight(w, part)), into);
    }

    /// The same, moved on by an infinitesimal time.
    fn within_moved(&self, x: &[T], h: f64, part: f64, by: T, into: &mut [T]) {
        self.within(x, h, part, into);
        if by != T::from(0.0) {
            for (w, rates) in self.scheme.weights.iter().zip(&self.rates) {
                let slope = Scheme::slope(w, part);
                into.iter_mut().zip(rates).for_each(|(s, r)| *s += *r * by * slope);
            }
        }
    }

    /// Moves the states from `*t` to `to`, between which inputs must not jump, and reads them on the way.
    ///
    /// `reads` rise in time and lie between the two; each has one of the infinitesimal `shifts`. `read` gets the machine, the reading and
    /// the motion there.
    ///
    /// # Errors
    /// [`Diverged`].
    #[allow(clippy::too_many_arguments, reason = "from, to, and what is read on the way")]
    pub fn advance<M: Machine<T>>(
        &mut self,
        machine: &mut M,
        t: &mut f64,
        x: &mut [T],
        to: f64,
        reads: &[Reading],
        shifts: &[T],
        mut read: impl FnMut(&mut M, &Reading, Point<'_, T>),
    ) -> Result<(), Diverged> {
        let mut reads = reads.iter().peekable();
        let shift = |r: &Reading| shifts.get(r.shift).copied().unwrap_or(T::from(0.0));
        let steps = ((to - *t) / self.step_s - 1e-9).ceil().max(1.0);
        let from = *t;
        for k in 1..=steps as u64 {
            let until = if k as f64 >= steps { to } else { from + (to - from) * (k as f64 / steps) };
            let mut events = 0;
            while *t < until {
                let mut next = self.next(*t, until);
                let mut h = next - *t;
                self.step(machine, *t, x, h);
                while let Some(shorter) = self.too_long(h) {
                    (next, h) = (*t + shorter, shorter);
                    self.step(machine, *t, x, h);
                }
                check(&self.trial, next)?;
                let first = if events < MOST_EVENTS { self.first(machine, *t, x, h) } else { None };
                if let Some((_, part)) = first {
                    // The step ends at the event, which laws that change near it may have moved.
                    h *= part;
                    next = *t + h;
                    self.step(machine, *t, x, h);
                    if self.too_long(h).is_some() {
                        continue;
                    }
                }
                while let Some(r) = reads.next_if(|r| r.t_s <= next) {
                    let by = shift(r);
                    let mut point = std::mem::take(&mut self.point);
                    if r.t_s == next && by == T::from(0.0) {
                        point.copy_from_slice(&self.trial);
                    } else {
                        let part = if h > 0.0 { (r.t_s - *t) / h } else { 0.0 };
                        self.within_moved(x, h, part, by, &mut point);
                    }
                    self.read(machine, r, &point, &mut read);
                    self.point = point;
                }
                if let Some((event, _)) = first {
                    events += 1;
                    x.copy_from_slice(&self.trial);
                    *t = next + self.happen(machine, event, next, x, h);
                    self.fresh = false;
                } else {
                    x.copy_from_slice(&self.trial);
                    *t = next;
                    events = 0;
                    self.fresh = self.scheme.last_is_end;
                    if self.fresh {
                        let last = self.rates.len() - 1;
                        self.rates.swap(0, last);
                    }
                }
            }
        }
        for r in reads {
            let by = shift(r);
            let mut point = std::mem::take(&mut self.point);
            point.copy_from_slice(x);
            self.nudge(machine, *t, &mut point, by);
            self.read(machine, r, &point, &mut read);
            self.point = point;
        }
        Ok(())
    }

    /// Where the next step ends, on the way to `until`.
    fn next(&self, t: f64, until: f64) -> f64 {
        match &self.control {
            // Two equal steps rather than a long one and the rest.
            Some(control) if t + control.next_s < until => {
                t + control.next_s.min((0.5 * (until - t)).max(control.finest_s))
            }
            _ => until,
        }
    }

    /// The shorter step to be taken in place of the trial step, where that errs by too much; else the length of the next one is set.
    fn too_long(&mut self, h: f64) -> Option<f64> {
        // Parts of the step that the estimate allows, and how much one step may differ from the one before.
        const SAFE: f64 = 0.9;
        const SHRINK: f64 = 0.2;
        const GROW: f64 = 5.0;
        let control = self.control.as_mut()?;
        let of_state = |(state, most): (usize, &f64)| {
            let weighed = self.scheme.error.iter().zip(&self.rates).map(|(w, rates)| w * rates[state].re());
            (h * weighed.sum::<f64>() / most).abs()
        };
        // What is no number is too large.
        let larger = |a: f64, b: f64| if b <= a { a } else { b };
        let error = control.errors.iter().enumerate().map(of_state).fold(0.0, larger);
        let factor = SAFE * error.powf(-0.2);
        let wanted =
            (h * if factor.is_nan() { SHRINK } else { factor.clamp(SHRINK, GROW) }).max(control.finest_s);
        if error <= 1.0 || h <= control.finest_s {
            // A step that ended early for another reason says little of the next.
            control.next_s =
                if h < control.next_s && factor >= 1.0 { control.next_s.max(wanted) } else { wanted };
            return None;
        }
        control.next_s = wanted;
        Some(wanted)
    }
}

/// States and their rates, each of these so many times.
#[inline(always)]
fn combine<T: Number>(x: &[T], rates: &[Vec<T>], weights: impl Iterator<Item = f64> + Clone, into: &mut [T]) {
    for (state, into) in into.iter_mut().enumerate() {
        let mut sum = x[state];
        for (rates, weight) in rates.iter().zip(weights.clone()).filter(|(_, weight)| *weight != 0.0) {
            sum.add_scaled(rates[state], weight);
        }
        *into = sum;
    }
}

fn check<T: Number>(x: &[T], t_s: f64) -> Result<(), Diverged> {
    match x.iter().position(|v| !(v.re().abs() <= LARGEST)) {
        Some(state) => Err(Diverged { state, value: x[state].re(), t_s }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests;
