//! How impacts are distinguished from the rest of a sound, and what is wrong with it or with that.

use thiserror::Error;

/// How impacts are distinguished from the rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnsetSettings {
    /// Corner of the high-pass, Hz.
    pub high_pass_hz: f64,
    /// Least short-time amplitude, in standard deviations of the noise.
    pub threshold_sigmas: f64,
    /// Least jump of the amplitude over the milliseconds before, a ratio.
    pub rise: f64,
    /// No impact this soon after another, s.
    pub refractory_s: f64,
    /// Single echoes off walls and table: their amplitude over the impact's, at once, and how fast they fade, dB/s.
    pub early_echo: (f64, f64),
    /// The reverberation that follows, likewise.
    pub reverberation: (f64, f64),
}

impl Default for OnsetSettings {
    fn default() -> Self {
        Self {
            high_pass_hz: 1_500.0,
            threshold_sigmas: 3.0,
            rise: 2.2,
            refractory_s: 8e-3,
            early_echo: (1.3, 350.0),
            reverberation: (0.3, 100.0),
        }
    }
}

impl OnsetSettings {
    /// Whether onsets can be looked for at a sample rate (Hz).
    ///
    /// # Errors
    /// [`OnsetError::Setting`] names the first setting out of its range.
    pub fn check(&self, rate_hz: f64) -> Result<(), OnsetError> {
        let positive = "a finite number above 0";
        for (what, got) in [
            ("the sample rate", rate_hz),
            ("the threshold", self.threshold_sigmas),
            ("the rise", self.rise),
            ("the refractory time", self.refractory_s),
            ("the high-pass corner", self.high_pass_hz),
        ] {
            if !(got > 0.0 && got.is_finite()) {
                return Err(OnsetError::Setting { what, expected: positive, got });
            }
        }
        if !(self.high_pass_hz < 0.4 * rate_hz) {
            let expected = "below 0.4 of the sample rate";
            return Err(OnsetError::Setting {
                what: "the high-pass corner",
                expected,
                got: self.high_pass_hz,
            });
        }
        Ok(())
    }
}

/// Why onsets cannot be looked for.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum OnsetError {
    /// There is no channel.
    #[error("no channel, expected at least one")]
    NoChannel,
    /// The channels differ in length.
    #[error("channel {channel} has {got} samples, expected {expected} as in channel 0")]
    Length {
        /// Channel, from 0.
        channel: usize,
        /// Samples of channel 0.
        expected: usize,
        /// The channel's samples.
        got: usize,
    },
    /// A sample is no number.
    #[error("channel {channel}, sample {sample}: expected a finite number")]
    NotFinite {
        /// Channel, from 0.
        channel: usize,
        /// Sample, from 0.
        sample: usize,
    },
    /// A setting or the sample rate is out of its range.
    #[error("{what} is {got}, expected {expected}")]
    Setting {
        /// The setting.
        what: &'static str,
        /// What is taken.
        expected: &'static str,
        /// The value stated.
        got: f64,
    },
}
