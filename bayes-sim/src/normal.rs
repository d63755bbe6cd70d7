//! The normal distribution in one dimension, also far out in its tails.

use statrs::function::erf::{erfc, erfc_inv};
use std::f64::consts::{FRAC_1_SQRT_2, PI, SQRT_2};

/// `ln sqrt(2 pi)`.
pub(crate) const LN_SQRT_2PI: f64 = 0.918_938_533_204_672_8;

/// Distribution function.
pub(crate) fn cdf(z: f64) -> f64 {
    0.5 * erfc(-z * FRAC_1_SQRT_2)
}

/// Density.
pub(crate) fn pdf(z: f64) -> f64 {
    (-0.5 * z * z - LN_SQRT_2PI).exp()
}

/// Inverse of the distribution function.
pub(crate) fn quantile(p: f64) -> f64 {
    -SQRT_2 * erfc_inv(2.0 * p)
}

/// `ln cdf(z)`; below -12 by the asymptotic series, to a relative error of 1e-9 (Abramowitz and Stegun 26.2.12).
pub(crate) fn ln_cdf(z: f64) -> f64 {
    if z > -12.0 {
        return cdf(z).ln();
    }
    let s = 1.0 / (z * z);
    let series = 1.0 - s * (1.0 - 3.0 * s * (1.0 - 5.0 * s * (1.0 - 7.0 * s)));
    -0.5 * z * z - LN_SQRT_2PI - (-z).ln() + series.ln()
}

/// Mass between `a` and `b`.
pub(crate) fn mass(a: f64, b: f64) -> f64 {
    // In the upper tail both are near 1: mirror.
    if a > 0.0 { cdf(-a) - cdf(-b) } else { cdf(b) - cdf(a) }
}

/// `ln` of the mass between `a` and `b`, finite however far out they are.
pub(crate) fn ln_mass(a: f64, b: f64) -> f64 {
    let (a, b) = if a > 0.0 { (-b, -a) } else { (a, b) };
    if b > -6.0 {
        let mass = mass(a, b);
        if mass > 1e-9 {
            return mass.ln();
        }
    }
    // Both in the lower tail, or close together: ln(cdf b - cdf a) = ln cdf b + ln(1 - exp(ln cdf a - ln cdf b)).
    let (la, lb) = (ln_cdf(a), ln_cdf(b));
    let gap = la - lb;
    if gap > -1e-6 {
        // So close that the density is constant between them.
        return -0.5 * (0.5 * (a + b)).powi(2) - LN_SQRT_2PI + (b - a).max(f64::MIN_POSITIVE).ln();
    }
    lb + (-gap.exp()).ln_1p()
}

/// The point below which the share `u` of the mass between `a` and `b` lies.
pub(crate) fn truncated_quantile(a: f64, b: f64, u: f64) -> f64 {
    if a > 0.0 {
        return -truncated_quantile(-b, -a, 1.0 - u);
    }
    if b - a < 1e-5 {
        // The density hardly changes between them, and differences of distribution functions lose their digits.
        return a + u * (b - a);
    }
    let z = if b > -6.0 {
        let (pa, pb) = (cdf(a), cdf(b));
        quantile(pa + u * (pb - pa))
    } else {
        tail_quantile(a, b, u)
    };
    if z.is_finite() {
        z.clamp(a, b)
    } else if u < 0.5 {
        a.max(-40.0).min(b)
    } else {
        b.min(40.0).max(a)
    }
}

/// The quantile where both bounds are in the lower tail, by bisection on the log distribution function.
fn tail_quantile(a: f64, b: f64, u: f64) -> f64 {
    let target = {
        let gap = ln_cdf(a) - ln_cdf(b);
        ln_cdf(b) + (u + (1.0 - u) * gap.exp()).max(f64::MIN_POSITIVE).ln()
    };
    // 745 below ln cdf(b) nothing is left.
    let (mut low, mut high) = (a.max(b - 745.0 / b.abs().max(1.0) - 1.0), b);
    for _ in 0..80 {
        let mid = 0.5 * (low + high);
        if ln_cdf(mid) < target { low = mid } else { high = mid }
    }
    0.5 * (low + high)
}

/// `ln(exp a + exp b + ...)`; minus infinity for none.
pub(crate) fn ln_sum_exp(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let top = values.clone().fold(f64::NEG_INFINITY, f64::max);
    if top.is_infinite() {
        return top;
    }
    top + values.map(|v| (v - top).exp()).sum::<f64>().ln()
}

/// `n` fractional parts of the square roots of primes: Richtmyer's generators of a Kronecker lattice (Genz and Bretz 2009).
pub(crate) fn richtmyer(n: usize) -> Vec<f64> {
    let is_prime = |k: &u32| (2..).take_while(|d| d * d <= *k).all(|d| !k.is_multiple_of(d));
    (2_u32..).filter(is_prime).take(n).map(|p| f64::from(p).sqrt().fract()).collect()
}

/// `ln det` factor of a normal in `d` dimensions.
pub(crate) fn ln_norm(d: usize) -> f64 {
    -0.5 * d as f64 * (2.0 * PI).ln()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// scipy 1.16: norm.logcdf([-5, -12.5, -40]).
    #[test]
    fn the_log_distribution_function_far_out() {
        for (z, expected) in
            [(-5.0, -15.064998393988725), (-12.5, -81.57596787074385), (-40.0, -804.608442013754)]
        {
            assert_relative_eq!(ln_cdf(z), expected, max_relative = 1e-8);
        }
    }

    /// The mass adds up over pieces, in the middle and far out, and the quantile divides it as asked.
    #[test]
    fn masses_add_up_and_quantiles_divide_them() {
        for (a, m, b) in
            [(-1.0, 0.2, 2.0), (7.0, 7.2, 9.0), (-31.0, -30.5, -30.0), (3.0, 3.0 + 1e-9, 3.0 + 1e-8)]
        {
            let sum = ln_sum_exp([ln_mass(a, m), ln_mass(m, b)].into_iter());
            assert_relative_eq!(sum, ln_mass(a, b), max_relative = 1e-6);
            for u in [0.01, 0.5, 0.99] {
                let z = truncated_quantile(a, b, u);
                assert_relative_eq!((ln_mass(a, z) - ln_mass(a, b)).exp(), u, max_relative = 2e-3);
            }
        }
    }
}
