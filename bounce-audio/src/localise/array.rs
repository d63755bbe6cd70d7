//! Microphones around a table, and the place on it that fits times of arrival.

use super::location::Location;
use thiserror::Error;

/// Points of the lattice of first guesses along each edge.
const LATTICE: usize = 17;
/// Steps of Gauss-Newton at most.
const ROUNDS: usize = 30;
/// Microphones closer to one line than this part of their spread do not tell its two sides apart.
const LEAST_WIDTH: f64 = 0.02;

/// Why microphones do not determine a place.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ArrayError {
    /// Fewer microphones than a place on a plane needs.
    #[error("{got} microphones, expected at least {expected}: fewer do not determine a place on the table")]
    TooFew {
        /// Least number.
        expected: usize,
        /// Number stated.
        got: usize,
    },
    /// Seen from above all microphones are on a line, or at a point: places on both sides of it sound alike.
    #[error(
        "the microphones are within {got_m} m of a line, expected more than {expected_m} m: both its sides sound alike"
    )]
    OnALine {
        /// Least distance, m (root mean square).
        expected_m: f64,
        /// Distance found, m (root mean square).
        got_m: f64,
    },
    /// A position or the speed of sound is no number, or the speed not above zero.
    #[error("{what} is {got}, expected {expected}")]
    Value {
        /// The quantity.
        what: &'static str,
        /// What is taken.
        expected: &'static str,
        /// The value stated.
        got: f64,
    },
}

/// Microphones in the table's frame, z = 0 at its top, and the speed of sound.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    microphones_m: Vec<[f64; 3]>,
    speed_of_sound_m_s: f64,
    low: [f64; 2],
    high: [f64; 2],
}

/// What a fit of a place came to.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fit {
    pub(crate) x_m: f64,
    pub(crate) y_m: f64,
    /// Covariance of the place over the variance of an arrival, m^2/s^2.
    pub(crate) cofactor: [[f64; 2]; 2],
    /// Sum of the squares of what is left of the arrivals, s^2.
    pub(crate) sum_squares: f64,
}

impl Array {
    /// Three or more microphones (m) that are not on one line seen from above, and the speed of sound (m/s).
    pub fn new(microphones_m: &[[f64; 3]], speed_of_sound_m_s: f64) -> Result<Self, ArrayError> {
        let got = microphones_m.len();
        if got < 3 {
            return Err(ArrayError::TooFew { expected: 3, got });
        }
        if let Some(&got) = microphones_m.iter().flatten().find(|v| !v.is_finite()) {
            return Err(ArrayError::Value {
                what: "a microphone's position",
                expected: "a finite number",
                got,
            });
        }
        if !(speed_of_sound_m_s > 0.0 && speed_of_sound_m_s.is_finite()) {
            let expected = "a finite number above 0";
            return Err(ArrayError::Value { what: "the speed of sound", expected, got: speed_of_sound_m_s });
        }
        let n = got as f64;
        let mean = [0, 1].map(|k| microphones_m.iter().map(|m| m[k]).sum::<f64>() / n);
        let moment = |a: usize, b: usize| {
            microphones_m.iter().map(|m| (m[a] - mean[a]) * (m[b] - mean[b])).sum::<f64>() / n
        };
        let (xx, yy, xy) = (moment(0, 0), moment(1, 1), moment(0, 1));
        let root = (0.25 * (xx - yy).powi(2) + xy * xy).sqrt();
        let (long, wide) = (0.5 * (xx + yy) + root, (0.5 * (xx + yy) - root).max(0.0));
        let (expected_m, got_m) = (LEAST_WIDTH * long.sqrt(), wide.sqrt());
        if !(got_m > expected_m) {
            return Err(ArrayError::OnALine { expected_m, got_m });
        }
        let edge = |k: usize, pick: fn(f64, f64) -> f64, from: f64| {
            microphones_m.iter().map(|m| m[k]).fold(from, pick)
        };
        Ok(Self {
            microphones_m: microphones_m.to_vec(),
            speed_of_sound_m_s,
            low: [0, 1].map(|k| edge(k, f64::min, f64::INFINITY)),
            high: [0, 1].map(|k| edge(k, f64::max, f64::NEG_INFINITY)),
        })
    }

