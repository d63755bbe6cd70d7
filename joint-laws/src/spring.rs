//! Elastic forces: stops, and detents of a magnetic drive.

use crate::Number;

/// The force of a stop of a stiffness at a position, on a joint that has passed it or not.
#[inline(always)]
pub fn end_stop<T: Number>(x: T, position: T, stiffness: T, beyond: bool) -> T {
    if beyond { -stiffness * (x - position) } else { T::from(0.0) }
}

/// The cogging of a drive: `amplitude sin(periods angle + phase)`, `periods` a turn.
#[inline(always)]
pub fn cogging<T: Number>(angle: T, amplitude: T, phase_rad: T, periods: T) -> T {
    amplitude * (angle * periods + phase_rad).sin()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_pushes_back_and_cogging_turns() {
        assert_eq!(end_stop(1.5, 1.0, 10.0, true), -5.0);
        assert_eq!(end_stop(0.5, 1.0, 10.0, false), 0.0);
        assert_eq!(end_stop(-1.5, -1.0, 10.0, true), 5.0);
        assert!((cogging(0.25, 2.0, 0.0, 6.0) - 2.0 * 1.5_f64.sin()).abs() < 1e-15);
    }
}
