//! Frequency and damping of a mode that decays, from all readings at once.

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::least_squares::{Fit, covariance, least_squares};
use super::{ViscosityError, checked, normal_quantile};

/// Damping ratios that the search starts from.
const DAMPING_STARTS: [f64; 8] = [0.001, 0.004, 0.012, 0.03, 0.07, 0.15, 0.3, 0.6];
/// Spacing of the frequencies that the search starts from, as a share of what a record of this length resolves.
const RESOLUTION_SHARE: f64 = 0.35;
/// Most frequencies that the search starts from.
const MOST_FREQUENCIES: usize = 400;
/// Starts from which the fit is carried through.
const FOLLOWED: usize = 3;

/// A mode `offset + exp(-gamma omega t) (cos cos(omega_d t) + sin sin(omega_d t))` fitted to readings, t from the first of them.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeFit {
    /// Angular frequency without damping, rad/s.
    pub omega_rad_s: f64,
    /// Standard error of the angular frequency, rad/s.
    pub omega_error_rad_s: f64,
    /// Damping ratio gamma, above 0, below 1.
    pub damping_ratio: f64,
    /// Standard error of the damping ratio's logarithm.
    pub ln_damping_error: f64,
    /// The reading that the mode decays to.
    pub offset: f64,
    /// Amplitude of the cosine, in units of the reading.
    pub cos: f64,
    /// Amplitude of the sine, in units of the reading.
    pub sin: f64,
    /// Standard error of the amplitude, in units of the reading.
    pub amplitude_error: f64,
    /// Standard deviation of the residuals, in units of the reading.
    pub sigma: f64,
}

impl ModeFit {
    /// Logarithmic decrement: the logarithm of a peak over the one a cycle later ([Matl 2021], eq. 2.3 corrected).
    pub fn logarithmic_decrement(&self) -> f64 {
        TAU * self.damping_ratio / (1.0 - self.damping_ratio * self.damping_ratio).sqrt()
    }

    /// The 95 % interval of the damping ratio, symmetric in its logarithm.
    pub fn damping_interval(&self) -> [f64; 2] {
        let reach = (normal_quantile() * self.ln_damping_error).exp();
        [self.damping_ratio / reach, self.damping_ratio * reach]
    }

    /// Amplitude at the first reading, in units of the reading.
    pub fn amplitude(&self) -> f64 {
        self.cos.hypot(self.sin)
    }

    /// The mode's reading a time (s) after the first reading.
    pub fn at(&self, t_s: f64) -> f64 {
        let (shape, _, _) = shape(self.omega_rad_s, self.damping_ratio, t_s);
        self.offset + self.cos * shape[0] + self.sin * shape[1]
    }
}

/// `exp(-alpha t)` times cosine and sine, the damped frequency, and the share `sqrt(1 - gamma^2)`.
fn shape(omega: f64, gamma: f64, t: f64) -> ([f64; 2], f64, f64) {
    let root = (1.0 - gamma * gamma).max(0.0).sqrt();
    let (sin, cos) = (omega * root * t).sin_cos();
    let fade = (-gamma * omega * t).exp();
    ([fade * cos, fade * sin], omega * root, root)
}

/// Fits a mode whose frequency lies in a band (rad/s) by least squares over all readings; not from picked peaks.
///
/// Times rise; units of the reading are free. The errors are those of noise that may be coloured.
///
/// # Errors
/// [`ViscosityError::Reading`], [`ViscosityError::Lengths`], [`ViscosityError::TooFew`], [`ViscosityError::Range`] for a band that
/// is none, [`ViscosityError::NoFit`] where nothing oscillates in the band.
pub fn fit_mode(t_s: &[f64], reading: &[f64], band_rad_s: [f64; 2]) -> Result<ModeFit, ViscosityError> {
    checked(t_s, reading, 8)?;
    let [low, high] = band_rad_s;
    if !(low > 0.0 && high > low && high.is_finite()) {
        return Err(ViscosityError::Range { name: "band_rad_s", got: low, expected: "0 < low < high" });
    }
    let begin = t_s[0];
    let t: Vec<f64> = t_s.iter().map(|t| t - begin).collect();
    let mut best: Option<Fit> = None;
    for (omega, gamma) in starts(&t, reading, low, high) {
        let Some((_, linear)) = project(&t, reading, omega, gamma) else { continue };
        let start = DVector::from_vec(vec![omega, logit(gamma), linear[0], linear[1], linear[2]]);
        let Some(fit) = least_squares(reading, start, |p, f, j| model(&t, p, f, j)) else { continue };
        let inside = (low..=high).contains(&fit.params[0]);
        if inside && best.as_ref().is_none_or(|b| fit.squares() < b.squares()) {
            best = Some(fit);
        }
    }
    let none = ViscosityError::NoFit { what: "mode in the band" };
    let fit = best.ok_or_else(|| none.clone())?;
    let covariance = covariance(&fit).ok_or(none)?;
    let gamma = expit(fit.params[1]);
    let (cos, sin) = (fit.params[3], fit.params[4]);
    let size = cos.hypot(sin).max(f64::MIN_POSITIVE);
    let along = [cos / size, sin / size];
    let amplitude_variance = along[0] * along[0] * covariance[(3, 3)]
        + 2.0 * along[0] * along[1] * covariance[(3, 4)]
        + along[1] * along[1] * covariance[(4, 4)];
    Ok(ModeFit {
        omega_rad_s: fit.params[0],
        omega_error_rad_s: covariance[(0, 0)].max(0.0).sqrt(),
        damping_ratio: gamma,
        // d ln(gamma) = (1 - gamma) d logit(gamma).
        ln_damping_error: (1.0 - gamma) * covariance[(1, 1)].max(0.0).sqrt(),
        offset: fit.params[2],
        cos,
        sin,
        amplitude_error: amplitude_variance.max(0.0).sqrt(),
        sigma: fit.sigma(),
    })
}

