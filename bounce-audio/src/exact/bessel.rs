//! The modified Bessel function of order zero.

/// Where the power series gives way to the asymptotic one.
const SPLIT: f64 = 30.0;

/// `e^-z I_0(z)` for z of zero or more, to 1e-13: the power series, and beyond 30 the asymptotic one (DLMF 10.25.2, 10.40.1).
pub(super) fn i0_scaled(z: f64) -> f64 {
    if z < SPLIT {
        let quarter = 0.25 * z * z;
        let (mut term, mut sum, mut k) = (1.0, 1.0, 0.0);
        while term > 1e-17 * sum {
            k += 1.0;
            term *= quarter / (k * k);
            sum += term;
        }
        return sum * (-z).exp();
    }
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..=16 {
        let odd = f64::from(2 * k - 1);
        term *= odd * odd / (f64::from(8 * k) * z);
        sum += term;
    }
    sum / (2.0 * std::f64::consts::PI * z).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// I_0(0.5) = 1.0634833707413236 and I_0(5) = 27.239871823604442 (Abramowitz and Stegun, table 9.8, has ten of the digits).
    #[test]
    fn known_values() {
        for (z, expected) in [(0.0, 1.0), (0.5, 1.063_483_370_741_323_6), (5.0, 27.239_871_823_604_442)] {
            approx::assert_relative_eq!(i0_scaled(z) * f64::exp(z), expected, max_relative = 1e-13);
        }
    }

    /// The mean of `e^(z (cos a - 1))` over the circle, by the trapezoid rule, which converges faster than any power there.
    #[test]
    fn a_mean_over_the_circle() {
        for z in [0.3, 3.0, 29.99, 30.0, 30.01, 100.0, 3e3] {
            let n = 4_000;
            let angle = |k: i32| 2.0 * std::f64::consts::PI * f64::from(k) / f64::from(n);
            let mean = (0..n).map(|k| (z * (angle(k).cos() - 1.0)).exp()).sum::<f64>() / f64::from(n);
            approx::assert_relative_eq!(i0_scaled(z), mean, max_relative = 1e-12);
        }
    }
}
