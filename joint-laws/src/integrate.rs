//! Motion with dry friction and ceilings, integrated from event to event.
//!
//! Between events the motion is smooth, and Runge and Kutta's method of the fourth order follows it. An event (a joint comes to rest, a
//! force overcomes what holds it, a level reaches its ceiling) is found to rounding, and the next step begins there: no smoothed sign
//! function, no width that decides the answer (Filippov 1988, doi:10.1007/978-94-015-7793-9). In dual numbers the time of an event
//! carries its derivatives, so that those of the motion are exact across it.

use crate::Number;

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

/// The equations of motion of a machine.
pub trait Machine<T: Number> {
    /// Joints with dry friction.
    fn contacts(&self) -> &[Contact];

    /// States with a ceiling.
    fn ceilings(&self) -> &[Ceiling<T>];

    /// The states' derivatives without dry friction.
    fn smooth(&mut self, t: T, x: &[T], rates: &mut [T]);

    /// By how much a unit of a contact's force changes each state's derivative; 1 for its own velocity.
    fn direction(&mut self, contact: usize, t: T, x: &[T], direction: &mut [T]);

    /// The friction that opposes sliding forward or backward.
    fn resistance(&mut self, contact: usize, forward: bool, t: T, x: &[T]) -> T;
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

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mode {
    Forward,
    Backward,
    Rest,
}

/// What ends a smooth stretch.
#[derive(Debug, Clone, Copy)]
enum Event {
    /// A sliding contact comes to rest.
    Stops(usize),
    /// A resting contact is overcome, forward or backward.
    Slips(usize, bool),
    /// A state reaches its ceiling.
    Fills(usize),
    /// A state leaves its ceiling.
    Falls(usize),
}

/// Events in one step that are located; more are a chatter below the step's resolution.
const MOST_EVENTS: usize = 40;
/// A state beyond this has blown up.
const LARGEST: f64 = 1e12;

/// Follows a machine's motion; holds the room that this takes.
#[derive(Debug, Clone)]
pub struct Integrator<T> {
    modes: Vec<Mode>,
    full: Vec<bool>,
    rates: [Vec<T>; 4],
    stage: Vec<T>,
    direction: Vec<T>,
    trial: Vec<T>,
    /// Largest step, s.
    step_s: f64,
}

impl<T: Number> Integrator<T> {
    /// An integrator with steps of at most `step_s` for a machine of `states` states.
    pub fn new(states: usize, step_s: f64) -> Self {
        let room = || vec![T::from(0.0); states];
        Self {
            modes: Vec::new(),
            full: Vec::new(),
            rates: [room(), room(), room(), room()],
            stage: room(),
            direction: room(),
            trial: room(),
            step_s,
        }
    }

    /// Finds out which joints rest and which levels are full: at the beginning, and wherever an input jumps.
    pub fn settle(&mut self, machine: &mut impl Machine<T>, t: T, x: &mut [T]) {
        let (contacts, ceilings) = (machine.contacts().len(), machine.ceilings().len());
        self.modes.resize(contacts, Mode::Rest);
        self.full.resize(ceilings, false);
        for c in 0..ceilings {
            let Ceiling { state, height } = machine.ceilings()[c];
            if x[state].re() >= height.re() {
                x[state] = height;
                machine.smooth(t, x, &mut self.rates[0]);
                self.full[c] = self.rates[0][state].re() > 0.0;
            } else {
                self.full[c] = false;
            }
        }
        for c in 0..contacts {
            let at = machine.contacts()[c].velocity;
            let v = x[at].re();
            self.modes[c] = if v > 0.0 {
                Mode::Forward
            } else if v < 0.0 {
                Mode::Backward
            } else {
                self.at_rest(machine, c, t, x)
            };
        }
    }

    /// What a contact does whose velocity is zero.
    fn at_rest(&mut self, machine: &mut impl Machine<T>, c: usize, t: T, x: &[T]) -> Mode {
        self.modes[c] = Mode::Rest;
        let force = -self.holding(machine, c, t, x).re();
        let forward = machine.resistance(c, true, t, x).re();
        let backward = machine.resistance(c, false, t, x).re();
        if force > forward {
            Mode::Forward
        } else if force < -backward {
            Mode::Backward
        } else {
            Mode::Rest
        }
    }

    /// The force that keeps a resting contact where it is.
    fn holding(&mut self, machine: &mut impl Machine<T>, c: usize, t: T, x: &[T]) -> T {
        let at = machine.contacts()[c].velocity;
        let mut rates = std::mem::take(&mut self.rates[0]);
        let modes = std::mem::take(&mut self.modes);
        machine.smooth(t, x, &mut rates);
        for (other, mode) in modes.iter().enumerate() {
            if other != c && *mode != Mode::Rest {
                self.slide(machine, other, *mode == Mode::Forward, t, x, &mut rates);
            }
        }
        let force = -rates[at];
        self.rates[0] = rates;
        self.modes = modes;
        force
    }

