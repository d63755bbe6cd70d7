//! Gauss's quadrature.

/// Nodes in [-1, 1] and weights of the Gauss-Legendre rule of `count` nodes (Newton's method on Legendre's recurrence).
pub(crate) fn gauss(count: usize) -> Vec<[f64; 2]> {
    let n = count as f64;
    (0..count)
        .map(|i| {
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..100 {
                let (mut before, mut now) = (1.0, x);
                for k in 2..=count {
                    let k = k as f64;
                    (before, now) = (now, ((2.0 * k - 1.0) * x * now - (k - 1.0) * before) / k);
                }
                slope = n * (x * now - before) / (x * x - 1.0);
                let step = now / slope;
                x -= step;
                if step.abs() < 1e-15 {
                    break;
                }
            }
            [x, 2.0 / ((1.0 - x * x) * slope * slope)]
        })
        .collect()
}

/// The integral over an interval by a rule's nodes and weights.
pub(crate) fn integral(rule: &[[f64; 2]], [from, to]: [f64; 2], mut f: impl FnMut(f64) -> f64) -> f64 {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    half * rule.iter().map(|[x, weight]| weight * f(middle + half * x)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// n nodes are exact to degree 2n - 1, and not beyond.
    #[test]
    fn exact_to_twice_the_nodes() {
        for n in [2, 5, 24] {
            let rule = gauss(n);
            let even = 2 * n as i32 - 2;
            let value = integral(&rule, [-1.0, 1.0], |x| x.powi(even) + x.powi(even + 1));
            approx::assert_relative_eq!(value, 2.0 / f64::from(even + 1), max_relative = 1e-12);
        }
        assert!((integral(&gauss(2), [-1.0, 1.0], |x| x.powi(4)) - 0.4).abs() > 0.1);
        approx::assert_relative_eq!(
            integral(&gauss(24), [0.0, 3.0], f64::exp),
            3f64.exp() - 1.0,
            max_relative = 1e-14
        );
    }
}
