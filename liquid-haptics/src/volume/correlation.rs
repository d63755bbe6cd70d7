//! Correlation of the torque's errors from pose to pose: a sensor that wanders.

use nalgebra::DMatrix;

use super::VolumeError;

/// Points of the search's grid along each parameter, and how often it is narrowed.
const POINTS: usize = 17;
const ROUNDS: usize = 5;
/// Neither parameter comes nearer to 1 than this.
const MOST: f64 = 0.995;
/// Fewest errors to estimate the correlation from.
const LEAST: usize = 20;

/// Correlation of the torque's errors at successive poses: a first-order autoregression, the wander, beside white noise.
///
/// The errors of two poses `n` apart have the correlation `share lag_one^n`. A wander that poses have in common looks like the torque of
/// another volume: intervals that take it for white noise are too narrow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorCorrelation {
    /// The wander's share of the errors' variance, 0 to below 1.
    share: f64,
    /// Correlation of the wander from one pose to the next, 0 to below 1: `exp(-time between poses / time constant)`.
    lag_one: f64,
}

impl ErrorCorrelation {
    /// The errors are independent.
    pub const NONE: Self = Self { share: 0.0, lag_one: 0.0 };

    /// The correlation as a sensor's maker or a calibration states it: the wander's share of the variance and its correlation from one pose to
    /// the next, both from 0 to below 1.
    ///
    /// # Errors
    /// [`VolumeError::Range`].
    pub fn new(share: f64, lag_one: f64) -> Result<Self, VolumeError> {
        for (name, got) in [("share", share), ("lag_one", lag_one)] {
            if !((0.0..1.0).contains(&got)) {
                return Err(VolumeError::Range { name, got, expected: "0 to below 1" });
            }
        }
        Ok(Self { share, lag_one })
    }

    /// The correlation of greatest likelihood given the torque's errors in sweeps of a load that is known, such as the empty container
    /// (measured less modelled, in the order of the poses; at least 20 in all), and the errors' standard deviation in the same unit.
    ///
    /// # Errors
    /// [`VolumeError::TooFew`], [`VolumeError::Pose`] for an error that is no number (counted over all sweeps).
    pub fn of_sweeps(errors: &[Vec<f64>]) -> Result<(Self, f64), VolumeError> {
        let all: Vec<f64> = errors.concat();
        if all.len() < LEAST {
            return Err(VolumeError::TooFew { what: "errors of known loads", got: all.len(), least: LEAST });
        }
        if let Some(index) = all.iter().position(|e| !e.is_finite()) {
            return Err(VolumeError::Pose { index, got: all[index] });
        }
        let (mut low, mut high) = ([0.0; 2], [MOST; 2]);
        let mut best = (f64::NEG_INFINITY, Self::NONE, 0.0);
        for _ in 0..ROUNDS {
            let step: [f64; 2] = std::array::from_fn(|k| (high[k] - low[k]) / (POINTS - 1) as f64);
            for i in 0..POINTS * POINTS {
                let share = low[0] + step[0] * (i / POINTS) as f64;
                let correlation = Self { share, lag_one: low[1] + step[1] * (i % POINTS) as f64 };
                let (likelihood, variance) = correlation.likelihood(errors);
                if likelihood > best.0 {
                    best = (likelihood, correlation, variance);
                }
            }
            let middle = [best.1.share, best.1.lag_one];
            low = std::array::from_fn(|k| (middle[k] - step[k]).max(0.0));
            high = std::array::from_fn(|k| (middle[k] + step[k]).min(MOST));
        }
        Ok((best.1, best.2.sqrt()))
    }

    /// Log likelihood, and the variance at which it is greatest, by the Kalman filter of each sweep.
    fn likelihood(&self, errors: &[Vec<f64>]) -> (f64, f64) {
        let (mut squares, mut logarithms, mut count) = (0.0, 0.0, 0.0);
        for sweep in errors {
            let (mut wander, mut variance) = (0.0, self.share);
            for error in sweep {
                let spread = variance + 1.0 - self.share;
                let innovation = error - wander;
                squares += innovation * innovation / spread;
                logarithms += spread.ln();
                count += 1.0;
                let gain = variance / spread;
                wander = self.lag_one * (wander + gain * innovation);
                let left = variance * (1.0 - gain);
                variance = self.share + self.lag_one * self.lag_one * (left - self.share);
            }
        }
        let variance = squares / count;
        (-0.5 * (logarithms + count * variance.max(f64::MIN_POSITIVE).ln()), variance)
    }

    /// The correlation matrix's Cholesky factor, by which forward substitution whitens errors; `None` where they are independent.
    pub(super) fn factor(&self, poses: usize) -> Option<DMatrix<f64>> {
        let correlation = |i: usize, j: usize| {
            let wander = self.share * self.lag_one.powi(i.abs_diff(j) as i32);
            if i == j { 1.0 } else { wander }
        };
        let independent = self.share == 0.0 || self.lag_one == 0.0;
        (!independent).then(|| DMatrix::from_fn(poses, poses, correlation).cholesky())?.map(|c| c.l())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// Wander and noise that are drawn come back, and what has no wander has none.
    #[test]
    fn what_wanders_is_found() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(4);
        let mut draw = || -> f64 { StandardNormal.sample(&mut rng) };
        for (share, lag_one) in [(0.0, 0.0), (0.6, 0.5), (0.8, 0.9)] {
            let errors: Vec<Vec<f64>> = (0..200)
                .map(|_| {
                    let mut wander = f64::sqrt(share) * draw();
                    (0..19)
                        .map(|_| {
                            let error = 3e-4 * (wander + f64::sqrt(1.0 - share) * draw());
                            wander = lag_one * wander + f64::sqrt(share * (1.0 - lag_one * lag_one)) * draw();
                            error
                        })
                        .collect()
                })
                .collect();
            let (found, sigma) = ErrorCorrelation::of_sweeps(&errors).unwrap();
            assert!((sigma / 3e-4 - 1.0).abs() < 0.08, "{sigma}");
            assert!((found.share * found.lag_one - share * lag_one).abs() < 0.06, "{found:?}");
            assert!(share == 0.0 || (found.lag_one - lag_one).abs() < 0.1, "{found:?}");
        }
    }

    #[test]
    fn what_is_no_correlation_is_refused() {
        assert!(
            ErrorCorrelation::new(1.0, 0.5).is_err()
                && ErrorCorrelation::new(0.5, f64::NAN).is_err()
                && ErrorCorrelation::new(0.5, -0.1).is_err()
        );
        assert!(matches!(
            ErrorCorrelation::of_sweeps(&[vec![0.0; 5]]),
            Err(VolumeError::TooFew { got: 5, .. })
        ));
        let mut errors = vec![0.1; 30];
        errors[12] = f64::NAN;
        assert!(matches!(ErrorCorrelation::of_sweeps(&[errors]), Err(VolumeError::Pose { index: 12, .. })));
    }
}