    /// The microphones' positions, m.
    pub fn microphones_m(&self) -> &[[f64; 3]] {
        &self.microphones_m
    }

    /// The speed of sound, m/s.
    pub fn speed_of_sound_m_s(&self) -> f64 {
        self.speed_of_sound_m_s
    }

    /// How long sound takes from a place on the table (m) to microphone `i`, s.
    pub fn travel_s(&self, i: usize, x_m: f64, y_m: f64) -> f64 {
        let [mx, my, mz] = self.microphones_m[i];
        ((mx - x_m).powi(2) + (my - y_m).powi(2) + mz * mz).sqrt() / self.speed_of_sound_m_s
    }

    /// How far outside the rectangle around the microphones a place is, m; 0 inside it.
    pub fn outside_m(&self, x_m: f64, y_m: f64) -> f64 {
        let out = |k: usize, v: f64| (self.low[k] - v).max(v - self.high[k]).max(0.0);
        out(0, x_m).hypot(out(1, y_m))
    }

    /// Diagonal of the rectangle around the microphones, m.
    pub fn diagonal_m(&self) -> f64 {
        (self.high[0] - self.low[0]).hypot(self.high[1] - self.low[1])
    }

    /// How long sound takes from one microphone to another, s.
    pub(crate) fn lag_s(&self, i: usize, j: usize) -> f64 {
        let (a, b) = (self.microphones_m[i], self.microphones_m[j]);
        (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt() / self.speed_of_sound_m_s
    }

    pub(crate) fn longest_lag_s(&self) -> f64 {
        let n = self.microphones_m.len();
        (0..n).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| self.lag_s(i, j)).fold(0.0, f64::max)
    }

    /// The place that fits arrivals (s, one a microphone) best, with what is known of how they were measured.
    pub(crate) fn location(
        &self,
        arrivals_s: &[f64],
        arrival_sigma_s: f64,
        closure_s: f64,
        coherence: f64,
    ) -> Location {
        let place = self.solve(arrivals_s);
        let dof = arrivals_s.len().saturating_sub(3);
        let variance = arrival_sigma_s * arrival_sigma_s;
        Location {
            x_m: place.x_m,
            y_m: place.y_m,
            covariance_m2: place.cofactor.map(|row| row.map(|c| c * variance)),
            arrival_sigma_s,
            residual_s: (dof > 0).then(|| (place.sum_squares / dof as f64).sqrt()),
            closure_s,
            coherence,
        }
    }

    /// The place on the table that fits arrivals (s, one a microphone, any common offset) best, by Gauss-Newton.
    ///
    /// Where two places fit alike, the one within the microphones' rectangle is taken.
    pub(crate) fn solve(&self, arrivals_s: &[f64]) -> Fit {
        let within = self.descend(arrivals_s, self.guess(arrivals_s, 0.0));
        let diagonal = self.diagonal_m();
        // A thousandth of the way across is far above what noise leaves of a good fit.
        let good = (1e-3 * diagonal / self.speed_of_sound_m_s).powi(2);
        if within.sum_squares < good && self.outside_m(within.x_m, within.y_m) < 0.02 * diagonal {
            return within;
        }
        let around = self.descend(arrivals_s, self.guess(arrivals_s, 1.0));
        if around.sum_squares < within.sum_squares - 1e-6 * good { around } else { within }
    }

