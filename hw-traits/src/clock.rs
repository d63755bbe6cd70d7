//! Time.
//!
//! Every device stamps its readings with a clock of its own: a sensor's counter, the robot controller's, the computer's. They
//! start at different zeros and drift apart by some 1e-5; aligning them is the business of whoever merges two streams, and a
//! driver never does it silently.

use crate::ErrorType;
use crate::forward::forward;

/// A value and when it was true.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "tape-file", derive(serde::Serialize, serde::Deserialize))]
pub struct Stamped<T> {
    /// Time of the measurement (not of its arrival) on the device's own clock, in s; its zero is arbitrary.
    pub t_s: f64,
    /// The value.
    pub value: T,
}

/// A clock that one can wait on.
pub trait Clock: ErrorType {
    /// The time in s since an arbitrary zero.
    ///
    /// * Never falls from one call to the next.
    /// * Goes on while the program sleeps.
    ///
    /// # Errors
    /// Where the clock is a device that can be lost.
    fn now_s(&mut self) -> Result<f64, Self::Error>;

    /// Waits for at least `duration_s`.
    ///
    /// * Zero, a negative number and NaN return at once.
    /// * Afterwards [`Clock::now_s`] has risen by at least the duration.
    ///
    /// # Errors
    /// As [`Clock::now_s`]; the wait may then have been shorter.
    fn sleep_s(&mut self, duration_s: f64) -> Result<(), Self::Error>;
}

forward!(Clock {
    fn now_s(&mut self) -> Result<f64, Self::Error> {
        T::now_s(self)
    }

    fn sleep_s(&mut self, duration_s: f64) -> Result<(), Self::Error> {
        T::sleep_s(self, duration_s)
    }
});

/// The computer's monotonic clock.
#[derive(Debug, Clone, Copy)]
pub struct SystemClock {
    zero: std::time::Instant,
}

impl Default for SystemClock {
    fn default() -> Self {
        Self { zero: std::time::Instant::now() }
    }
}

impl ErrorType for SystemClock {
    type Error = std::convert::Infallible;
}

impl Clock for SystemClock {
    fn now_s(&mut self) -> Result<f64, Self::Error> {
        Ok(self.zero.elapsed().as_secs_f64())
    }

    fn sleep_s(&mut self, duration_s: f64) -> Result<(), Self::Error> {
        if let Ok(duration) = std::time::Duration::try_from_secs_f64(duration_s) {
            std::thread::sleep(duration);
        }
        Ok(())
    }
}
