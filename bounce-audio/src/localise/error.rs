use super::array::ArrayError;
use thiserror::Error;

/// Why an impact cannot be localised.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum LocaliseError {
    /// The microphones do not determine a place.
    #[error(transparent)]
    Array(#[from] ArrayError),
    /// The sample rate is not one that holds the band.
    #[error("sample rate {got} Hz, expected more than {expected} Hz")]
    Rate {
        /// Least rate, Hz.
        expected: f64,
        /// Rate stated, Hz.
        got: f64,
    },
    /// The band is empty or holds too few frequencies of the buffer.
    #[error("a band of {bins} frequencies, expected at least {expected}")]
    Band {
        /// Least number of frequencies.
        expected: usize,
        /// Number in the band.
        bins: usize,
    },
    /// The buffer is too short for the sound to reach all microphones, or absurdly long.
    #[error("a buffer of {got} samples, expected {least} to {most}")]
    Buffer {
        /// Least length, samples.
        least: usize,
        /// Greatest length, samples.
        most: usize,
        /// Length asked for, samples.
        got: usize,
    },
    /// Not one channel a microphone.
    #[error("{got} channels, expected {expected}")]
    Channels {
        /// Number of microphones.
        expected: usize,
        /// Number of channels.
        got: usize,
    },
    /// A channel is not as long as the buffer.
    #[error("channel {channel} has {got} samples, expected {expected}")]
    Length {
        /// Channel, from 0.
        channel: usize,
        /// The buffer's length, samples.
        expected: usize,
        /// The channel's length, samples.
        got: usize,
    },
    /// A channel holds no sound, or a sample that is no number.
    #[error("channel {channel} has energy {got} in the band, expected a finite value above 0")]
    Energy {
        /// Channel, from 0.
        channel: usize,
        /// Energy found.
        got: f64,
    },
}
