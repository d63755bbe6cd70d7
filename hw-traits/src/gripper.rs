//! A gripper with two parallel fingers.

use crate::ErrorType;
use crate::clock::Stamped;
use crate::forward::forward;

/// Two fingers that move along one line, symmetrically.
pub trait Gripper: ErrorType {
    /// The smallest and the largest distance between the fingers in m.
    fn limits_m(&self) -> (f64, f64);

    /// Starts to move the fingers to a distance (m) at a speed of at most `speed_m_s` (above zero), and returns at once.
    ///
    /// * A new command replaces one that is still under way, from wherever the fingers are.
    /// * A width outside the limits, a speed that is not above zero, and anything that is no number is an error of the kind
    ///   [`OutOfRange`](crate::ErrorKind::OutOfRange), and nothing moves. Limits win over the speed where both are wrong.
    /// * Fingers that are held up by what lies between them stand still and are settled.
    ///
    /// # Errors
    /// The device's error; the gripper then goes on with the command before.
    fn open_to(&mut self, width_m: f64, speed_m_s: f64) -> Result<(), Self::Error>;

    /// The present distance between the fingers (m), measured and not the commanded one.
    ///
    /// # Errors
    /// The device's error.
    fn width_m(&mut self) -> Result<Stamped<f64>, Self::Error>;

    /// Whether the fingers stand still.
    ///
    /// # Errors
    /// The device's error.
    fn settled(&mut self) -> Result<bool, Self::Error>;
}

forward!(Gripper {
    fn limits_m(&self) -> (f64, f64) {
        T::limits_m(self)
    }

    fn open_to(&mut self, width_m: f64, speed_m_s: f64) -> Result<(), Self::Error> {
        T::open_to(self, width_m, speed_m_s)
    }

    fn width_m(&mut self) -> Result<Stamped<f64>, Self::Error> {
        T::width_m(self)
    }

    fn settled(&mut self) -> Result<bool, Self::Error> {
        T::settled(self)
    }
});
