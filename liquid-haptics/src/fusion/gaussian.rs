//! Normal laws cut to an interval.

use std::f64::consts::{PI, SQRT_2};

use statrs::function::erf::erfc;

/// The standard normal law's distribution function.
pub(super) fn cdf(z: f64) -> f64 {
    0.5 * erfc(-z / SQRT_2)
}

/// Logarithm of the integral of `exp(-((x - mean) / sd)^2 / 2)` over an interval.
pub(super) fn ln_box(mean: f64, sd: f64, [low, high]: [f64; 2]) -> f64 {
    let (mut a, mut b) = ((low - mean) / sd, (high - mean) / sd);
    if a + b < 0.0 {
        // The tail that is far is the upper one.
        (a, b) = (-b, -a);
    }
    let share = 0.5 * (erfc(a / SQRT_2) - erfc(b / SQRT_2));
    if share > 1e-200 {
        return (sd * (2.0 * PI).sqrt() * share).ln();
    }
    sd.ln() - 0.5 * a * a - a.ln()
}

/// Logarithm of the normal density.
pub(super) fn ln_density(x: f64, mean: f64, sd: f64) -> f64 {
    let z = (x - mean) / sd;
    -0.5 * z * z - sd.ln() - 0.5 * (2.0 * PI).ln()
}

/// Standard deviation of a normal law that is flat over logarithms of densities and viscosities.
pub(super) const FLAT: f64 = 1e3;

/// A normal shape `exp(peak - ((x - mean) / sd)^2 / 2)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shape {
    pub(super) peak: f64,
    pub(super) mean: f64,
    pub(super) sd: f64,
}

impl Shape {
    /// One that says nothing, about a middle.
    pub(super) fn flat(middle: f64) -> Self {
        Self { peak: 0.0, mean: middle, sd: FLAT }
    }

    /// Their product.
    pub(super) fn times(&self, other: &Self) -> Self {
        let (a, b) = (self.sd.powi(-2), other.sd.powi(-2));
        let apart = (self.mean - other.mean).powi(2) / (self.sd.powi(2) + other.sd.powi(2));
        Self {
            peak: self.peak + other.peak - 0.5 * apart,
            mean: (a * self.mean + b * other.mean) / (a + b),
            sd: (a + b).sqrt().recip(),
        }
    }
}

/// Logarithm of the sum of exponentials.
pub(super) fn ln_sum(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let most = values.clone().fold(f64::NEG_INFINITY, f64::max);
    if most == f64::NEG_INFINITY {
        return most;
    }
    most + values.map(|v| (v - most).exp()).sum::<f64>().ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against a sum over the interval, far tails included.
    #[test]
    fn a_box_holds_its_integral() {
        for (mean, sd) in [(0.3, 0.2), (-4.0, 0.1), (9.0, 0.15), (0.5, 1e3), (60.0, 0.1)] {
            let n = 200_000;
            let terms = (0..n).map(|k| {
                let x = (k as f64 + 0.5) / f64::from(n);
                -0.5 * ((x - mean) / sd).powi(2) - f64::from(n).ln()
            });
            let sum = ln_sum(terms);
            approx::assert_relative_eq!(
                ln_box(mean, sd, [0.0, 1.0]),
                sum,
                max_relative = 1e-3,
                epsilon = 1e-6
            );
        }
    }
}
