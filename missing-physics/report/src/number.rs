//! Numbers for a person.

use missing_physics::diagnosis::{Diagnosis, Estimate};

/// A number with so many significant digits, without an exponent where that reads well.
pub(super) fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if !value.is_finite() {
        return "unknown".into();
    }
    let digits = digits.max(1);
    // Rounding may add a digit (9.99 -> 10.0): take the exponent after it.
    let rounded = format!("{value:.*e}", digits - 1);
    let exponent: i32 = rounded.split('e').nth(1).and_then(|e| e.parse().ok()).unwrap_or(0);
    if !(-4..6).contains(&exponent) {
        return rounded;
    }
    let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
    let shown: f64 = rounded.parse().unwrap_or(value);
    format!("{shown:.decimals$}")
}

/// A value and its standard error, in two digits of that.
pub(super) fn with_error(value: f64, error: f64) -> String {
    if !(error > 0.0 && error.is_finite()) {
        return significant(value, 3);
    }
    let decimals = (1.0 - error.log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{value:.decimals$} +- {error:.decimals$}")
}

/// A number in a few digits with its unit, where it has one.
pub(super) fn in_unit(value: f64, digits: usize, unit: &str) -> String {
    let value = significant(value, digits);
    if unit.is_empty() { value } else { format!("{value} {unit}") }
}

/// Value and interval with digits that the interval's width supports.
pub(super) fn estimate(e: &Estimate) -> String {
    let unit = if e.unit.is_empty() { String::new() } else { format!(" {}", e.unit) };
    let width = e.ci95[1] - e.ci95[0];
    if !width.is_finite() || width <= 0.0 {
        return format!("{} = {}{unit}", e.name, significant(e.value, 3));
    }
    // Two digits of the half width.
    let lowest = (0.5 * width).log10().floor() as i32 - 1;
    let show = |v: f64| {
        let size = v.abs().max(0.5 * width).log10().floor() as i32;
        let v = if v.abs() < 0.5 * 10f64.powi(lowest) { 0.0 } else { v };
        let own = if v == 0.0 { size } else { v.abs().log10().floor() as i32 };
        significant(v, (own - lowest + 1).clamp(1, 12) as usize)
    };
    format!("{} = {}{unit} (95 %: {} to {})", e.name, show(e.value), show(e.ci95[0]), show(e.ci95[1]))
}

/// The p-value of a diagnosis; at the bootstrap's floor it is a bound.
pub(super) fn p_value(d: &Diagnosis) -> String {
    p_words(d.p_value, d.p_floor)
}

/// A p-value of which the smallest that could be is known.
pub(super) fn p_words(p: f64, floor: f64) -> String {
    if p <= floor * 1.000_001 {
        format!("p <= {}", significant(floor, 1))
    } else {
        format!("p = {}", significant(p, 2))
    }
}

/// A probability with two decimals; whether a sum of probabilities is 1 to its last bit hangs on the processor, and is not said.
pub(super) fn probability(p: f64) -> String {
    match p {
        p if p > 0.995 => ">0.99".into(),
        p if p < 0.005 && p > 0.0 => "<0.01".into(),
        // Nothing has no sign.
        p => format!("{:.2}", p.max(0.0) + 0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_follow_the_interval() {
        let e = |value, low, high| Estimate {
            name: "k_per_m".into(),
            unit: "1/m".into(),
            value,
            ci95: [low, high],
        };
        assert_eq!(estimate(&e(0.044_31, 0.040_2, 0.048_4)), "k_per_m = 0.0443 1/m (95 %: 0.0402 to 0.0484)");
        assert_eq!(estimate(&e(0.0001, -0.01, 0.0102)), "k_per_m = 0 1/m (95 %: -0.010 to 0.010)");
        assert_eq!(estimate(&e(5.0, f64::NAN, f64::NAN)), "k_per_m = 5.00 1/m");
    }

    #[test]
    fn significant_digits() {
        assert_eq!(significant(9.996, 3), "10.0");
        assert_eq!(significant(0.000_012_34, 2), "1.2e-5");
        assert_eq!(significant(-1234.5, 2), "-1200");
        assert_eq!(significant(f64::NAN, 2), "unknown");
        assert_eq!(significant(0.0, 2), "0");
    }

    #[test]
    fn an_error_says_how_many_digits_a_value_has() {
        assert_eq!(with_error(-0.0124, 0.000_67), "-0.01240 +- 0.00067");
        assert_eq!(with_error(1234.0, 21.0), "1234 +- 21");
        assert_eq!(with_error(1.234, f64::INFINITY), "1.23");
    }

    #[test]
    fn a_probability_hangs_on_no_last_bit() {
        for p in [0.999, 1.0 - f64::EPSILON, 1.0, 1.0 + f64::EPSILON] {
            assert_eq!(probability(p), ">0.99");
        }
        assert_eq!([0.0, -0.0, 1e-300, 0.5].map(probability), ["0.00", "0.00", "<0.01", "0.50"]);
    }
}