    fn slide(
        &mut self,
        machine: &mut impl Machine<T>,
        c: usize,
        forward: bool,
        t: T,
        x: &[T],
        rates: &mut [T],
    ) {
        let friction = machine.resistance(c, forward, t, x);
        let force = if forward { -friction } else { friction };
        machine.direction(c, t, x, &mut self.direction);
        for (rate, d) in rates.iter_mut().zip(&self.direction) {
            *rate += *d * force;
        }
    }

    /// The states' derivatives, friction and ceilings included.
    fn derivative(&mut self, machine: &mut impl Machine<T>, t: T, x: &[T], rates: &mut [T]) {
        machine.smooth(t, x, rates);
        let modes = std::mem::take(&mut self.modes);
        for (c, mode) in modes.iter().enumerate() {
            if *mode != Mode::Rest {
                self.slide(machine, c, *mode == Mode::Forward, t, x, rates);
            }
        }
        let resting = modes.iter().filter(|m| **m == Mode::Rest).count();
        // Forces that hold one contact may load another: a few sweeps settle them.
        for _ in 0..if resting > 1 { 20 } else { resting } {
            for c in (0..modes.len()).filter(|c| modes[*c] == Mode::Rest) {
                let at = machine.contacts()[c].velocity;
                let force = -rates[at];
                machine.direction(c, t, x, &mut self.direction);
                for (rate, d) in rates.iter_mut().zip(&self.direction) {
                    *rate += *d * force;
                }
            }
        }
        for c in (0..modes.len()).filter(|c| modes[*c] == Mode::Rest) {
            rates[machine.contacts()[c].velocity] = T::from(0.0);
        }
        self.modes = modes;
        for (c, full) in self.full.iter().enumerate() {
            if *full {
                rates[machine.ceilings()[c].state] = T::from(0.0);
            }
        }
    }

    /// One step of Runge and Kutta's, whatever happens in it, into `trial`.
    fn step(&mut self, machine: &mut impl Machine<T>, t: T, x: &[T], h: T) {
        let mut rates = std::mem::take(&mut self.rates);
        let mut stage = std::mem::take(&mut self.stage);
        self.derivative(machine, t, x, &mut rates[0]);
        for (k, part) in [(1, 0.5), (2, 0.5), (3, 1.0)] {
            let ahead = h * part;
            for (s, (x, r)) in stage.iter_mut().zip(x.iter().zip(&rates[k - 1])) {
                *s = *x + *r * ahead;
            }
            let (_, later) = rates.split_at_mut(k);
            self.derivative(machine, t + ahead, &stage, &mut later[0]);
        }
        let sixth = h / 6.0;
        for (i, out) in self.trial.iter_mut().enumerate() {
            let [a, b, c, d] = &rates;
            *out = x[i] + (a[i] + (b[i] + c[i]) * 2.0 + d[i]) * sixth;
        }
        self.rates = rates;
        self.stage = stage;
    }

    /// What an event's sign says at the end of the trial step: above 0 before it, below 0 after.
    fn sign(&mut self, machine: &mut impl Machine<T>, event: Event, t: T) -> T {
        let trial = std::mem::take(&mut self.trial);
        let value = match event {
            Event::Stops(c) => {
                let v = trial[machine.contacts()[c].velocity];
                if self.modes[c] == Mode::Forward { v } else { -v }
            }
            Event::Slips(c, forward) => {
                let held = self.holding(machine, c, t, &trial);
                let most = machine.resistance(c, forward, t, &trial);
                if forward { most + held } else { most - held }
            }
            Event::Fills(c) => {
                let Ceiling { state, height } = machine.ceilings()[c];
                height - trial[state]
            }
            Event::Falls(c) => {
                let mut rates = std::mem::take(&mut self.rates[0]);
                machine.smooth(t, &trial, &mut rates);
                let rate = rates[machine.ceilings()[c].state];
                self.rates[0] = rates;
                rate
            }
        };
        self.trial = trial;
        value
    }

    /// The events that may end a step.
    fn possible(&self) -> Vec<Event> {
        let mut events = Vec::new();
        for (c, mode) in self.modes.iter().enumerate() {
            match mode {
                Mode::Rest => events.extend([Event::Slips(c, true), Event::Slips(c, false)]),
                _ => events.push(Event::Stops(c)),
            }
        }
        events.extend(
            self.full.iter().enumerate().map(|(c, f)| if *f { Event::Falls(c) } else { Event::Fills(c) }),
        );
        events
    }

