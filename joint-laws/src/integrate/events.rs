//! What ends a smooth stretch: found as a sign that vanishes, and let happen.

use super::scheme::Scheme;
use super::{Ceiling, Edge, Integrator, Machine, Mode};
use crate::Number;

/// What ends a smooth stretch.
#[derive(Debug, Clone, Copy)]
pub(super) enum Event {
    /// A sliding contact comes to rest.
    Stops(usize),
    /// A resting contact is overcome, forward or backward.
    Slips(usize, bool),
    /// A state reaches its ceiling.
    Fills(usize),
    /// A state leaves its ceiling.
    Falls(usize),
    /// A state passes an edge.
    Crosses(usize),
}

impl<T: Number> Integrator<T> {
    /// What an event's sign says at a point: above 0 before it, below 0 after.
    fn sign(&mut self, machine: &mut impl Machine<T>, event: Event, t: f64, x: &[T]) -> T {
        match event {
            Event::Stops(c) => {
                let v = x[machine.contacts()[c].velocity];
                if self.modes[c] == Mode::Forward { v } else { -v }
            }
            Event::Slips(c, forward) => {
                let held = self.holding(machine, c, t, x);
                let most = machine.resistance(c, forward, t, x);
                if forward { most + held } else { most - held }
            }
            Event::Fills(c) => {
                let Ceiling { state, height } = machine.ceilings()[c];
                height - x[state]
            }
            Event::Falls(c) => {
                let state = machine.ceilings()[c].state;
                self.smooth_rate(machine, t, x, state)
            }
            Event::Crosses(e) => {
                let Edge { state, at } = machine.edges()[e];
                if self.beyond[e] { x[state] - at } else { at - x[state] }
            }
        }
    }

    /// The `k`-th of the events that may end a step.
    fn possible(&self, k: usize) -> Option<Event> {
        let (contacts, ceilings) = (self.modes.len(), self.full.len());
        if k < 2 * contacts {
            let (c, forward) = (k / 2, k.is_multiple_of(2));
            return match self.modes[c] {
                Mode::Rest => Some(Event::Slips(c, forward)),
                _ => forward.then_some(Event::Stops(c)),
            };
        }
        let c = k - 2 * contacts;
        if c < ceilings {
            return Some(if self.full[c] { Event::Falls(c) } else { Event::Fills(c) });
        }
        Some(Event::Crosses(c - ceilings))
    }

    /// The first event within the trial step, and in which part of it.
    pub(super) fn first(
        &mut self,
        machine: &mut impl Machine<T>,
        t: f64,
        x: &[T],
        h: f64,
    ) -> Option<(Event, f64)> {
        let mut first: Option<(Event, f64)> = None;
        for k in 0..2 * self.modes.len() + self.full.len() + self.beyond.len() {
            let Some(event) = self.possible(k) else { continue };
            let trial = std::mem::take(&mut self.trial);
            let end = self.sign(machine, event, t + h, &trial).re();
            self.trial = trial;
            let below = if end < 0.0 { Some((1.0, end)) } else { self.dip(machine, event, (t, x, h)) };
            if let Some(below) = below {
                let at = self.root(machine, event, (t, x, h), below);
                if first.is_none_or(|(_, before)| at < before) {
                    first = Some((event, at));
                }
            }
        }
        first
    }

    /// Where in the trial step the sign of an event that is above zero at both ends is least, and what it is there, if that is below zero:
    /// a state that turns back behind an edge. Signs that are no state's distance are asked at the ends alone.
    fn dip(
        &mut self,
        machine: &mut impl Machine<T>,
        event: Event,
        (t, x, h): (f64, &[T], f64),
    ) -> Option<(f64, f64)> {
        // Grazes this much shallower than the way to them do nothing, and have no slope by which their time could be told.
        const SHALLOW: f64 = 1e-9;
        let (state, toward) = self.distance(machine, event)?;
        let slope = |part: f64| {
            let of_stages = self.scheme.weights.iter().zip(&self.rates);
            toward * of_stages.map(|(w, rates)| Scheme::slope(w, part) * rates[state].re()).sum::<f64>()
        };
        if !(slope(0.0) < 0.0 && slope(1.0) > 0.0) {
            return None;
        }
        let (mut before, mut behind) = (0.0, 1.0);
        while behind - before > 1e-6 {
            let mid = 0.5 * (before + behind);
            *(if slope(mid) < 0.0 { &mut before } else { &mut behind }) = mid;
        }
        let begin = self.sign(machine, event, t, x).re();
        let mut point = std::mem::take(&mut self.point);
        self.within(x, h, before, &mut point);
        let least = self.sign(machine, event, t + before * h, &point).re();
        self.point = point;
        (least < -SHALLOW * (begin - least)).then_some((before, least))
    }