    /// A point of the microphones' rectangle, widened by a length on all sides: parts of its edges.
    pub(super) fn widened_m(&self, by_m: f64, parts: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|k| self.low[k] - by_m + parts[k] * (self.high[k] - self.low[k] + 2.0 * by_m))
    }

    /// The lattice's best point, over the microphones' rectangle widened on all sides by a part of its diagonal.
    fn guess(&self, arrivals_s: &[f64], widened: f64) -> [f64; 2] {
        let by = widened * self.diagonal_m();
        let part = |i: usize| i as f64 / (LATTICE - 1) as f64;
        let mut best = (f64::INFINITY, [0.0; 2]);
        for i in 0..LATTICE {
            for j in 0..LATTICE {
                let place = self.widened_m(by, [part(i), part(j)]);
                let left = self.cost(arrivals_s, place);
                if left < best.0 {
                    best = (left, place);
                }
            }
        }
        best.1
    }

    pub(super) fn cost(&self, arrivals_s: &[f64], [x, y]: [f64; 2]) -> f64 {
        let n = arrivals_s.len() as f64;
        let (mut sum, mut squares) = (0.0, 0.0);
        for (i, t) in arrivals_s.iter().enumerate() {
            let r = t - self.travel_s(i, x, y);
            sum += r;
            squares += r * r;
        }
        (squares - sum * sum / n).max(0.0)
    }

    /// Normal matrix (xx, xy, yy) and gradient of the arrivals' fit, the time of the impact eliminated.
    fn normal(&self, arrivals_s: &[f64], [x, y]: [f64; 2]) -> ([f64; 3], [f64; 2]) {
        let n = arrivals_s.len() as f64;
        let (mut a, mut b, mut sums) = ([0.0; 3], [0.0; 2], [0.0; 3]);
        for (i, t) in arrivals_s.iter().enumerate() {
            let travel = self.travel_s(i, x, y);
            let scale = 1.0 / (self.speed_of_sound_m_s.powi(2) * travel.max(1e-9));
            let [mx, my, _] = self.microphones_m[i];
            let (jx, jy, r) = ((x - mx) * scale, (y - my) * scale, t - travel);
            for (s, v) in a.iter_mut().zip([jx * jx, jx * jy, jy * jy]) {
                *s += v;
            }
            for (s, v) in b.iter_mut().zip([jx * r, jy * r]) {
                *s += v;
            }
            for (s, v) in sums.iter_mut().zip([jx, jy, r]) {
                *s += v;
            }
        }
        let [sx, sy, sr] = sums;
        (
            [a[0] - sx * sx / n, a[1] - sx * sy / n, a[2] - sy * sy / n],
            [b[0] - sx * sr / n, b[1] - sy * sr / n],
        )
    }

    pub(super) fn descend(&self, arrivals_s: &[f64], start: [f64; 2]) -> Fit {
        let mut place = start;
        let mut cost = self.cost(arrivals_s, place);
        let mut damping = 1e-6;
        for _ in 0..ROUNDS {
            let ([xx, xy, yy], [bx, by]) = self.normal(arrivals_s, place);
            let (dxx, dyy) = (xx * (1.0 + damping), yy * (1.0 + damping));
            let det = dxx * dyy - xy * xy;
            let step = [(dyy * bx - xy * by) / det, (dxx * by - xy * bx) / det];
            let next = [place[0] + step[0], place[1] + step[1]];
            let then = self.cost(arrivals_s, next);
            let length = step[0].hypot(step[1]);
            if then <= cost {
                (place, cost, damping) = (next, then, 0.1 * damping);
                if length < 1e-9 {
                    break;
                }
            } else if length < 1e-9 || damping > 1e9 {
                break;
            } else {
                damping = (10.0 * damping).max(1e-3);
            }
        }
        let ([xx, xy, yy], _) = self.normal(arrivals_s, place);
        let det = xx * yy - xy * xy;
        let cofactor = [[yy / det, -xy / det], [-xy / det, xx / det]];
        Fit { x_m: place[0], y_m: place[1], cofactor, sum_squares: cost }
    }
}
