//! Load from what is seen: radius, stretch, indentation (section 6.5).

use crate::measured::MeasuredLength;
use crate::modulus::{ModulusError, Surface, per_modulus};

/// Why there is no force.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ForceError {
    /// The modulus is not known there.
    #[error(transparent)]
    Modulus(#[from] ModulusError),
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
/// it needs a surface of four radii or more, else it is all of the positive numbers.
///
/// # Errors
/// [`ForceError`].
pub fn load(surface: &Surface, seen: &Seen) -> Result<Load, ForceError> {
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
    let at = |r: f64, d: f64| -> Result<f64, ModulusError> {
        Ok(surface.modulus_pa(r, seen.stretch_m)? * per_modulus(r, d))
    };
    let force_n = at(radius, depth)?;
    // The model is smooth: differences over a hundredth are its slopes.
    let step = 0.01;
    let of_radius = match at(radius * (1.0 + step), depth).or_else(|_| at(radius * (1.0 - step), depth)) {
        Ok(other) => (other - force_n) / (step * radius) * radius_sigma,
        Err(e) => return Err(e.into()),
    };
    let of_depth = if depth > 0.0 { 1.5 * force_n / depth * depth_sigma } else { 0.0 };
    let relative = surface.left_out_relative();
    if relative.is_nan() {
        return Ok(Load { force_n, interval_n: (0.0, f64::INFINITY) });
    }
    let half = 1.96 * of_radius.hypot(of_depth).hypot(relative * force_n);
    Ok(Load { force_n, interval_n: ((force_n - half).max(0.0), force_n + half) })
}

/// Forces in N over indentations (m) for one radius and stretch (figure 6.5 c).
///
/// # Errors
/// [`ForceError`].
pub fn curve(
    surface: &Surface,
    radius_m: f64,
    stretch_m: f64,
    indentations_m: &[f64],
) -> Result<Vec<f64>, ForceError> {
    let modulus = surface.modulus_pa(radius_m, stretch_m)?;
    Ok(indentations_m.iter().map(|d| modulus * per_modulus(radius_m, *d)).collect())
}

/// Indentation in m at which a ball feels a force (N).
///
/// # Errors
/// [`ForceError`].
pub fn indentation_m(
    surface: &Surface,
    radius_m: f64,
    stretch_m: f64,
    force_n: f64,
) -> Result<f64, ForceError> {
    if !(force_n >= 0.0 && force_n.is_finite()) {
        return Err(ForceError::Value { what: "the force", got: force_n });
    }
    let modulus = surface.modulus_pa(radius_m, stretch_m)?;
    Ok((force_n / (modulus * per_modulus(radius_m, 1.0))).powf(2.0 / 3.0))
}
