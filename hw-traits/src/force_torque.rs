//! Six-axis force and torque sensors.

use crate::ErrorType;
use crate::clock::Stamped;
use crate::forward::forward;

/// Force and torque on a sensor, in a frame that whoever passes it on has to name (`wrench_in_sensor`).
///
/// Signs: what the load exerts on the sensor. A mass that hangs from an upright sensor pulls along the world's down.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "tape-file", derive(serde::Serialize, serde::Deserialize))]
pub struct Wrench {
    /// Force in N.
    pub force_n: [f64; 3],
    /// Torque about the frame's origin in N m.
    pub torque_nm: [f64; 3],
}

/// A six-axis force and torque sensor.
pub trait ForceTorque: ErrorType {
    /// Waits for the next reading and returns it, in the sensor's own frame.
    ///
    /// * Each reading is returned once: two calls give two readings.
    /// * Times rise strictly from reading to reading. Readings that were lost in between leave a gap, they are not made up.
    /// * Readings are raw: no filter, and no offset but that of [`ForceTorque::tare`].
    /// * A reading in which one axis is beyond its range is an error of the kind
    ///   [`Saturated`](crate::ErrorKind::Saturated), whatever the other axes say.
    ///
    /// # Errors
    /// The device's error; the next call tries again.
    fn read(&mut self) -> Result<Stamped<Wrench>, Self::Error>;

    /// Takes the present load as zero.
    ///
    /// * The mean of `readings` readings (at least one) is subtracted from all later ones.
    /// * On failure the former offset stays.
    ///
    /// # Errors
    /// As [`ForceTorque::read`].
    fn tare(&mut self, readings: usize) -> Result<(), Self::Error>;

    /// Leaves out readings that were taken before this call and have not been returned: the next one is new.
    ///
    /// What is provided is right for a device that measures when it is asked; one that streams has to leave out what waits.
    ///
    /// # Errors
    /// As [`ForceTorque::read`].
    fn skip(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }
}

forward!(ForceTorque {
    fn read(&mut self) -> Result<Stamped<Wrench>, Self::Error> {
        T::read(self)
    }

    fn tare(&mut self, readings: usize) -> Result<(), Self::Error> {
        T::tare(self, readings)
    }

    fn skip(&mut self) -> Result<(), Self::Error> {
        T::skip(self)
    }
});

impl Wrench {
    /// Every component times a factor.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self { force_n: self.force_n.map(|f| f * factor), torque_nm: self.torque_nm.map(|t| t * factor) }
    }

    /// The sum with another wrench in the same frame.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        let add = |a: [f64; 3], b: [f64; 3]| [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
        Self { force_n: add(self.force_n, other.force_n), torque_nm: add(self.torque_nm, other.torque_nm) }
    }

    /// All six components, forces first.
    pub fn components(&self) -> [f64; 6] {
        let ([a, b, c], [d, e, f]) = (self.force_n, self.torque_nm);
        [a, b, c, d, e, f]
    }
}
