//! Inputs: what is known at some times, what it is between them, and what a drive does to it.

use crate::Number;

/// What an input is between the times at which it is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Between {
    /// The last known value.
    Hold,
    /// A straight line to the next.
    Linear,
}

/// What a drive does to its command, in this order: dead zone, saturation, gain, offset, play, delay, lag.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive<T> {
    /// Half of the range of commands that do nothing; taken off all others. At least 0.
    pub dead_zone: T,
    /// The largest command that is passed on.
    pub upper: T,
    /// The smallest command that is passed on.
    pub lower: T,
    /// Relative departure of the gain from 1.
    pub gain: T,
    /// Added to the command.
    pub offset: T,
    /// Play between the command of a position and what follows it, from end to end, and where the follower stands at first.
    pub play: Option<(T, T)>,
    /// Delay, s, at least 0.
    pub delay_s: T,
    /// Time constant of a first-order lag, s, at least 0; `None` without one.
    pub lag_s: Option<T>,
}

impl<T: Number> Drive<T> {
    /// A drive that passes every command on at once.
    pub fn perfect() -> Self {
        let zero = T::from(0.0);
        let (upper, lower) = (T::from(f64::INFINITY), T::from(f64::NEG_INFINITY));
        Self {
            dead_zone: zero,
            upper,
            lower,
            gain: zero,
            offset: zero,
            play: None,
            delay_s: zero,
            lag_s: None,
        }
    }
}

/// A stretch of a signal: `value + slope s + transient exp(-s / lag)`, `s` the time since it began.
#[derive(Debug, Clone, Copy)]
struct Piece<T> {
    begins: T,
    value: T,
    slope: T,
    transient: T,
}

/// An input as the machine feels it: pieces with a closed form.
#[derive(Debug, Clone)]
pub struct Signal<T> {
    pieces: Vec<Piece<T>>,
    lag_s: Option<T>,
    /// Whether every piece is one value.
    flat: bool,
}

impl<T: Number> Signal<T> {
    /// The signal that a drive makes of commands known at rising times.
    ///
    /// A lag shorter than `shortest_s` is a delay of the same length: the two differ by less than an integration resolves. Before the
    /// first time the first value holds.
    pub fn new(times: &[f64], commands: &[f64], between: Between, drive: &Drive<T>, shortest_s: f64) -> Self {
        // A command that only says what was said before begins nothing.
        let says = |k: usize| {
            let before = |k: usize| commands[k] == commands[k - 1];
            let still = between == Between::Hold || k + 1 == commands.len() || before(k + 1);
            k == 0 || !before(k) || !still
        };
        let mut knots: Vec<(T, T)> = (0..times.len().min(commands.len()))
            .filter(|k| says(*k))
            .map(|k| (T::from(times[k]), T::from(commands[k])))
            .collect();
        let w = drive.dead_zone;
        if between == Between::Linear {
            for kink in [w, -w, drive.upper, drive.lower] {
                split(&mut knots, kink);
            }
        }
        for (_, u) in &mut knots {
            let inner = u.within(drive.lower, drive.upper);
            let live = if inner.re() > w.re() {
                inner - w
            } else if inner.re() < -w.re() {
                inner + w
            } else {
                T::from(0.0)
            };
            *u = live * (drive.gain + 1.0) + drive.offset;
        }
        if let Some((gap, mut follower)) = drive.play {
            for (_, u) in &mut knots {
                follower = follower.within(*u - gap * 0.5, *u + gap * 0.5);
                *u = follower;
            }
        }
        let short = drive.lag_s.filter(|lag| lag.re() < shortest_s);
        let lag_s = if short.is_some() { None } else { drive.lag_s };
        let delay = drive.delay_s + short.unwrap_or(T::from(0.0));
        let flat = between == Between::Hold && lag_s.is_none();
        Self { pieces: pieces(&knots, between, delay, lag_s), lag_s, flat }
    }

    /// When the signal's pieces begin, rising.
    pub fn begins(&self) -> impl Iterator<Item = T> + '_ {
        self.pieces.iter().map(|p| p.begins)
    }

    /// Number of pieces.
    pub fn len(&self) -> usize {
        self.pieces.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// Whether every piece is one value.
    pub fn is_flat(&self) -> bool {
        self.flat
    }

    /// The value at a time, by the piece of a number: 0 before the first begins, `k` after the `k`-th has begun.
    #[inline(always)]
    pub fn value(&self, piece: usize, t: f64) -> T {
        let Some(p) = self.pieces.get(piece.saturating_sub(1)) else { return T::from(0.0) };
        if self.flat {
            return p.value;
        }
        if piece == 0 {
            return p.value + p.transient;
        }
        let since = -(p.begins - t);
        let straight = p.value + p.slope * since;
        match self.lag_s {
            Some(lag) => straight + p.transient * (-since / lag).exp(),
            None => straight,
        }
    }
}