    /// The state of which an event's sign is the distance to a value, and in which direction.
    fn distance(&self, machine: &impl Machine<T>, event: Event) -> Option<(usize, f64)> {
        let direction = |up: bool| if up { 1.0 } else { -1.0 };
        match event {
            Event::Stops(c) => {
                Some((machine.contacts()[c].velocity, direction(self.modes[c] == Mode::Forward)))
            }
            Event::Fills(c) => Some((machine.ceilings()[c].state, direction(false))),
            Event::Crosses(e) => Some((machine.edges()[e].state, direction(self.beyond[e]))),
            Event::Slips(..) | Event::Falls(_) => None,
        }
    }

    /// In which part of the trial step the sign of an event vanishes, which is below zero at a later part (the Illinois method).
    fn root(
        &mut self,
        machine: &mut impl Machine<T>,
        event: Event,
        (t, x, h): (f64, &[T], f64),
        (later, end): (f64, f64),
    ) -> f64 {
        let mut point = std::mem::take(&mut self.point);
        let mut at = |this: &mut Self, part: f64| {
            this.within(x, h, part, &mut point);
            this.sign(machine, event, t + part * h, &point).re()
        };
        let (mut a, mut b, mut fb) = (0.0, later, end);
        let mut fa = at(self, a);
        if fa <= 0.0 {
            // A joint that has just begun to slip has no velocity yet, but will have in a moment.
            a = 1e-3 * later;
            fa = at(self, a);
        }
        let mut found = if fa <= 0.0 { Some(0.0) } else { None };
        let mut side = 0;
        for _ in 0..60 {
            if found.is_some() || b - a <= 1e-12 {
                break;
            }
            let mid = (a * fb - b * fa) / (fb - fa);
            let f = at(self, mid);
            if f.abs() < 1e-13 * end.abs() {
                found = Some(mid);
            } else if f < 0.0 {
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
        }
        self.point = point;
        found.unwrap_or(b)
    }

    /// Lets an event happen near `t`; how much later it was.
    pub(super) fn happen(
        &mut self,
        machine: &mut impl Machine<T>,
        event: Event,
        t: f64,
        x: &mut [T],
        h: f64,
    ) -> f64 {
        let zero = T::from(0.0);
        let miss = self.sign(machine, event, t, x);
        let slope = self.slope(machine, event, t, x, h);
        let mut late = if slope != 0.0 && slope.is_finite() { -miss / slope } else { zero };
        if !(late.re().abs() <= 1e-3 * h) {
            late = late.infinitesimal();
        }
        self.nudge(machine, t, x, late);
        match event {
            Event::Stops(c) => {
                x[machine.contacts()[c].velocity] = zero;
                self.modes[c] = self.at_rest(machine, c, t, x);
            }
            Event::Slips(c, forward) => self.modes[c] = if forward { Mode::Forward } else { Mode::Backward },
            Event::Fills(c) => {
                let Ceiling { state, height } = machine.ceilings()[c];
                x[state] = height;
                self.full[c] = true;
            }
            Event::Falls(c) => self.full[c] = false,
            Event::Crosses(e) => {
                self.beyond[e] = !self.beyond[e];
                machine.cross(e, self.beyond[e]);
            }
        }
        self.nudge(machine, t, x, -late.infinitesimal());
        late.re()
    }

    /// How fast the sign of an event changes.
    fn slope(&mut self, machine: &mut impl Machine<T>, event: Event, t: f64, x: &[T], h: f64) -> f64 {
        let mut rates = std::mem::take(&mut self.stage);
        self.derivative(machine, t, x, &mut rates);
        let slope = match event {
            Event::Stops(c) => {
                let rate = rates[machine.contacts()[c].velocity].re();
                if self.modes[c] == Mode::Forward { rate } else { -rate }
            }
            Event::Fills(c) => -rates[machine.ceilings()[c].state].re(),
            Event::Crosses(e) => {
                let rate = rates[machine.edges()[e].state].re();
                if self.beyond[e] { rate } else { -rate }
            }
            Event::Slips(..) | Event::Falls(_) => {
                let d = (1e-4 * h).max(1e-10);
                let mut moved = std::mem::take(&mut self.point);
                let mut at = |this: &mut Self, d: f64| {
                    moved.copy_from_slice(x);
                    moved.iter_mut().zip(&rates).for_each(|(m, r)| m.add_scaled(*r, d));
                    this.sign(machine, event, t + d, &moved).re()
                };
                let slope = (at(self, d) - at(self, -d)) / (2.0 * d);
                self.point = moved;
                slope
            }
        };
        self.stage = rates;
        slope
    }
}
