//! How stiff an object is that the tip presses: effective modulus `E*` and spring by matching the tip's own stiffness ([Matl 2021], outlook of chapter 5).
//!
//! Tip and object are two springs in series. The travel of the base is the sum of both indentations and the camera sees the tip's, so that each press says what
//! part of the travel is the tip's: `s = E_o/(E_o + E_t(p))`. An error of s costs least of `ln E_o` where both give way alike, `E_t = E_o`: pressure is what sets
//! `E_t`. No load cell is needed; the tip's modulus comes from gels of known modulus ([`TipModulus`]), and its errors go into the interval: those of the
//! gels, of the rubber that has aged since, of the air's part, of the camera's gain, and of two springs as a model.

mod design;
mod estimate;
mod press;
mod reduce;
mod tip;

pub use design::{Next, Plan};
pub use estimate::{Bound, Estimate, Palpation};
pub use press::{Instrument, Press, Reading};
pub use tip::{Calibration, TipError, TipModulus, TipState};

use hertz_contact::calibrated::Beyond;

/// Why a press or a palpation says nothing.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum StiffnessError {
    /// A setting or a reading out of range.
    #[error("{what} is {got}; expected {expected}")]
    Value {
        /// Which.
        what: &'static str,
        /// What it has to be.
        expected: &'static str,
        /// What it is.
        got: f64,
    },
    /// Too few readings on the way in or out.
    #[error(
        "{got} readings {way}; expected {expected} or more within the calibrated contacts, and one before the contact"
    )]
    TooFew {
        /// On the way in or out.
        way: &'static str,
        /// Least number.
        expected: usize,
        /// Readings.
        got: usize,
    },
    /// The camera sees no contact.
    #[error("no contact: {got} readings of {of} show one; press deeper, or look where the object is")]
    NoContact {
        /// Readings with a contact.
        got: usize,
        /// Readings.
        of: usize,
    },
    /// The tip was dragged sideways.
    #[error(
        "the skin was sheared by {:.2} mm on a contact of {:.1} mm: it slips or is dragged; press along the normal", 1e3 * shear_m, 1e3 * contact_m
    )]
    Slipped {
        /// Mean shear, m.
        shear_m: f64,
        /// Radius of the contact, m.
        contact_m: f64,
    },
    /// The way out is not the way in.
    #[error(
        "contact ends {:.2} mm (+- {:.2}) from where it began, more than the stage's play of {:.2} mm: the object flows, yields or was moved", 1e3 * shift_m, 1e3 * error_m, 1e3 * play_m
    )]
    Hysteresis {
        /// Travel at which contact ends less that at which it begins, m.
        shift_m: f64,
        /// Its standard deviation, m.
        error_m: f64,
        /// The play that is allowed for, m.
        play_m: f64,
    },
    /// Readings that no contact of two springs explains.
    #[error(
        "residuals of the press are {times:.1} times the camera's noise: it was no single press on one elastic object"
    )]
    Misfit {
        /// Root mean square of residuals over the noise.
        times: f64,
    },
    /// A pressure or a contact beyond what the tip was calibrated for.
    #[error(transparent)]
    Beyond(#[from] Beyond),
    /// Presses that no modulus explains together.
    #[error(
        "no modulus explains the {presses} presses (chi-squared {chi_squared:.1}): the object is not elastic, has layers, or the tip is not as it was calibrated"
    )]
    Inconsistent {
        /// Presses.
        presses: usize,
        /// Weighted square of what is left.
        chi_squared: f64,
    },
    /// Presses that bound the modulus on neither side, or no press at all.
    #[error("{presses} presses bound the modulus on neither side; press deeper, or average more pictures")]
    Undecided {
        /// Presses.
        presses: usize,
    },
}

fn positive(what: &'static str, got: f64) -> Result<(), StiffnessError> {
    if got > 0.0 && got.is_finite() {
        return Ok(());
    }
    Err(StiffnessError::Value { what, expected: "a finite number above 0", got })
}
