//! How long a ball touches the table, from where the spectrum of its impact falls off.
//!
//! A force that lasts `T` has no power above about `1/T`; Hertz's is nearly half a sine, of which the spectrum is
//! `cos^2(pi f T) / (1 - (2 f T)^2)^2`. For a solid ball `T = 2.87 (m^2 / (R E*^2 v))^(1/5)` (Johnson 1985, *Contact Mechanics*, equation
//! 11.24), so that `T v^(1/5) / R` depends on what it is made of alone: on `(rho / E*)^(2/5)`.

use nalgebra::{Matrix2, Vector2};

/// Contact times that are tried, s.
const TIMES_S: [f64; 2] = [15e-6, 8e-3];
const TRIED: usize = 160;
/// Bins that the spectrum is put into, a factor of frequency each.
const BIN: f64 = 1.122;
/// What losses and echoes leave in the gaps of the spectrum, of its largest.
const LEFT: f64 = 3e-4;
/// What table and ball make of a force: a slope in powers of the frequency, its mean and how far it may be from it.
const SLOPE: [f64; 2] = [0.5, 0.3];
/// Scatter of the logarithm of a bin's power.
const SCATTER: f64 = 1.0;

/// Duration of the contact (s) of an impact whose power spectrum is a list of frequency (Hz, rising) and power (above 0, of any unit):
/// least squares of the logarithms on half a sine's spectrum times a power of the frequency (0.5, to 0.3), 15 us to 8 ms. A ball that rings hides it: what
/// comes out is then nearer the period of the ringing.
///
/// `None` of fewer than eight bins of a sixth of an octave, or of a power that is no number above 0.
pub fn contact_time_s(spectrum: &[[f64; 2]]) -> Option<f64> {
    let good = spectrum.iter().all(|[hz, p]| *hz > 0.0 && *p > 0.0 && p.is_finite());
    (good && bins(spectrum).len() >= 8).then(|| fitted(spectrum))
}

/// The same for a spectrum that is known to be one.
pub(super) fn fitted(spectrum: &[[f64; 2]]) -> f64 {
    let bins = bins(spectrum);
    let [low, high] = TIMES_S.map(f64::ln);
    let step = (high - low) / (TRIED - 1) as f64;
    let costs: Vec<f64> = (0..TRIED).map(|k| cost(&bins, (low + step * k as f64).exp())).collect();
    let best = (0..TRIED).fold(0, |best, k| if costs[k] < costs[best] { k } else { best });
    let mut at = low + step * best as f64;
    if best > 0 && best + 1 < TRIED {
        let (a, b, c) = (costs[best - 1], costs[best], costs[best + 1]);
        let bend = a - 2.0 * b + c;
        if bend > 0.0 {
            at += 0.5 * step * (a - c) / bend;
        }
    }
    at.exp()
}

/// Logarithms of frequency and mean power in bins.
fn bins(spectrum: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut out = Vec::new();
    let mut rest = spectrum;
    while let Some([first, _]) = rest.first() {
        let n = rest.iter().take_while(|[hz, _]| *hz < first * BIN).count().max(1);
        let mean = |axis: usize| rest[..n].iter().map(|p| p[axis]).sum::<f64>() / n as f64;
        out.push([mean(0).ln(), mean(1).ln()]);
        rest = &rest[n..];
    }
    out
}

/// Squares that are left with a duration, the level free and the slope held near its mean.
fn cost(bins: &[[f64; 2]], time_s: f64) -> f64 {
    let mean = bins.iter().map(|b| b[0]).sum::<f64>() / bins.len().max(1) as f64;
    let mut normal = Matrix2::new(1e-9, 0.0, 0.0, (SCATTER / SLOPE[1]).powi(2));
    let (mut right, mut square) = (Vector2::zeros(), 0.0);
    for [ln_hz, ln_power] in bins {
        let y = ln_power - half_sine(ln_hz.exp() * time_s).ln() - SLOPE[0] * (ln_hz - mean);
        let row = Vector2::new(1.0, ln_hz - mean);
        normal += row * row.transpose();
        right += row * y;
        square += y * y;
    }
    let solved = normal.try_inverse().map_or(Vector2::zeros(), |inverse| inverse * right);
    square - solved.dot(&right)
}

/// Power spectrum of half a sine over its largest, at a product of frequency and duration.
fn half_sine(x: f64) -> f64 {
    let below = 1.0 - 4.0 * x * x;
    // At a half the quotient is pi/4.
    let amplitude = if below.abs() < 1e-6 {
        std::f64::consts::FRAC_PI_4
    } else {
        (std::f64::consts::PI * x).cos() / below
    };
    amplitude * amplitude + LEFT / (1.0 + x.powi(4))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    /// Spectra of forces that last, of another shape (a sine to the power 1.5, integrated), on tables that slope as much as is allowed for.
    #[test]
    fn the_duration_of_a_force_is_found_through_a_slope() {
        for time_s in [60e-6, 200e-6, 1e-3, 4e-3] {
            for slope in [-0.1, 0.5, 1.1] {
                let power = |hz: f64| {
                    let (mut re, mut im) = (0.0, 0.0);
                    for k in 0..400 {
                        let t = (f64::from(k) + 0.5) / 400.0;
                        let force = (std::f64::consts::PI * t).sin().powf(1.5);
                        let turn = 2.0 * std::f64::consts::PI * hz * time_s * t;
                        re += force * turn.cos();
                        im += force * turn.sin();
                    }
                    (re * re + im * im) * hz.powf(slope) + 1e-7
                };
                let spectrum: Vec<[f64; 2]> =
                    (6..420).map(|k| 50.0 * f64::from(k)).map(|hz| [hz, power(hz)]).collect();
                let got = contact_time_s(&spectrum).unwrap();
                assert!((got / time_s).ln().abs() < 0.35, "{time_s} s, slope {slope}: {got}");
            }
        }
    }

    #[test]
    fn what_is_no_spectrum_has_no_duration() {
        assert_eq!(contact_time_s(&[]), None);
        assert_eq!(contact_time_s(&[[100.0, 1.0], [200.0, 1.0]]), None);
        let dead: Vec<[f64; 2]> = (1..200).map(|k| [50.0 * f64::from(k), 0.0]).collect();
        assert_eq!(contact_time_s(&dead), None);
    }
}
