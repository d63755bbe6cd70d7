//! The classical Runge-Kutta method of the fourth order.

/// The state a step `h` after time `t`, by its rates of change at a state and a time.
pub(crate) fn step<const N: usize>(
    x: &[f64; N],
    t: f64,
    h: f64,
    rates: impl Fn(&[f64; N], f64) -> [f64; N],
) -> [f64; N] {
    let along = |k: &[f64; N], h: f64| -> [f64; N] { std::array::from_fn(|i| x[i] + h * k[i]) };
    let k1 = rates(x, t);
    let k2 = rates(&along(&k1, 0.5 * h), t + 0.5 * h);
    let k3 = rates(&along(&k2, 0.5 * h), t + 0.5 * h);
    let k4 = rates(&along(&k3, h), t + h);
    std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]))
}