fn logit(gamma: f64) -> f64 {
    (gamma / (1.0 - gamma)).ln()
}

fn expit(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

/// Values and derivatives by frequency, logit of the damping ratio, offset and amplitudes.
fn model(t: &[f64], p: &DVector<f64>, values: &mut DVector<f64>, jacobian: &mut DMatrix<f64>) {
    let (omega, gamma) = (p[0], expit(p[1]));
    let slope = gamma * (1.0 - gamma);
    for (i, &t) in t.iter().enumerate() {
        let ([c, s], _, root) = shape(omega, gamma, t);
        let swing = p[3] * c + p[4] * s;
        let turned = p[4] * c - p[3] * s;
        values[i] = p[2] + swing;
        jacobian[(i, 0)] = -gamma * t * swing + root * t * turned;
        jacobian[(i, 1)] = slope * omega * t * (-swing - gamma / root.max(1e-9) * turned);
        jacobian[(i, 2)] = 1.0;
        jacobian[(i, 3)] = c;
        jacobian[(i, 4)] = s;
    }
}

/// Sum of squares and the linear parameters (offset, cosine, sine) at a frequency and a damping ratio.
fn project(t: &[f64], reading: &[f64], omega: f64, gamma: f64) -> Option<(f64, Vector3<f64>)> {
    let (mut normal, mut right, mut whole) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
    for (t, y) in t.iter().zip(reading) {
        let ([c, s], ..) = shape(omega, gamma, *t);
        let row = Vector3::new(1.0, c, s);
        normal += row * row.transpose();
        right += row * *y;
        whole += y * y;
    }
    let linear = normal.cholesky()?.solve(&right);
    Some((whole - linear.dot(&right), linear))
}

/// The few best pairs of a grid of frequencies and damping ratios.
fn starts(t: &[f64], reading: &[f64], low: f64, high: f64) -> Vec<(f64, f64)> {
    let length = t[t.len() - 1].max(f64::MIN_POSITIVE);
    let count = ((high - low) * length / (TAU * RESOLUTION_SHARE)).ceil().clamp(6.0, MOST_FREQUENCIES as f64);
    // A mode that has died takes no more readings to find.
    let mut grid: Vec<(f64, f64, f64)> = Vec::new();
    for k in 0..=count as usize {
        let omega = low + (high - low) * k as f64 / count;
        for gamma in DAMPING_STARTS {
            let seen = (12.0 * PI / (gamma * omega)).min(length);
            let end = t.partition_point(|t| *t <= seen).max(8.min(t.len()));
            let rest: f64 = variance_after(reading, end);
            if let Some((squares, _)) = project(&t[..end], &reading[..end], omega, gamma) {
                grid.push((squares + rest, omega, gamma));
            }
        }
    }
    grid.sort_by(|a, b| a.0.total_cmp(&b.0));
    grid.into_iter().take(FOLLOWED).map(|(_, omega, gamma)| (omega, gamma)).collect()
}

/// Squares about the mean of the readings from `end` on.
fn variance_after(reading: &[f64], end: usize) -> f64 {
    let rest = &reading[end..];
    if rest.is_empty() {
        return 0.0;
    }
    let mean = rest.iter().sum::<f64>() / rest.len() as f64;
    rest.iter().map(|y| (y - mean).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    #[test]
    fn derivatives_are_finite_differences() {
        let t = [0.0, 0.03, 0.4, 1.1];
        let p = DVector::from_vec(vec![20.0, logit(0.2), 0.3, 0.7, -0.4]);
        let at = |p: &DVector<f64>| {
            let (mut f, mut j) = (DVector::zeros(4), DMatrix::zeros(4, 5));
            model(&t, p, &mut f, &mut j);
            (f, j)
        };
        let (_, jacobian) = at(&p);
        for k in 0..5 {
            let h = 1e-6;
            let (mut up, mut down) = (p.clone(), p.clone());
            up[k] += h;
            down[k] -= h;
            let slope = (at(&up).0 - at(&down).0) / (2.0 * h);
            for i in 0..4 {
                approx::assert_relative_eq!(slope[i], jacobian[(i, k)], epsilon = 1e-7, max_relative = 1e-6);
            }
        }
    }

    /// The decrement is that of the peaks.
    #[test]
    fn a_mode_without_noise_comes_back() {
        let t: Vec<f64> = (0..600).map(|i| f64::from(i) * 0.01).collect();
        for gamma in [0.002, 0.03, 0.3, 0.8] {
            let root = f64::sqrt(1.0 - gamma * gamma);
            let x: Vec<f64> = t
                .iter()
                .map(|t| {
                    0.4 + (-gamma * 21.0 * t).exp()
                        * ((21.0 * root * t).cos() - 0.5 * (21.0 * root * t).sin())
                })
                .collect();
            let fit = fit_mode(&t, &x, [14.0, 28.0]).unwrap();
            assert!((fit.damping_ratio / gamma - 1.0).abs() < 1e-6, "{gamma}: {fit:?}");
            assert!((fit.omega_rad_s - 21.0).abs() < 1e-6);
            let cycle = TAU / (21.0 * root);
            let ratio = (fit.at(0.1) - 0.4) / (fit.at(0.1 + cycle) - 0.4);
            approx::assert_relative_eq!(ratio.ln(), fit.logarithmic_decrement(), max_relative = 1e-6);
        }
    }
}
