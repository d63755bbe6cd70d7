//! How the torque's errors of one pose go with those of the next: a sensor that wanders.

use nalgebra::DMatrix;

use super::VolumeError;

/// Points of the search's grid along each parameter, and how often it is narrowed.
const POINTS: usize = 17;
const ROUNDS: usize = 5;
/// Neither parameter comes nearer to 1 than this.
const MOST: f64 = 0.995;
/// Fewest residuals to estimate the ties from.
const LEAST: usize = 20;

/// Ties between the torque's errors at successive poses: a wander that each pose keeps a part of, beside a noise of its own.
///
/// Two poses `n` apart have errors of the correlation `share keep^n`. A wander that poses share looks like a torque that another
/// volume has: intervals that take it for noise are too narrow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ties {
    /// The wander's share of the errors' variance, 0 to below 1.
    share: f64,
    /// What is left of the wander from one pose to the next, 0 to below 1: `exp(-time between poses / memory)`.
    keep: f64,
}

impl Ties {
    /// Every pose has an error of its own.
    pub const NONE: Self = Self { share: 0.0, keep: 0.0 };

    /// Ties as a sensor's maker or a calibration states them; both from 0 to below 1.
    ///
    /// # Errors
    /// [`VolumeError::Range`].
    pub fn new(share: f64, keep: f64) -> Result<Self, VolumeError> {
        for (name, got) in [("share", share), ("keep", keep)] {
            if !((0.0..1.0).contains(&got)) {
                return Err(VolumeError::Range { name, got, expected: "0 to below 1" });
            }
        }
        Ok(Self { share, keep })
    }

    /// Ties by maximum likelihood from the torque's errors in sweeps of a load that is known, such as the empty container (measured
    /// less modelled, in the order of the poses; at least 20 in all), and the errors' standard deviation in the same unit.
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
                let ties = Self { share, keep: low[1] + step[1] * (i % POINTS) as f64 };
                let (likelihood, variance) = ties.likelihood(errors);
                if likelihood > best.0 {
                    best = (likelihood, ties, variance);
                }
            }
            let middle = [best.1.share, best.1.keep];
            low = std::array::from_fn(|k| (middle[k] - step[k]).max(0.0));
            high = std::array::from_fn(|k| (middle[k] + step[k]).min(MOST));
        }
        Ok((best.1, best.2.sqrt()))
    }

    /// Logarithm of the likelihood, and the variance at which it is greatest, by the Kalman filter of each sweep.
    fn likelihood(&self, errors: &[Vec<f64>]) -> (f64, f64) {
        let (mut squares, mut logarithms, mut count) = (0.0, 0.0, 0.0);
        for sweep in errors {
            let (mut wander, mut variance) = (0.0, self.share);
            for error in sweep {
                let spread = variance + 1.0 - self.share;
                let surprise = error - wander;
                squares += surprise * surprise / spread;
                logarithms += spread.ln();
                count += 1.0;
                let gain = variance / spread;
                wander = self.keep * (wander + gain * surprise);
                let left = variance * (1.0 - gain);
                variance = self.share + self.keep * self.keep * (left - self.share);
            }
        }
        let variance = squares / count;
        (-0.5 * (logarithms + count * variance.max(f64::MIN_POSITIVE).ln()), variance)
    }

    /// The lower triangle that makes independent errors of tied ones, by forward substitution; `None` where they are independent.
    pub(super) fn triangle(&self, poses: usize) -> Option<DMatrix<f64>> {
        let tied = |i: usize, j: usize| {
            let wander = self.share * self.keep.powi(i.abs_diff(j) as i32);
            if i == j { 1.0 } else { wander }
        };
        let free = self.share == 0.0 || self.keep == 0.0;
        (!free).then(|| DMatrix::from_fn(poses, poses, tied).cholesky())?.map(|c| c.l())
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
        for (share, keep) in [(0.0, 0.0), (0.6, 0.5), (0.8, 0.9)] {
            let errors: Vec<Vec<f64>> = (0..200)
                .map(|_| {
                    let mut wander = f64::sqrt(share) * draw();
                    (0..19)
                        .map(|_| {
                            let error = 3e-4 * (wander + f64::sqrt(1.0 - share) * draw());
                            wander = keep * wander + f64::sqrt(share * (1.0 - keep * keep)) * draw();
                            error
                        })
                        .collect()
                })
                .collect();
            let (ties, sigma) = Ties::of_sweeps(&errors).unwrap();
            assert!((sigma / 3e-4 - 1.0).abs() < 0.08, "{sigma}");
            assert!((ties.share * ties.keep - share * keep).abs() < 0.06, "{ties:?}");
            assert!(share == 0.0 || (ties.keep - keep).abs() < 0.1, "{ties:?}");
        }
    }

    #[test]
    fn what_is_no_tie_is_refused() {
        assert!(
            Ties::new(1.0, 0.5).is_err()
                && Ties::new(0.5, f64::NAN).is_err()
                && Ties::new(0.5, -0.1).is_err()
        );
        assert!(matches!(Ties::of_sweeps(&[vec![0.0; 5]]), Err(VolumeError::TooFew { got: 5, .. })));
        let mut errors = vec![0.1; 30];
        errors[12] = f64::NAN;
        assert!(matches!(Ties::of_sweeps(&[errors]), Err(VolumeError::Pose { index: 12, .. })));
    }
}
