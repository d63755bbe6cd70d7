//! A causal high-pass, and samples between samples.

use std::f64::consts::PI;

/// Samples on each side that an interpolated one is made of.
const TAPS: isize = 8;

/// Quality factors of a Butterworth filter of fourth order, `1 / (2 cos(pi/8))` and `1 / (2 cos(3 pi/8))`.
const QUALITIES: [f64; 2] = [0.541_196_100_146_197, 1.306_562_964_876_376_5];

/// Fourth-order Butterworth high-pass with its corner at a part of the sample rate, by the bilinear transform.
#[derive(Debug, Clone)]
pub(super) struct HighPass {
    sections: [Section; 2],
    /// The sound was constant before it began.
    begun: bool,
}

#[derive(Debug, Clone, Default)]
struct Section {
    b: f64,
    a: [f64; 2],
    x: [f64; 2],
    y: [f64; 2],
}

impl HighPass {
    pub(super) fn new(corner: f64) -> Self {
        let section = |q: f64| {
            let (sin, cos) = (2.0 * PI * corner).sin_cos();
            let alpha = sin / (2.0 * q);
            let a = [-2.0 * cos / (1.0 + alpha), (1.0 - alpha) / (1.0 + alpha)];
            Section { b: 0.5 * (1.0 + cos) / (1.0 + alpha), a, ..Section::default() }
        };
        Self { sections: QUALITIES.map(section), begun: false }
    }

    /// The filtered sample.
    pub(super) fn step(&mut self, x: f64) -> f64 {
        if !self.begun {
            (self.sections[0].x, self.begun) = ([x; 2], true);
        }
        self.sections.iter_mut().fold(x, |v, s| {
            let out = s.b * (v - 2.0 * s.x[0] + s.x[1]) - s.a[0] * s.y[0] - s.a[1] * s.y[1];
            (s.x, s.y) = ([v, s.x[0]], [out, s.y[0]]);
            out
        })
    }
}

/// A whole sound, filtered.
pub(super) fn high_pass(x: &[f64], corner: f64) -> Vec<f64> {
    let mut filter = HighPass::new(corner);
    x.iter().map(|v| filter.step(*v)).collect()
}

/// The sound at a place between samples, by a sinc under a Hann window; silence beyond its ends.
pub(super) fn at(x: &[f64], place: f64) -> f64 {
    let whole = place.floor();
    let part = place - whole;
    let whole = whole as isize;
    let get = |i: isize| usize::try_from(i).ok().and_then(|i| x.get(i)).copied().unwrap_or(0.0);
    if part < 1e-9 {
        return get(whole);
    }
    // sin(pi (part - k)) is (-1)^k sin(pi part); the window turns by a constant angle from tap to tap.
    let sin = (PI * part).sin() / PI;
    let turn = PI / (TAPS as f64 + 1.0);
    let mut sum = 0.0;
    for k in 1 - TAPS..=TAPS {
        let d = part - k as f64;
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        sum += get(whole + k) * sign * sin / d * (0.5 + 0.5 * (turn * d).cos());
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tones_pass_or_not() {
        let tone =
            |f: f64| -> Vec<f64> { (0..4_000).map(|k| 0.3 + (2.0 * PI * f * f64::from(k)).sin()).collect() };
        let gain = |f: f64| {
            let y = high_pass(&tone(f), 0.03);
            (y[2_000..].iter().map(|v| v * v).sum::<f64>() / 1_000.0).sqrt()
        };
        // |H|^2 = 1 / (1 + (tan(pi c) / tan(pi f))^8)
        for f in [0.01, 0.02, 0.03, 0.05, 0.2] {
            let ratio = (0.03 * PI).tan() / (f * PI).tan();
            approx::assert_relative_eq!(gain(f), (1.0 + ratio.powi(8)).powf(-0.5), max_relative = 0.01);
        }
    }

    #[test]
    fn between_samples_a_tone_goes_on() {
        let tone: Vec<f64> = (0..200).map(|k| (0.9 * f64::from(k)).sin()).collect();
        for place in [50.0, 60.25, 99.5, 120.99] {
            approx::assert_abs_diff_eq!(at(&tone, place), (0.9 * place).sin(), epsilon = 1e-3);
        }
        assert_eq!((at(&tone, -30.5), at(&tone, 1e9)), (0.0, 0.0));
    }
}
