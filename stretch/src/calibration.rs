//! What a membrane's force is calibrated with, and what a calibration then answers.

use hertz_contact::calibrated::{Beyond, distinct};

/// Why there is no calibration, or no answer from it.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum CalibrationError {
    /// A number out of range.
    #[error("press {press}: {what} is {got}; expected a finite number, {least} or more")]
    Value {
        /// Index of the press.
        press: usize,
        /// Which column.
        what: &'static str,
        /// Its value.
        got: f64,
        /// Least value.
        least: f64,
    },
    /// Too few different states.
    #[error("{got} different {what}; expected {expected} or more")]
    TooFew {
        /// Of what.
        what: &'static str,
        /// Least number.
        expected: usize,
        /// Different ones.
        got: usize,
    },
    /// A state in which nothing was pressed in, or nothing was felt.
    #[error("presses with radius {radius_m} m at stretch {stretch_m} m have no positive force")]
    NoForce {
        /// Radius, m.
        radius_m: f64,
        /// Stretch, m.
        stretch_m: f64,
    },
    /// A force that the law does not reach.
    #[error("the law does not reach {force_n} N")]
    NotReached {
        /// The force, N.
        force_n: f64,
    },
    /// A question beyond what was calibrated.
    #[error(transparent)]
    Beyond(#[from] Beyond),
}

/// A press of a rigid ball whose force was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Press {
    /// Stretch of the membrane, m, 0 or more.
    pub stretch_m: f64,
    /// Radius of the ball, m, above 0.
    pub radius_m: f64,
    /// Indentation, m, 0 or more.
    pub indentation_m: f64,
    /// Force, N.
    pub force_n: f64,
}

/// Errors of forces (N) in states that a calibration has not seen: each inner radius, or each inner stretch, left out in turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeftOut {
    /// Mean of the error's modulus, N.
    pub mean_n: f64,
    /// Standard deviation of the error's modulus, N.
    pub spread_n: f64,
    /// Root mean square of the error as a part of the predicted force.
    pub relative: f64,
    /// Presses that were predicted.
    pub presses: usize,
}

impl LeftOut {
    /// Of predicted and measured forces, N; none where nothing was left out.
    pub(crate) fn of(pairs: &[(f64, f64)]) -> Option<Self> {
        let n = pairs.len() as f64;
        let mean_n = pairs.iter().map(|(p, m)| (p - m).abs()).sum::<f64>() / n;
        let spread_n = (pairs.iter().map(|(p, m)| ((p - m).abs() - mean_n).powi(2)).sum::<f64>() / n).sqrt();
        let relative = (pairs.iter().map(|(p, m)| ((p - m) / p).powi(2)).sum::<f64>() / n).sqrt();
        (!pairs.is_empty()).then_some(Self { mean_n, spread_n, relative, presses: pairs.len() })
    }
}

/// The force of a membrane on a ball, calibrated.
pub trait ForceModel {
    /// Force in N for a ball's radius (m), a stretch (m) and an indentation (m, 0 or more; no force at 0).
    ///
    /// # Errors
    /// [`CalibrationError::Beyond`].
    fn force_n(&self, radius_m: f64, stretch_m: f64, indentation_m: f64) -> Result<f64, CalibrationError>;

    /// Indentation in m at which a ball feels a force (N, 0 or more).
    ///
    /// # Errors
    /// [`CalibrationError::Beyond`], [`CalibrationError::NotReached`].
    fn indentation_m(&self, radius_m: f64, stretch_m: f64, force_n: f64) -> Result<f64, CalibrationError>;

    /// Errors with each inner radius left out in turn; none with fewer than four radii.
    fn radius_left_out(&self) -> Option<LeftOut>;

    /// Errors with each inner stretch left out in turn; none with fewer than four stretches.
    fn stretch_left_out(&self) -> Option<LeftOut>;
}

/// Part of a calibrated range that may be asked for beyond it.
pub(crate) const SLACK: f64 = 0.05;

/// Errors with each inner radius, and with each inner stretch, left out in turn. The outer ones are not: that would be extrapolation, which a
/// calibration refuses.
pub(crate) fn left_out<M: ForceModel>(
    presses: &[Press],
    fit: impl Fn(&[Press]) -> Result<M, CalibrationError>,
) -> Result<[Option<LeftOut>; 2], CalibrationError> {
    let without = |of: fn(&Press) -> f64| -> Result<_, CalibrationError> {
        let values = distinct(presses.iter().map(of));
        let mut pairs = Vec::new();
        if values.len() >= 4 {
            for &value in &values[1..values.len() - 1] {
                let (out, others): (Vec<Press>, Vec<Press>) = presses.iter().partition(|p| of(p) == value);
                let model = fit(&others)?;
                for p in out.iter().filter(|p| p.indentation_m > 0.0) {
                    pairs.push((model.force_n(p.radius_m, p.stretch_m, p.indentation_m)?, p.force_n));
                }
            }
        }
        Ok(LeftOut::of(&pairs))
    };
    Ok([without(|p| p.radius_m)?, without(|p| p.stretch_m)?])
}

/// Whether presses hold numbers in range, and states enough: three radii and three stretches, each pushing back.
pub(crate) fn check(presses: &[Press]) -> Result<(), CalibrationError> {
    for (press, p) in presses.iter().enumerate() {
        for (what, got, least) in [
            ("the stretch", p.stretch_m, 0.0),
            ("the radius", p.radius_m, f64::MIN_POSITIVE),
            ("the indentation", p.indentation_m, 0.0),
            ("the force", p.force_n, f64::MIN),
        ] {
            if !(got.is_finite() && got >= least) {
                return Err(CalibrationError::Value { press, what, got, least });
            }
        }
    }
    let states =
        [distinct(presses.iter().map(|p| p.stretch_m)), distinct(presses.iter().map(|p| p.radius_m))];
    for (what, values) in ["stretches", "radii"].into_iter().zip(&states) {
        if values.len() < 3 {
            return Err(CalibrationError::TooFew { what, expected: 3, got: values.len() });
        }
    }
    for &stretch_m in &states[0] {
        for &radius_m in &states[1] {
            let mut here = presses.iter().filter(|p| p.stretch_m == stretch_m && p.radius_m == radius_m);
            // A radius need not have been pressed in at every stretch.
            if here.clone().any(|p| p.indentation_m > 0.0)
                && !(here.by_ref().map(|p| p.force_n * p.indentation_m).sum::<f64>() > 0.0)
            {
                return Err(CalibrationError::NoForce { radius_m, stretch_m });
            }
        }
    }
    Ok(())
}