    /// Moves the states from `*t` to `to`; inputs must not jump in between.
    ///
    /// `to` may differ from `*t` by an infinitesimal alone.
    ///
    /// # Errors
    /// [`Diverged`].
    pub fn advance(
        &mut self,
        machine: &mut impl Machine<T>,
        t: &mut T,
        x: &mut [T],
        to: T,
    ) -> Result<(), Diverged> {
        let length = (to - *t).re();
        let steps = (length / self.step_s - 1e-9).ceil().max(1.0);
        let (from, mut events) = (*t, 0);
        for k in 1..=steps as u64 {
            let until = if k as f64 >= steps { to } else { from + (to - from) * (k as f64 / steps) };
            loop {
                let h = until - *t;
                self.step(machine, *t, x, h);
                check(&self.trial, until)?;
                let first = if events < MOST_EVENTS { self.first(machine, *t, x, h) } else { None };
                let Some((event, h)) = first else {
                    x.copy_from_slice(&self.trial);
                    *t = until;
                    break;
                };
                events += 1;
                self.step(machine, *t, x, h);
                x.copy_from_slice(&self.trial);
                *t += h;
                self.happen(machine, event, *t, x);
            }
        }
        Ok(())
    }

    /// The first event within a step, and when it comes.
    fn first(&mut self, machine: &mut impl Machine<T>, t: T, x: &[T], h: T) -> Option<(Event, T)> {
        if h.re() <= 0.0 {
            return None;
        }
        // Signs first, while the trial step still stands.
        let ends: Vec<(Event, f64)> =
            self.possible().into_iter().map(|e| (e, self.sign(machine, e, t + h).re())).collect();
        let mut first: Option<(Event, f64)> = None;
        for (event, end) in ends.into_iter().filter(|(_, end)| *end < 0.0) {
            let at = self.root(machine, event, t, x, h.re(), end);
            if first.is_none_or(|(_, before)| at < before) {
                first = Some((event, at));
            }
        }
        let (event, at) = first?;
        // The infinitesimal part of when it comes, by Newton's method about the real one.
        let mut when = T::from(at);
        let slope = {
            let d = (1e-6 * h.re()).max(1e-12);
            let (a, b) = ((at - d).max(0.0), at + d);
            self.step(machine, t, x, T::from(a));
            let low = self.sign(machine, event, t + a).re();
            self.step(machine, t, x, T::from(b));
            (self.sign(machine, event, t + b).re() - low) / (b - a)
        };
        self.step(machine, t, x, when);
        let miss = self.sign(machine, event, t + when);
        if slope != 0.0 && slope.is_finite() {
            when -= (miss - miss.re()) / slope;
        }
        Some((event, when))
    }

    /// When the sign of an event vanishes within a step at whose end it is below zero (the Illinois method).
    fn root(&mut self, machine: &mut impl Machine<T>, event: Event, t: T, x: &[T], h: f64, end: f64) -> f64 {
        self.step(machine, t, x, T::from(0.0));
        let (mut a, mut b, mut fb) = (0.0, h, end);
        let mut fa = self.sign(machine, event, t).re();
        if fa <= 0.0 {
            // A joint that has just begun to slip has no velocity yet, but will have in a moment.
            a = 1e-3 * h;
            self.step(machine, t, x, T::from(a));
            fa = self.sign(machine, event, t + a).re();
            if fa <= 0.0 {
                return 0.0;
            }
        }
        let mut side = 0;
        for _ in 0..60 {
            let mid = (a * fb - b * fa) / (fb - fa);
            if b - a <= 1e-13 * h {
                break;
            }
            self.step(machine, t, x, T::from(mid));
            let f = self.sign(machine, event, t + mid).re();
            if f == 0.0 {
                return mid;
            }
            if f < 0.0 {
                (b, fb) = (mid, f);
                if side == -1 {
                    fa *= 0.5;
                }
                side = -1;
            } else {
                (a, fa) = (mid, f);
                if side == 1 {
                    fb *= 0.5;
                }
                side = 1;
            }
            if f.abs() < 1e-15 * end.abs() {
                return mid;
            }
        }
        b
    }

    fn happen(&mut self, machine: &mut impl Machine<T>, event: Event, t: T, x: &mut [T]) {
        match event {
            Event::Stops(c) => {
                x[machine.contacts()[c].velocity] = T::from(0.0);
                self.modes[c] = self.at_rest(machine, c, t, x);
            }
            Event::Slips(c, forward) => self.modes[c] = if forward { Mode::Forward } else { Mode::Backward },
            Event::Fills(c) => {
                let Ceiling { state, height } = machine.ceilings()[c];
                x[state] = height;
                self.full[c] = true;
            }
            Event::Falls(c) => self.full[c] = false,
        }
    }
}

fn check<T: Number>(x: &[T], t: T) -> Result<(), Diverged> {
    match x.iter().position(|v| !(v.re().abs() <= LARGEST)) {
        Some(state) => Err(Diverged { state, value: x[state].re(), t_s: t.re() }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests;
