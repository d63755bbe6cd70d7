//! A joint that is driven by a torque, with the encoder on it.

use crate::ErrorType;
use crate::clock::Stamped;
use crate::forward::forward;

/// What a motor's drive says in one cycle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "tape-file", derive(serde::Serialize, serde::Deserialize))]
pub struct MotorReading {
    /// Angle of the joint by its encoder, rad.
    pub angle_rad: f64,
    /// Torque of the motor by its current, N m.
    pub torque_nm: f64,
}

/// A motor that is told a torque, on a joint with an encoder.
pub trait Motor: ErrorType {
    /// The largest torque in either direction, N m, above zero.
    fn limit_nm(&self) -> f64;

    /// Sets the torque (N m) from now on, and returns at once.
    ///
    /// * The last command holds until the next one.
    /// * A torque beyond the limit and anything that is no number is an error of the kind
    ///   [`OutOfRange`](crate::ErrorKind::OutOfRange).
    ///
    /// # Errors
    /// The device's error; the torque then stays as it was.
    fn drive(&mut self, torque_nm: f64) -> Result<(), Self::Error>;

    /// Waits for the drive's next cycle and returns what it says.
    ///
    /// * Each reading is returned once; times rise strictly.
    ///
    /// # Errors
    /// The device's error; the next call tries again.
    fn read(&mut self) -> Result<Stamped<MotorReading>, Self::Error>;
}

forward!(Motor {
    fn limit_nm(&self) -> f64 {
        T::limit_nm(self)
    }

    fn drive(&mut self, torque_nm: f64) -> Result<(), Self::Error> {
        T::drive(self, torque_nm)
    }

    fn read(&mut self) -> Result<Stamped<MotorReading>, Self::Error> {
        T::read(self)
    }
});
