//! Microphones that share one clock.

use crate::ErrorType;
use crate::forward::forward;

/// Several microphones, sampled at the same instants.
pub trait Microphones: ErrorType {
    /// How many there are, at least 1.
    fn channels(&self) -> usize;

    /// Samples a second of each.
    fn rate_hz(&self) -> f64;

    /// Waits for the next samples and writes them, channel after channel for each instant, from -1 to 1.
    ///
    /// * Fills as many whole instants as fit; returns the time of the first one in s on the device's clock.
    /// * No sample comes twice. After samples were lost the returned time says so: it is later than the last buffer's end.
    /// * A buffer without room for one instant is an error of the kind [`OutOfRange`](crate::ErrorKind::OutOfRange).
    ///
    /// # Errors
    /// The device's error; the next call tries again.
    fn read(&mut self, interleaved: &mut [f32]) -> Result<f64, Self::Error>;
}

forward!(Microphones {
    fn channels(&self) -> usize {
        T::channels(self)
    }

    fn rate_hz(&self) -> f64 {
        T::rate_hz(self)
    }

    fn read(&mut self, interleaved: &mut [f32]) -> Result<f64, Self::Error> {
        T::read(self, interleaved)
    }
});
