//! Gauss and Legendre's quadrature.

/// Nodes and weights of `N` points on [0, 1].
pub(crate) fn gauss_legendre<const N: usize>() -> ([f64; N], [f64; N]) {
    let (mut nodes, mut weights) = ([0.0; N], [0.0; N]);
    let n = N as f64;
    for i in 0..N {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..100 {
            let (mut p, mut before) = (1.0, 0.0);
            for k in 0..N {
                let k = k as f64;
                (p, before) = (((2.0 * k + 1.0) * x * p - k * before) / (k + 1.0), p);
            }
            slope = n * (x * p - before) / (x * x - 1.0);
            let step = p / slope;
            x -= step;
            if step.abs() < 1e-15 {
                break;
            }
        }
        nodes[i] = 0.5 * (1.0 - x);
        weights[i] = 1.0 / ((1.0 - x * x) * slope * slope);
    }
    (nodes, weights)
}

#[cfg(test)]
mod tests {
    use super::gauss_legendre;

    #[test]
    fn polynomials_up_to_2n_minus_1_are_exact() {
        let (x, w) = gauss_legendre::<9>();
        for power in 0..18 {
            let sum: f64 = x.iter().zip(&w).map(|(x, w)| w * x.powi(power)).sum();
            assert!((sum * f64::from(power + 1) - 1.0).abs() < 1e-14, "power {power}: {sum}");
        }
        // One more is not: the test can fail.
        let sum: f64 = x.iter().zip(&w).map(|(x, w)| w * x.powi(18)).sum();
        assert!((sum * 19.0 - 1.0).abs() > 1e-12);
    }
}
