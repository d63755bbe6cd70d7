//! A root between two ends of opposite signs.
//!
//! argmin's `BrentRoot` finds the same roots to rounding. What it costs around each evaluation shows where the function takes some
//! 50 ns: a tilt to pour at takes 4.4 us with it and 3.1 us with this, the plan of a drain 0.54 and 0.43 ms. It also evaluates both
//! ends again, which of a mesh are plans, and loses the type of the function's error.

/// Most evaluations: bisection alone halves any interval of doubles down to rounding in fewer.
const MOST: usize = 200;

/// Where `f` changes its sign between `a` and `b`, to `tolerance` in the argument; its values at the ends are given.
///
/// Inverse quadratic interpolation where that is safe, bisection else (Chandrupatla 1997,
/// doi:10.1016/S0965-9978(96)00051-8). Ends of the same sign give the one with the value nearer to zero.
///
/// # Errors
/// What `f` gives.
pub(crate) fn root<E>(
    mut f: impl FnMut(f64) -> Result<f64, E>,
    (a, fa): (f64, f64),
    (b, fb): (f64, f64),
    tolerance: f64,
) -> Result<f64, E> {
    let (mut x1, mut f1, mut x2, mut f2) = (a, fa, b, fb);
    let nearer = |x1: f64, f1: f64, x2: f64, f2: f64| if f1.abs() < f2.abs() { (x1, f1) } else { (x2, f2) };
    if fa == 0.0 || fb == 0.0 || (fa > 0.0) == (fb > 0.0) {
        return Ok(nearer(a, fa, b, fb).0);
    }
    let mut t = 0.5;
    for _ in 0..MOST {
        let x = x1 + t * (x2 - x1);
        let value = f(x)?;
        let (x3, f3) = if (value > 0.0) == (f1 > 0.0) {
            (x1, f1)
        } else {
            let third = (x2, f2);
            (x2, f2) = (x1, f1);
            third
        };
        (x1, f1) = (x, value);
        let (best, at_best) = nearer(x1, f1, x2, f2);
        let least = (2.0 * f64::EPSILON * best.abs() + 0.5 * tolerance) / (x2 - x1).abs();
        if at_best == 0.0 || !(least <= 0.5) {
            return Ok(best);
        }
        let xi = (x1 - x2) / (x3 - x2);
        let phi = (f1 - f2) / (f3 - f2);
        t = 0.5;
        if phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi {
            t = f1 / (f2 - f1) * f3 / (f2 - f3) + (x3 - x1) / (x2 - x1) * f1 / (f3 - f1) * f2 / (f3 - f2);
        }
        t = t.clamp(least, 1.0 - least);
    }
    Ok(nearer(x1, f1, x2, f2).0)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::root;

    /// Roots known in closed form: a smooth one, a triple one, a step, and one at an end.
    #[test]
    fn known_roots_are_found() {
        type Case = (fn(f64) -> f64, f64, f64, f64);
        let cases: [Case; 4] = [
            (|x| x * x - 2.0, 0.0, 2.0, std::f64::consts::SQRT_2),
            (|x| (x - 0.3).powi(3), -1.0, 4.0, 0.3),
            (|x| if x < 0.7 { -1.0 } else { 1.0 }, 0.0, 1.0, 0.7),
            (|x| x, 0.0, 1.0, 0.0),
        ];
        for (f, a, b, expected) in cases {
            let got = root(|x| Ok::<f64, ()>(f(x)), (a, f(a)), (b, f(b)), 1e-12).unwrap();
            assert!((got - expected).abs() < 1e-11, "{got} is not {expected}");
        }
        assert_eq!(root(|_| Err::<f64, u8>(7), (0.0, -1.0), (1.0, 1.0), 1e-12), Err(7));
    }
}
