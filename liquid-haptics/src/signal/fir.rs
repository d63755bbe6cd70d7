//! Finite impulse responses: a low-pass that thins a stream out, and Gaussian smoothing.

use std::collections::VecDeque;
use std::f64::consts::PI;

use super::SignalError;

/// Half the low-pass's length in units of the factor by which it thins out.
const HALF_LENGTHS: usize = 4;
/// A Gaussian is cut off at this many of its standard deviations (as scipy's gaussian_filter1d does).
const CUT_OFF: f64 = 4.0;

/// Taps of a linear-phase low-pass for thinning by `factor`: Hamming's window on a sinc that cuts off at 80 % of the new Nyquist
/// frequency (Oppenheim and Schafer 2010, section 7.5); their sum is 1.
///
/// # Errors
/// [`SignalError::Range`] for a factor below 1 or above 10,000.
pub fn low_pass(factor: usize) -> Result<Vec<f64>, SignalError> {
    if !(1..=10_000).contains(&factor) {
        return Err(SignalError::Range { name: "factor", got: factor as f64, expected: "1 to 10,000" });
    }
    if factor == 1 {
        return Ok(vec![1.0]);
    }
    let half = (HALF_LENGTHS * factor) as isize;
    let cut = 0.8 / factor as f64;
    let taps: Vec<f64> = (-half..=half)
        .map(|k| {
            let x = PI * k as f64;
            let sinc = if k == 0 { cut } else { (cut * x).sin() / x };
            sinc * (0.54 + 0.46 * (x / half as f64).cos())
        })
        .collect();
    let sum: f64 = taps.iter().sum();
    Ok(taps.into_iter().map(|t| t / sum).collect())
}

/// Six channels with a time, filtered and thinned; each output is that of the middle of its taps, so that nothing is delayed.
#[derive(Debug, Clone, PartialEq)]
pub struct Decimator {
    taps: Vec<f64>,
    factor: usize,
    held: VecDeque<(f64, [f64; 6])>,
    /// How many more readings until the next output.
    wait: usize,
}

impl Decimator {
    /// Thins a stream out by a factor.
    ///
    /// # Errors
    /// As [`low_pass`].
    pub fn new(factor: usize) -> Result<Self, SignalError> {
        let taps = low_pass(factor)?;
        Ok(Self { held: VecDeque::with_capacity(taps.len()), wait: taps.len(), taps, factor })
    }

    /// Takes a reading; gives one for every `factor` once the taps are full.
    pub fn push(&mut self, t_s: f64, channels: [f64; 6]) -> Option<(f64, [f64; 6])> {
        if self.held.len() == self.taps.len() {
            self.held.pop_front();
        }
        self.held.push_back((t_s, channels));
        self.wait -= 1;
        if self.wait > 0 {
            return None;
        }
        self.wait = self.factor;
        let mut sums = [0.0; 6];
        for (tap, (_, values)) in self.taps.iter().zip(&self.held) {
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += tap * value;
            }
        }
        Some((self.held[self.taps.len() / 2].0, sums))
    }
}

/// Gaussian smoothing of six channels with a time; at both ends the Gaussian is cut off and weighs what there is.
#[derive(Debug, Clone, PartialEq)]
pub struct Smoother {
    weights: Vec<f64>,
    held: VecDeque<(f64, [f64; 6])>,
    /// Where in `held` the next output is.
    next: usize,
}

impl Smoother {
    /// Smooths with a standard deviation in readings (0: not at all; [Matl 2021]: 5).
    ///
    /// # Errors
    /// [`SignalError::Range`] for one that is negative, no number, or above 10,000.
    pub fn new(sigma: f64) -> Result<Self, SignalError> {
        if !(0.0..=1e4).contains(&sigma) {
            return Err(SignalError::Range { name: "smoothing", got: sigma, expected: "0 to 10,000" });
        }
        let half = (CUT_OFF * sigma + 0.5) as usize;
        let weight = |k: usize| if sigma > 0.0 { (-0.5 * (k as f64 / sigma).powi(2)).exp() } else { 1.0 };
        Ok(Self {
            weights: (0..=half).map(weight).collect(),
            held: VecDeque::with_capacity(2 * half + 1),
            next: 0,
        })
    }

    /// Takes a reading; gives the one in the middle of the Gaussian once there are enough after it.
    pub fn push(&mut self, t_s: f64, channels: [f64; 6]) -> Option<(f64, [f64; 6])> {
        let half = self.weights.len() - 1;
        if self.held.len() == 2 * half + 1 {
            self.held.pop_front();
            self.next -= 1;
        }
        self.held.push_back((t_s, channels));
        (self.held.len() > self.next + half).then(|| self.give())
    }

    /// Gives the rest after the last reading, one a call, `None` at the end.
    pub fn finish(&mut self) -> Option<(f64, [f64; 6])> {
        if self.next >= self.held.len() {
            return None;
        }
        let half = self.weights.len() - 1;
        if self.next > half {
            self.held.pop_front();
            self.next -= 1;
        }
        Some(self.give())
    }

    fn give(&mut self) -> (f64, [f64; 6]) {
        let (mut sums, mut whole) = ([0.0; 6], 0.0);
        for (k, (_, values)) in self.held.iter().enumerate() {
            let weight = self.weights.get(k.abs_diff(self.next)).copied().unwrap_or(0.0);
            whole += weight;
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += weight * value;
            }
        }
        let t_s = self.held[self.next].0;
        self.next += 1;
        (t_s, sums.map(|s| s / whole))
    }
}
