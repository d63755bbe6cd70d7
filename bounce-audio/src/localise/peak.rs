//! Peaks of a correlation: looked for on a lattice of lags, then climbed.

use rustfft::num_complex::Complex64;
use std::f64::consts::TAU;

/// Lattice points a sample on which the peak is looked for.
pub(super) const OVERSAMPLING: usize = 2;
/// Peaks of the lattice that are refined, if they reach this part of the highest.
const RIVALS: (usize, f64) = (3, 0.7);
/// Newton steps on a peak.
const STEPS: usize = 5;
/// Frequencies that are turned at once: each waits for its own last turn alone.
const LANES: usize = 8;

/// Lags (s) of the highest peaks on the lattice, highest first; a peak on the edge counts.
pub(super) fn candidates(
    lattice: &[Complex64],
    part: usize,
    longest_s: f64,
    rate_hz: f64,
) -> [Option<f64>; RIVALS.0] {
    let n = lattice.len() as isize;
    let step = 1.0 / (rate_hz * OVERSAMPLING as f64);
    let reach = (longest_s / step).ceil() as isize;
    let at = |m: isize| {
        let z = lattice[m.rem_euclid(n) as usize];
        if part == 0 { z.re } else { z.im }
    };
    let mut top: [(f64, Option<f64>); RIVALS.0] = [(f64::NEG_INFINITY, None); RIVALS.0];
    for m in -reach..=reach {
        let here = at(m);
        let peak = (m == -reach || here >= at(m - 1)) && (m == reach || here > at(m + 1));
        if peak && here > top[RIVALS.0 - 1].0 {
            let place = top.iter().position(|t| here > t.0).unwrap_or(RIVALS.0 - 1);
            top[place..].rotate_right(1);
            top[place] = (here, Some(m as f64 * step));
        }
    }
    let enough = RIVALS.1 * top[0].0;
    top.map(|(height, lag)| lag.filter(|_| height >= enough))
}

/// A peak of a correlation.
pub(super) struct Peak {
    pub(super) lag_s: f64,
    pub(super) height: f64,
    /// Minus the second derivative at the peak, 1/s^2.
    pub(super) curvature: f64,
    /// Sum of the squares of the frequencies' parts of the first derivative, 1/s^2.
    pub(super) scatter: f64,
}

impl Peak {
    /// Newton's method from a point of the lattice, on the sum over frequencies.
    pub(super) fn climb(cross: &[Complex64], first: usize, radians: f64, start_s: f64) -> Self {
        let mut peak = Self { lag_s: start_s, height: 0.0, curvature: 0.0, scatter: 0.0 };
        // The lattice's spacing is well below the width of a peak.
        let bound = 0.1 * TAU / (radians * (first + cross.len()) as f64);
        for round in 0..=STEPS {
            let t = peak.lag_s;
            let [height, slope, curvature, scatter] = at_lag(cross, first, radians, t);
            (peak.height, peak.curvature, peak.scatter) = (height, curvature, scatter);
            if round == STEPS || !(curvature > 0.0) {
                break;
            }
            let step = (slope / curvature).clamp(-bound, bound);
            peak.lag_s = t + step;
            // What Newton's next step would add is the square of this.
            if step.abs() < 2e-9 {
                break;
            }
        }
        peak
    }
}

/// A correlation at a lag: its height, slope, minus its second derivative, and the sum of the squares of the slope's parts.
fn at_lag(cross: &[Complex64], first: usize, radians: f64, lag_s: f64) -> [f64; 4] {
    let turn = Complex64::from_polar(1.0, radians * LANES as f64 * lag_s);
    let omega = |k: usize| radians * (first + k) as f64;
    let mut phases: [Complex64; LANES] =
        std::array::from_fn(|lane| Complex64::from_polar(1.0, omega(lane) * lag_s));
    let mut sums = [[0.0; LANES]; 4];
    for (chunk, at) in cross.chunks(LANES).zip((0..).step_by(LANES)) {
        for (lane, (g, phase)) in chunk.iter().zip(&mut phases).enumerate() {
            let omega = omega(at + lane);
            let z = g * *phase;
            *phase *= turn;
            let part = omega * z.im;
            sums[0][lane] += z.re;
            sums[1][lane] -= part;
            sums[2][lane] += omega * omega * z.re;
            sums[3][lane] += part * part;
        }
    }
    sums.map(|lanes| lanes.iter().sum())
}
