//! The standard linear solid along a history, one pass.

use super::{Contact, HistoryError, LinearSolid, Relaxation, check_history};
use crate::Number;
use crate::law::{Law, polish};
use crate::number::first_order;

/// `exp(-x)`, zero with its derivative where it vanishes.
pub(super) fn decay<T: Number>(x: T) -> T {
    if x.re() > 700.0 { T::from(0.0) } else { (-x).exp() }
}

/// One over (k + 1)!.
const FACTORIALS: [f64; 15] = {
    let (mut out, mut value, mut k) = ([0.0; 15], 1.0, 0);
    while k < 15 {
        value /= (k + 1) as f64;
        out[k] = value;
        k += 1;
    }
    out
};

/// `int_0^1 exp(-x (1 - u)) du` and the same of `u exp(-x (1 - u))`.
pub(super) fn moments<T: Number>(x: T) -> (T, T) {
    let (first, second) = moments_by_definition(x.re());
    // The first one's slope is the second less the first.
    let of_first = first_order(x, |_| (first, second - first));
    let of_second = first_order(x, |x| (second, second_slope(x, first, second)));
    of_first.zip(of_second).unwrap_or_else(|| moments_by_definition(x))
}

/// Slope of the second of [`moments`]: `-int u (1 - u) exp(-x (1 - u)) du`.
fn second_slope(x: f64, first: f64, second: f64) -> f64 {
    if x < 0.3 {
        let terms = terms(x);
        // Sums of (-x)^k (k + 1)/(k + 3)!
        -(0..terms).rev().fold(0.0, |sum, k| (k + 1) as f64 * FACTORIALS[k + 2] - x * sum)
    } else {
        (first - 2.0 * second) / x
    }
}

/// Terms of the series that are needed for the last digit.
fn terms(x: f64) -> usize {
    if x < 1e-5 {
        4
    } else if x < 1e-2 {
        7
    } else {
        FACTORIALS.len() - 2
    }
}

fn moments_by_definition<T: Number>(x: T) -> (T, T) {
    if x.re() < 0.3 {
        // Sums of (-x)^k / (k + 1)! and (-x)^k / (k + 2)!, to the last digit.
        let (mut first, mut second) = (T::from(0.0), T::from(0.0));
        for k in (0..terms(x.re())).rev() {
            first = T::from(FACTORIALS[k]) - x * first;
            second = T::from(FACTORIALS[k + 1]) - x * second;
        }
        (first, second)
    } else {
        let first = (T::from(1.0) - decay(x)) / x;
        (first, (T::from(1.0) - first) / x)
    }
}

/// Where the indenter was, and what the body remembers of its way there.
#[derive(Debug, Clone, Copy)]
struct Place<T> {
    time_s: T,
    depth_m: T,
    /// `int exp(-(t - s)/tau) d delta(s)`.
    depth_memory: T,
}

/// A part of a straight line in time.
struct Step<T> {
    way_m: T,
    /// What is left of an older memory at its end.
    left: T,
    /// [`moments`] over it.
    moments: (T, T),
}

/// A place with its elastic force and the memory of that.
#[derive(Debug, Clone, Copy)]
struct Point<T> {
    place: Place<T>,
    force_n: T,
    force_memory: T,
}

/// Room for a history, to be used again.
#[derive(Debug, Clone)]
pub struct Scratch<T> {
    grown: Vec<Point<T>>,
}

impl<T> Scratch<T> {
    /// Empty; it grows to the longest history.
    pub const fn new() -> Self {
        Self { grown: Vec::new() }
    }
}

impl<T> Default for Scratch<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Number> Place<T> {
    fn re(&self) -> Place<f64> {
        Place { time_s: self.time_s.re(), depth_m: self.depth_m.re(), depth_memory: self.depth_memory.re() }
    }

    /// On along a straight line in time to a later time and depth; times may be equal: a jump.
    fn to(&self, tau_s: T, end: (T, T)) -> (Self, Step<T>) {
        self.by(tau_s, end.0 - self.time_s, end.1 - self.depth_m)
    }

    /// The same a part (0 to 1) of the way.
    fn along(&self, tau_s: T, end: (T, T), part: T) -> (Self, Step<T>) {
        self.by(tau_s, (end.0 - self.time_s) * part, (end.1 - self.depth_m) * part)
    }

    fn by(&self, tau_s: T, lasts: T, way_m: T) -> (Self, Step<T>) {
        let x = lasts / tau_s;
        let step = Step { way_m, left: decay(x), moments: moments(x) };
        let place = Self {
            time_s: self.time_s + lasts,
            depth_m: self.depth_m + way_m,
            depth_memory: step.left * self.depth_memory + way_m * step.moments.0,
        };
        (place, step)
    }
}

impl<T: Number> Point<T> {
    /// On to a place, with the elastic force as a parabola in time, which the exponential is integrated against exactly.
    fn with<L: Law<T>>(&self, law: &L, (place, step): (Place<T>, Step<T>)) -> Self {
        let Step { way_m, left, moments: (first, second) } = step;
        let force_n = law.force(place.depth_m);
        let middle = law.force(self.place.depth_m + way_m * 0.5);
        // Slopes 4 m - 3 f_0 - f_1 at the start and f_0 - 4 m + 3 f_1 at the end, times (first - second) and second.
        let (start, middle_weight, end) =
            (second * 4.0 - first * 3.0, first * 4.0 - second * 8.0, second * 4.0 - first);
        let force_memory =
            left * self.force_memory + self.force_n * start + middle * middle_weight + force_n * end;
        Self { place, force_n, force_memory }
    }
}

