//! A spring that yields: dry friction that gives before it slides.

use crate::Number;

/// The rate of the deflection `z` of a Bouc-Wen element (n = 1, beta = gamma) whose end moves with a velocity.
///
/// `dz/dt = v - (|v| z + v |z|) / (2 yield)`: `z` follows the motion, saturates at `yield_displacement` (above 0) and relaxes at once
/// when the motion turns. `forward` and `stretched` are the signs of velocity and deflection: the rate has no kink but where one of them
/// changes. The element's force is `-stiffness z` (Wen 1976, doi:10.1061/JMCEA3.0002106).
#[inline(always)]
pub fn bouc_wen_rate<T: Number>(
    velocity: T,
    deflection: T,
    yield_displacement: T,
    forward: bool,
    stretched: bool,
) -> T {
    if forward != stretched {
        return velocity;
    }
    let saturated = deflection / yield_displacement;
    velocity * (if stretched { -saturated } else { saturated } + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Loaded steadily from rest the deflection is `yield (1 - exp(-x / yield))`; unloaded it falls as fast as the end moves.
    #[test]
    fn loading_and_unloading() {
        let (y, n, v) = (0.3, 200_000, 1.0);
        let (mut z, dt) = (0.0, 0.5 / n as f64);
        for _ in 0..n {
            let half = z + 0.5 * dt * bouc_wen_rate(v, z, y, true, true);
            z += dt * bouc_wen_rate(v, half, y, true, true);
        }
        assert_relative_eq!(z, y * (1.0 - (-0.5_f64 / y).exp()), epsilon = 1e-9);
        assert_relative_eq!(bouc_wen_rate(-v, z, y, false, true), -v);
    }

    /// With the signs that its arguments have, the rate is the law as Wen writes it.
    #[test]
    fn the_rate_is_wens() {
        for (v, z, y) in [(0.4, 0.1, 0.3), (0.4, -0.1, 0.3), (-0.4, 0.1, 0.3), (-0.4, -0.1, 0.3)] {
            let law = v - (f64::abs(v) * z + v * f64::abs(z)) / (2.0 * y);
            assert_relative_eq!(bouc_wen_rate(v, z, y, v > 0.0, z > 0.0), law, epsilon = 1e-15);
        }
    }
}