/// A line that crosses a value nearer to one of its ends than this part of it, in time, does so at the end.
const AT_AN_END: f64 = 1e-9;

/// Puts a knot wherever the line between two knots crosses a value.
fn split<T: Number>(knots: &mut Vec<(T, T)>, at: T) {
    if !at.re().is_finite() {
        return;
    }
    let mut all = Vec::with_capacity(knots.len());
    for pair in knots.windows(2) {
        let ((t0, u0), (t1, u1)) = (pair[0], pair[1]);
        all.push(pair[0]);
        let (above, below) = (u0.re() - at.re(), u1.re() - at.re());
        let nearest = above.abs().min(below.abs());
        if above * below < 0.0 && nearest > AT_AN_END * (above - below).abs() {
            all.push((t0 + (t1 - t0) * (at - u0) / (u1 - u0), at));
        }
    }
    all.extend(knots.last().copied());
    *knots = all;
}

fn pieces<T: Number>(knots: &[(T, T)], between: Between, delay: T, lag_s: Option<T>) -> Vec<Piece<T>> {
    let zero = T::from(0.0);
    let mut output = None;
    let mut pieces = Vec::with_capacity(knots.len());
    for (k, &(t, value)) in knots.iter().enumerate() {
        let next = knots.get(k + 1);
        let slope = match (between, next) {
            (Between::Linear, Some(&(t1, u1))) => (u1 - value) / (t1 - t),
            _ => zero,
        };
        let begins = t + delay;
        let Some(lag) = lag_s else {
            pieces.push(Piece { begins, value, slope, transient: zero });
            continue;
        };
        // The steady answer to a line lags behind it by the slope times the lag.
        let steady = value - lag * slope;
        let transient = output.unwrap_or(value) - steady;
        pieces.push(Piece { begins, value: steady, slope, transient });
        if let Some(&(t1, _)) = next {
            let dt = t1 - t;
            output = Some(steady + slope * dt + transient * (-dt / lag).exp());
        }
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn at(signal: &Signal<f64>, t: f64) -> f64 {
        signal.value(signal.begins().filter(|b| *b <= t).count(), t)
    }

    #[test]
    fn a_held_step_is_delayed_and_lags() {
        let drive = Drive { delay_s: 0.5, lag_s: Some(0.2), ..Drive::perfect() };
        let signal = Signal::new(&[0.0, 1.0, 2.0], &[1.0, 3.0, 3.0], Between::Hold, &drive, 0.01);
        assert_relative_eq!(at(&signal, 0.2), 1.0);
        assert_relative_eq!(at(&signal, 1.4), 1.0);
        assert_relative_eq!(at(&signal, 1.9), 3.0 - 2.0 * (-2.0_f64).exp(), epsilon = 1e-12);
        assert_relative_eq!(at(&signal, 2.9), 3.0 - 2.0 * (-7.0_f64).exp(), epsilon = 1e-12);
    }

    #[test]
    fn a_ramp_has_its_kinks_where_it_meets_the_bounds() {
        let drive = Drive { dead_zone: 1.0, upper: 3.0, ..Drive::perfect() };
        let signal = Signal::new(&[0.0, 4.0], &[0.0, 4.0], Between::Linear, &drive, 0.01);
        for (t, expected) in [(0.5, 0.0), (1.0, 0.0), (2.0, 1.0), (3.0, 2.0), (3.5, 2.0)] {
            assert_relative_eq!(at(&signal, t), expected, epsilon = 1e-12);
        }
    }

    /// Commands that are zero but for rounding, as of a sine at pi, cross zero where they stand.
    #[test]
    fn a_command_of_nearly_zero_is_no_knot_beside_another() {
        let signal = Signal::new(
            &[2.98, 3.0, 3.02],
            &[0.1, 3.67394e-16, -0.1],
            Between::Linear,
            &Drive::perfect(),
            0.01,
        );
        for (t, expected) in [(2.99, 0.05), (3.0, 0.0), (3.005, -0.025), (3.01, -0.05)] {
            assert_relative_eq!(at(&signal, t), expected, epsilon = 1e-12);
        }
    }

    #[test]
    fn play_follows_at_half_the_gap() {
        let drive = Drive { play: Some((0.4, 0.0)), ..Drive::perfect() };
        let times: Vec<f64> = (0..5).map(f64::from).collect();
        let signal = Signal::new(&times, &[0.0, 1.0, 0.9, 0.5, 0.6], Between::Hold, &drive, 0.1);
        let followed: Vec<f64> = times.iter().map(|t| at(&signal, *t)).collect();
        for (f, e) in followed.iter().zip([0.0, 0.8, 0.8, 0.7, 0.7]) {
            assert_relative_eq!(*f, e, epsilon = 1e-12);
        }
    }
}