impl<T: Number> LinearSolid<T> {
    /// Forces in N along a history of times (s, not falling; equal ones are a jump) and indentations (m), in O(n).
    ///
    /// `law` is the instantaneous one. Between samples the indentation is a straight line in time and the elastic force a
    /// parabola; a first sample that is already in contact counts as a jump at that time.
    ///
    /// # Errors
    /// [`HistoryError`].
    pub fn forces<L: Law<T>>(
        &self,
        law: &L,
        contact: Contact,
        times_s: &[f64],
        indentations_m: &[T],
        scratch: &mut Scratch<T>,
        forces_n: &mut [T],
    ) -> Result<(), HistoryError> {
        Relaxation::<T>::check(self)?;
        check_history(times_s, indentations_m, forces_n.len())?;
        let zero = T::from(0.0);
        let real = self.re();
        let grown = &mut scratch.grown;
        grown.clear();
        // The state now, and where on the way of growth the contact's radius was last seen.
        let mut now: Option<Point<T>> = None;
        let mut before: Option<(f64, T)> = None;
        let mut at = 0;
        for ((&time, &depth), out) in times_s.iter().zip(indentations_m).zip(forces_n.iter_mut()) {
            let start = match now {
                Some(point) => point,
                None if depth.re() > 0.0 => {
                    // Contact begins where the line from the sample before crosses zero.
                    let time_s = match before {
                        Some((t, d)) => T::from(t) + (d / (d - depth)) * (time - t),
                        None => T::from(time),
                    };
                    let place = Place { time_s, depth_m: zero, depth_memory: zero };
                    let touch = Point { place, force_n: zero, force_memory: zero };
                    grown.push(touch);
                    touch
                }
                None => {
                    before = Some((time, depth));
                    *out = zero;
                    continue;
                }
            };
            let point = start.with(law, start.place.to(self.tau_s, (T::from(time), depth)));
            now = Some(point);
            *out = match contact {
                Contact::Fixed => self.here(&point),
                Contact::Shrinks => {
                    let last = grown.len() - 1;
                    if real.moved(&grown[last].place.re(), &point.place.re()) >= 0.0 {
                        grown.push(point);
                        at = last + 1;
                        self.here(&point)
                    } else {
                        self.shrunk(law, grown, &mut at, &point)
                    }
                }
            };
            if contact == Contact::Fixed && out.re() < 0.0 {
                *out = zero;
            }
        }
        Ok(())
    }

    fn re(&self) -> LinearSolid<f64> {
        LinearSolid { relaxed_fraction: self.relaxed_fraction.re(), tau_s: self.tau_s.re() }
    }

    /// `int psi(t - s) d f` up to now.
    fn here(&self, now: &Point<T>) -> T {
        now.force_n - self.relaxed_fraction * (now.force_n - now.force_memory)
    }

    /// `int psi(t - s) d f` up to `then`, seen from `now`.
    fn sum(&self, then: &Point<T>, now: &Point<T>) -> T {
        let left = decay((now.place.time_s - then.place.time_s) / self.tau_s);
        (T::from(1.0) - self.relaxed_fraction) * then.force_n
            + self.relaxed_fraction * left * then.force_memory
    }

    /// `int psi(t - s) d delta` from `then` to `now`: zero where the contact's radius is the same.
    fn moved(&self, then: &Place<T>, now: &Place<T>) -> T {
        let left = decay((now.time_s - then.time_s) / self.tau_s);
        (T::from(1.0) - self.relaxed_fraction) * (now.depth_m - then.depth_m)
            + self.relaxed_fraction * (now.depth_memory - left * then.depth_memory)
    }

    /// Minus [`Self::moved`] to `now` from a part of the way to `end`, and its slope: both rise.
    fn part(&self, from: &Place<T>, end: (T, T), part: T, now: &Place<T>) -> (T, T) {
        let (place, _) = from.along(self.tau_s, end, part);
        let slope = self.remaining(now.time_s - place.time_s) * (end.1 - from.depth_m);
        (-self.moved(&place, now), slope)
    }

    /// The force while the contact is smaller than it was; `at` is the last index at which it was not larger.
    fn shrunk<L: Law<T>>(&self, law: &L, grown: &[Point<T>], at: &mut usize, now: &Point<T>) -> T {
        let real = self.re();
        let smaller = |i: usize| real.moved(&grown[i].place.re(), &now.place.re()) >= 0.0;
        *at = (*at).min(grown.len() - 1);
        while *at + 1 < grown.len() && smaller(*at + 1) {
            *at += 1;
        }
        while !smaller(*at) {
            if *at == 0 {
                return T::from(0.0);
            }
            *at -= 1;
        }
        let from = &grown[*at];
        let Some(next) = grown.get(*at + 1).map(|p| &p.place) else {
            return self.sum(from, now);
        };
        let end = (next.time_s, next.depth_m);
        // The root is looked for in real numbers; only its last step carries derivatives.
        let root = real.parted(&from.place.re(), &next.re(), &now.place.re());
        let part = polish(T::from(root), |part| self.part(&from.place, end, part, &now.place));
        self.sum(&from.with(law, from.place.along(self.tau_s, end, part)), now)
    }
}

impl LinearSolid<f64> {
    /// The part of the way between two places at which the contact was as large as it is now.
    fn parted(&self, from: &Place<f64>, next: &Place<f64>, now: &Place<f64>) -> f64 {
        let end = (next.time_s, next.depth_m);
        // Nearly a straight line: the chord's root is a good start.
        let (first, last) = (self.moved(from, now), self.moved(next, now));
        let start = first / (first - last);
        crate::root::rising(|part| self.part(from, end, part, now), 0.0, 1.0, start)
    }
}
