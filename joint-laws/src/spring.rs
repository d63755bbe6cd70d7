//! Elastic forces: stops, and detents of a magnetic drive.

use crate::Number;

/// The force of a stop of a stiffness at a position: `-stiffness (x - position)` beyond it, nothing before.
///
/// `above` says on which side of the free range the stop stands.
pub fn end_stop<T: Number>(x: T, position: T, stiffness: T, above: bool) -> T {
    let depth = x - position;
    if (depth.re() > 0.0) == above && depth.re() != 0.0 { -stiffness * depth } else { T::from(0.0) }
}

/// The cogging of a drive: `amplitude sin(periods angle + phase)`, `periods` a turn.
pub fn cogging<T: Number>(angle: T, amplitude: T, phase_rad: T, periods: T) -> T {
    amplitude * (angle * periods + phase_rad).sin()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_pushes_back_from_its_side_only() {
        assert_eq!(end_stop(1.5, 1.0, 10.0, true), -5.0);
        assert_eq!(end_stop(0.5, 1.0, 10.0, true), 0.0);
        assert_eq!(end_stop(-1.5, -1.0, 10.0, false), 5.0);
        assert_eq!(end_stop(1.5, -1.0, 10.0, false), 0.0);
        assert!((cogging(0.25, 2.0, 0.0, 6.0) - 2.0 * 1.5_f64.sin()).abs() < 1e-15);
    }
}
