//! The rigid body that is pressed in.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::law::LawError;

/// Shape of a rigid indenter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Indenter {
    /// A ball; also two elastic balls, with the [`effective_radius_m`].
    Sphere {
        /// Radius in m, positive.
        radius_m: f64,
    },
    /// A cylinder whose flat end touches: a flat punch.
    Cylinder {
        /// Radius in m, positive.
        radius_m: f64,
    },
    /// A cone, its tip first.
    Cone {
        /// Angle between the cone's side and the flat surface in rad, above 0 and below pi/2.
        angle_rad: f64,
    },
}

impl Indenter {
    /// Whether the shape is one: its length positive, its angle between 0 and pi/2.
    ///
    /// # Errors
    /// [`LawError::NotPositive`], [`LawError::OutOfRange`].
    pub fn check(&self) -> Result<(), LawError> {
        match *self {
            Self::Sphere { radius_m } | Self::Cylinder { radius_m } => {
                crate::law::positive("radius_m", radius_m)
            }
            Self::Cone { angle_rad } => {
                if angle_rad > 0.0 && angle_rad < FRAC_PI_2 {
                    Ok(())
                } else {
                    Err(LawError::OutOfRange {
                        name: "angle_rad",
                        value: angle_rad,
                        low: 0.0,
                        high: FRAC_PI_2,
                    })
                }
            }
        }
    }

    /// Exponent n of `F = c E delta^n` on an elastic half-space: 3/2, 1 and 2.
    pub fn exponent(&self) -> f64 {
        match self {
            Self::Sphere { .. } => 1.5,
            Self::Cylinder { .. } => 1.0,
            Self::Cone { .. } => 2.0,
        }
    }

    /// Factor c of `F = c E/(1 - nu^2) delta^n` on an elastic half-space, in m^(2 - n).
    ///
    /// Sphere `4/3 sqrt(R)`, cylinder `2 R`, cone `2 / (pi tan(angle))` ([Matl 2021], eqs 6.2 to 6.4, corrected).
    pub fn factor(&self) -> f64 {
        match *self {
            Self::Sphere { radius_m } => 4.0 / 3.0 * radius_m.sqrt(),
            Self::Cylinder { radius_m } => 2.0 * radius_m,
            Self::Cone { angle_rad } => 2.0 / (PI * angle_rad.tan()),
        }
    }

    /// The radius in m; none for a cone.
    pub fn radius_m(&self) -> Option<f64> {
        match *self {
            Self::Sphere { radius_m } | Self::Cylinder { radius_m } => Some(radius_m),
            Self::Cone { .. } => None,
        }
    }
}

/// Radius R in m of `1/R = 1/R_1 + 1/R_2` for two balls; infinity is a flat, a hollow is negative.
pub fn effective_radius_m(first_m: f64, second_m: f64) -> f64 {
    1.0 / (first_m.recip() + second_m.recip())
}

/// Modulus in Pa of `1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2` for two elastic bodies; infinity is a rigid one.
pub fn effective_modulus_pa(first: (f64, f64), second: (f64, f64)) -> f64 {
    let compliance = |(modulus_pa, nu): (f64, f64)| (1.0 - nu * nu) / modulus_pa;
    1.0 / (compliance(first) + compliance(second))
}
