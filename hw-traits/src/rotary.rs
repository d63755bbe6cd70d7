//! A wrist that turns about one axis.

use crate::ErrorType;
use crate::clock::Stamped;
use crate::forward::forward;

/// A joint that turns about one axis.
///
/// Angles are those that its owner means (for a bottle: the tilt from upright, clockwise); a driver maps them to the joint's
/// own zero and sign.
pub trait Rotary: ErrorType {
    /// The smallest and the largest angle in rad.
    fn limits_rad(&self) -> (f64, f64);

    /// Starts to turn to an angle (rad) at a speed of at most `rate_rad_s` (above zero), and returns at once.
    ///
    /// * A new command replaces one that is still under way, from wherever the joint is.
    /// * An angle outside the limits, a rate that is not above zero, and anything that is no number is an error of the kind
    ///   [`OutOfRange`](crate::ErrorKind::OutOfRange), and nothing moves. Limits win over the rate where both are wrong.
    ///
    /// # Errors
    /// The device's error; the joint then goes on with the command before.
    fn turn_to(&mut self, angle_rad: f64, rate_rad_s: f64) -> Result<(), Self::Error>;

    /// The present angle (rad), measured and not the commanded one.
    ///
    /// # Errors
    /// The device's error.
    fn angle_rad(&mut self) -> Result<Stamped<f64>, Self::Error>;

    /// Whether the last command has been carried out and the joint stands still.
    ///
    /// # Errors
    /// The device's error.
    fn settled(&mut self) -> Result<bool, Self::Error>;
}

forward!(Rotary {
    fn limits_rad(&self) -> (f64, f64) {
        T::limits_rad(self)
    }

    fn turn_to(&mut self, angle_rad: f64, rate_rad_s: f64) -> Result<(), Self::Error> {
        T::turn_to(self, angle_rad, rate_rad_s)
    }

    fn angle_rad(&mut self) -> Result<Stamped<f64>, Self::Error> {
        T::angle_rad(self)
    }

    fn settled(&mut self) -> Result<bool, Self::Error> {
        T::settled(self)
    }
});
