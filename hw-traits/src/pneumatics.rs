//! A chamber of air: its pressure sensor and the valve that fills it.

use crate::ErrorType;
use crate::clock::Stamped;
use crate::forward::forward;

/// A gauge pressure sensor.
pub trait Pressure: ErrorType {
    /// Waits for the next reading and returns the pressure above the air outside, Pa.
    ///
    /// * Each reading is returned once; times rise strictly.
    /// * A reading beyond the sensor's range is an error of the kind [`Saturated`](crate::ErrorKind::Saturated).
    ///
    /// # Errors
    /// The device's error; the next call tries again.
    fn pressure_pa(&mut self) -> Result<Stamped<f64>, Self::Error>;
}

/// A valve between the chamber, a supply and the air outside.
pub trait Valve: ErrorType {
    /// Opens the valve from now on: 1 lets the supply in with full section, 0 closes, -1 lets the chamber out with full section;
    /// between them part of the section (or of the time, for a valve that is pulsed).
    ///
    /// * The last command holds until the next one.
    /// * A value outside -1 to 1 and anything that is no number is an error of the kind
    ///   [`OutOfRange`](crate::ErrorKind::OutOfRange).
    ///
    /// # Errors
    /// The device's error; the valve then stays as it was.
    fn open(&mut self, fraction: f64) -> Result<(), Self::Error>;
}

forward!(Pressure {
    fn pressure_pa(&mut self) -> Result<Stamped<f64>, Self::Error> {
        T::pressure_pa(self)
    }
});

forward!(Valve {
    fn open(&mut self, fraction: f64) -> Result<(), Self::Error> {
        T::open(self, fraction)
    }
});
