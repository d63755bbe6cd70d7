//! Load from what is seen: radius, stretch, indentation (section 6.5).

use crate::calibration::{CalibrationError, ForceModel};
use crate::measured::MeasuredLength;

/// Why there is no force.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ForceError {
    /// The calibration has no answer there.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// A number out of range.
    #[error("{what} is {got}; expected a finite number, 0 or more")]
    Value {
        /// Which.
        what: &'static str,
        /// What it is.
        got: f64,
    },
}

/// What was seen of a contact with a ball.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Stretch of the membrane, m.
    pub stretch_m: f64,
    /// Radius of the contact.
    pub radius: MeasuredLength,
    /// Indentation.
    pub indentation: MeasuredLength,
}

/// A force and its 95 % interval, N.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// Force, N.
    pub force_n: f64,
    /// Interval.
    pub interval_n: (f64, f64),
}

/// Force of a contact. The interval adds up what radius, indentation and the model (its error with a radius left out) do not know;
/// it needs a calibration of four radii or more, else it is all of the positive numbers.
///
/// # Errors
/// [`ForceError`].
pub fn load(model: &impl ForceModel, seen: &Seen) -> Result<Load, ForceError> {
    let MeasuredLength { value_m: radius, sigma_m: radius_sigma } = seen.radius;
    let MeasuredLength { value_m: depth, sigma_m: depth_sigma } = seen.indentation;
    for (what, got) in [
        ("the indentation", depth),
        ("the indentation's standard deviation", depth_sigma),
        ("the radius's standard deviation", radius_sigma),
    ] {
        if !(got >= 0.0 && got.is_finite()) {
            return Err(ForceError::Value { what, got });
        }
    }
    let at = |r: f64, d: f64| model.force_n(r, seen.stretch_m, d);
    let force_n = at(radius, depth)?;
    // The model is smooth: differences over a hundredth are its slopes.
    let step = 0.01;
    let of_radius = match at(radius * (1.0 + step), depth).or_else(|_| at(radius * (1.0 - step), depth)) {
        Ok(other) => (other - force_n) / (step * radius) * radius_sigma,
        Err(e) => return Err(e.into()),
    };
    let of_depth = if depth > 0.0 {
        (force_n - at(radius, depth * (1.0 - step))?) / (step * depth) * depth_sigma
    } else {
        0.0
    };
    let Some(left_out) = model.radius_left_out() else {
        return Ok(Load { force_n, interval_n: (0.0, f64::INFINITY) });
    };
    let half = 1.96 * of_radius.hypot(of_depth).hypot(left_out.relative * force_n);
    Ok(Load { force_n, interval_n: ((force_n - half).max(0.0), force_n + half) })
}

/// Forces in N over indentations (m) for one radius and stretch (figure 6.5 c).
///
/// # Errors
/// [`ForceError`].
pub fn curve(
    model: &impl ForceModel,
    radius_m: f64,
    stretch_m: f64,
    indentations_m: &[f64],
) -> Result<Vec<f64>, ForceError> {
    Ok(indentations_m.iter().map(|d| model.force_n(radius_m, stretch_m, *d)).collect::<Result<_, _>>()?)
}

/// Indentation in m at which a ball feels a force (N).
///
/// # Errors
/// [`ForceError`].
pub fn indentation_m(
    model: &impl ForceModel,
    radius_m: f64,
    stretch_m: f64,
    force_n: f64,
) -> Result<f64, ForceError> {
    if !(force_n >= 0.0 && force_n.is_finite()) {
        return Err(ForceError::Value { what: "the force", got: force_n });
    }
    Ok(model.indentation_m(radius_m, stretch_m, force_n)?)
}
