//! Measurement noise of several kinds.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal, StudentT};

/// The noise of one channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// One sigma of a reading.
    pub sigma: f64,
    /// Correlation of neighbouring rows, in [0, 1).
    pub correlation: f64,
    /// Sigma of a slow part (an Ornstein-Uhlenbeck process) that is added, relative to `sigma`.
    pub slow: f64,
    /// Rows over which the slow part stays alike.
    pub slow_rows: f64,
    /// Degrees of freedom of heavy tails (scaled to `sigma`); infinite for a normal law.
    pub tail_freedom: f64,
    /// Share of rows that are thrown off by 10 to 40 sigma.
    pub outliers: f64,
    /// The step between readings; 0 for none.
    pub digit: f64,
}

impl Noise {
    /// White normal noise.
    pub const fn white(sigma: f64) -> Self {
        Self {
            sigma,
            correlation: 0.0,
            slow: 0.0,
            slow_rows: 1.0,
            tail_freedom: f64::INFINITY,
            outliers: 0.0,
            digit: 0.0,
        }
    }

    /// Adds noise to a column of true values, then rounds it to the digit.
    pub fn apply(&self, column: &mut [f64], rng: &mut impl Rng) {
        let normal = |rng: &mut _| -> f64 { StandardNormal.sample(rng) };
        let heavy = StudentT::new(self.tail_freedom).ok().filter(|_| self.tail_freedom.is_finite());
        let shrink = if self.tail_freedom > 2.0 {
            ((self.tail_freedom - 2.0) / self.tail_freedom).sqrt()
        } else {
            1.0
        };
        let keep = (-1.0 / self.slow_rows.max(1e-9)).exp();
        let (mut near, mut slow) = (normal(rng), normal(rng));
        for value in column {
            let fresh = match &heavy {
                Some(law) => shrink * law.sample(rng),
                None => normal(rng),
            };
            near = self.correlation * near + (1.0 - self.correlation * self.correlation).sqrt() * fresh;
            slow = keep * slow + (1.0 - keep * keep).sqrt() * normal(rng);
            *value += self.sigma * (near + self.slow * slow);
            let uniform = f64::from(rng.next_u32()) / 4_294_967_296.0;
            if uniform < self.outliers {
                let size = 10.0 + 30.0 * uniform / self.outliers;
                *value += self.sigma * size * if rng.next_u32() & 1 == 0 { 1.0 } else { -1.0 };
            }
            if self.digit > 0.0 {
                *value = (*value / self.digit).round() * self.digit;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    fn draw(noise: Noise) -> Vec<f64> {
        let mut column = vec![0.0; 200_000];
        noise.apply(&mut column, &mut ChaCha8Rng::seed_from_u64(3));
        column
    }

    fn moments(x: &[f64], lag: usize) -> (f64, f64) {
        let variance = x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64;
        let product = x.iter().zip(&x[lag..]).map(|(a, b)| a * b).sum::<f64>() / (x.len() - lag) as f64;
        (variance.sqrt(), product / variance)
    }

    #[test]
    fn sigma_and_correlation_are_what_they_say() {
        let (sigma, next) = moments(&draw(Noise { correlation: 0.7, ..Noise::white(0.5) }), 1);
        approx::assert_relative_eq!(sigma, 0.5, max_relative = 0.02);
        approx::assert_relative_eq!(next, 0.7, epsilon = 0.01);
        let (sigma, later) = moments(&draw(Noise { slow: 1.0, slow_rows: 10.0, ..Noise::white(0.5) }), 10);
        approx::assert_relative_eq!(sigma, 0.5 * 2f64.sqrt(), max_relative = 0.03);
        approx::assert_relative_eq!(later, 0.5 * (-1f64).exp(), epsilon = 0.02);
    }

    #[test]
    fn heavy_tails_keep_sigma_and_reach_further() {
        let x = draw(Noise { tail_freedom: 5.0, ..Noise::white(1.0) });
        approx::assert_relative_eq!(moments(&x, 1).0, 1.0, max_relative = 0.03);
        let far = |x: &[f64]| x.iter().filter(|v| v.abs() > 4.0).count();
        assert!(far(&x) > 10 * far(&draw(Noise::white(1.0))).max(1));
    }

    /// Excess kurtosis of Student's t with n degrees of freedom is 6/(n - 4); of a normal law 0.
    #[test]
    fn the_fourth_moment_is_that_of_the_law() {
        let kurtosis = |x: &[f64]| {
            let moment = |p| x.iter().map(|v: &f64| v.powi(p)).sum::<f64>() / x.len() as f64;
            moment(4) / moment(2).powi(2) - 3.0
        };
        // One sigma of the estimate is sqrt(24/n) = 0.011 for the normal law, and 0.05 for 12 degrees of freedom.
        approx::assert_abs_diff_eq!(kurtosis(&draw(Noise::white(2.0))), 0.0, epsilon = 0.03);
        let x = draw(Noise { tail_freedom: 12.0, ..Noise::white(2.0) });
        approx::assert_abs_diff_eq!(kurtosis(&x), 0.75, epsilon = 0.15);
    }

    #[test]
    fn white_noise_has_no_memory_and_colour_fades_geometrically() {
        // One sigma of a correlation over 200,000 rows is 0.0022; strong colour widens it threefold.
        let white = draw(Noise::white(0.5));
        let near = draw(Noise { correlation: 0.8, ..Noise::white(0.5) });
        for lag in [1, 2, 5, 10] {
            approx::assert_abs_diff_eq!(moments(&white, lag).1, 0.0, epsilon = 0.007);
            approx::assert_abs_diff_eq!(moments(&near, lag).1, 0.8_f64.powi(lag as i32), epsilon = 0.02);
        }
    }

    /// As many outliers as promised (4 binomial sigma), each by 10 to 40 sigma, up or down.
    #[test]
    fn outliers_come_as_often_and_as_far_as_promised() {
        let x = draw(Noise { outliers: 0.01, ..Noise::white(0.1) });
        let far: Vec<f64> = x.iter().map(|v| v / 0.1).filter(|v| v.abs() > 6.0).collect();
        let expected = 0.01 * x.len() as f64;
        assert!((far.len() as f64 - expected).abs() < 4.0 * expected.sqrt(), "{} outliers", far.len());
        assert!(far.iter().all(|v| v.abs() < 46.0));
        let up = far.iter().filter(|v| **v > 0.0).count() as f64;
        assert!((up - 0.5 * expected).abs() < 4.0 * (0.5 * expected).sqrt(), "{up} upwards");
        let mean = far.iter().map(|v| v.abs()).sum::<f64>() / far.len() as f64;
        // Uniform between 10 and 40: one sigma of the mean is 8.7/sqrt(2000) = 0.19.
        approx::assert_abs_diff_eq!(mean, 25.0, epsilon = 0.8);
    }

    #[test]
    fn digits_are_multiples() {
        let x = draw(Noise { digit: 0.3, ..Noise::white(1.0) });
        assert!(x.iter().all(|v| (v / 0.3 - (v / 0.3).round()).abs() < 1e-9));
    }
}
