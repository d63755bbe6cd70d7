//! Where on the table an impact was: time differences of arrival at three or more microphones, and the place that fits them.
//!
//! The phase transform (Knapp and Carter 1976, doi:10.1109/TASSP.1976.1162830) whitens the cross-spectrum of two microphones,
//! so echoes and the colour of the sound count little; bins below the noise count less (their weight is
//! `1 / (|G| + k sqrt(N_i N_j))`). The peak is found on a lattice of half samples and refined by Newton's method on the
//! band-limited correlation itself. The place solves `t_i = t_0 + |m_i - p| / c` with `p` on the table, z = 0.
//!
//! Three microphones determine the place and leave nothing over: a wrong microphone position or speed of sound leaves no trace.
//! Four or more leave a residual.

mod array;
mod correlate;
mod peak;
mod rival;
mod space;
mod survey;

pub use array::{Array, ArrayError};
pub use rival::speed_of_sound_m_s;
pub use space::{SpaceLocation, locate_in_space};
pub use survey::{Survey, SurveyError, SurveyPrior, Tap, survey};

use correlate::Correlator;
use thiserror::Error;

/// The band that is listened to, Hz, cut at 0.49 of the sample rate.
pub const BAND_HZ: (f64, f64) = (1_000.0, 15_000.0);
/// How far beyond the distance of two microphones a lag may lie (their positions and the speed of sound may be off).
const LAG_MARGIN: f64 = 1.1;

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

/// A place on the table, from one impact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Location {
    /// Place, m.
    pub x_m: f64,
    /// Place, m.
    pub y_m: f64,
    /// Covariance of (x, y), m^2, from the scatter of the phases in the band.
    pub covariance_m2: [[f64; 2]; 2],
    /// Standard deviation of one microphone's arrival, s.
    pub arrival_sigma_s: f64,
    /// What is left of the arrivals after the place was fitted, root of the sum of squares over the degrees of freedom
    /// (microphones less 3), s; `None` with three microphones, which leave nothing.
    pub residual_s: Option<f64>,
    /// How far the time differences are from adding up around triangles, root mean square over the pairs, s.
    pub closure_s: f64,
    /// How well the phases of the channels agree with delays of one sound, in the pair that agrees least: 1 for one source without noise
    /// or echoes, near 0.3 for sounds that have nothing to do with each other.
    pub coherence: f64,
}

/// Localises impacts from buffers of one length: planned once, then run without allocation.
pub struct Localiser {
    array: Array,
    correlator: Correlator,
    arrivals_s: Vec<f64>,
}

impl Localiser {
    /// Plans for microphones at the given positions (m, table at z = 0), a sample rate (Hz), a speed of sound (m/s) and buffers of
    /// the given length (samples; 8 to 11 ms are good), in [`BAND_HZ`].
    pub fn new(
        microphones_m: &[[f64; 3]],
        rate_hz: f64,
        speed_of_sound_m_s: f64,
        buffer: usize,
    ) -> Result<Self, LocaliseError> {
        Self::in_band(microphones_m, rate_hz, speed_of_sound_m_s, buffer, BAND_HZ)
    }

    /// As [`Localiser::new`], in a band of one's own, Hz.
    pub fn in_band(
        microphones_m: &[[f64; 3]],
        rate_hz: f64,
        speed_of_sound_m_s: f64,
        buffer: usize,
        band_hz: (f64, f64),
    ) -> Result<Self, LocaliseError> {
        let array = Array::new(microphones_m, speed_of_sound_m_s)?;
        let longest = array.longest_lag_s() * LAG_MARGIN;
        let correlator = Correlator::new(microphones_m.len(), rate_hz, buffer, band_hz, longest, |i, j| {
            array.lag_s(i, j) * LAG_MARGIN
        })?;
        Ok(Self { array, correlator, arrivals_s: vec![0.0; microphones_m.len()] })
    }

    /// The buffer's length, samples.
    pub fn buffer(&self) -> usize {
        self.correlator.buffer()
    }

    /// The microphones.
    pub fn array(&self) -> &Array {
        &self.array
    }

    /// The place of the one impact in the buffer: one slice a microphone, each as long as the buffer, starting 1 to 2 ms before
    /// the sound reaches the first one (the first eighth is taken for noise).
    ///
    /// # Errors
    /// [`LocaliseError::Channels`], [`LocaliseError::Length`], [`LocaliseError::Energy`].
    pub fn locate(&mut self, channels: &[&[f64]]) -> Result<Location, LocaliseError> {
        self.delays_s(channels)?;
        Ok(self.place())
    }

    /// The time delays alone: when the sound in the buffer reached each microphone, s from the mean of all of them.
    ///
    /// # Errors
    /// As [`Localiser::locate`].
    pub fn delays_s(&mut self, channels: &[&[f64]]) -> Result<&[f64], LocaliseError> {
        let (expected, got) = (self.arrivals_s.len(), channels.len());
        if expected != got {
            return Err(LocaliseError::Channels { expected, got });
        }
        let expected = self.buffer();
        for (channel, x) in channels.iter().enumerate() {
            if x.len() != expected {
                return Err(LocaliseError::Length { channel, expected, got: x.len() });
            }
        }
        self.correlator.listen(|channel| channels[channel])?;
        self.settle();
        Ok(&self.arrivals_s)
    }

    /// As [`Localiser::locate`], from channels that lie one after another.
    ///
    /// # Errors
    /// [`LocaliseError::Length`], [`LocaliseError::Energy`].
    pub fn locate_planar(&mut self, samples: &[f64]) -> Result<Location, LocaliseError> {
        let buffer = self.buffer();
        let expected = buffer * self.arrivals_s.len();
        if samples.len() != expected {
            return Err(LocaliseError::Length { channel: 0, expected, got: samples.len() });
        }
        self.correlator.listen(|channel| &samples[channel * buffer..][..buffer])?;
        self.settle();
        Ok(self.place())
    }

    /// One arrival a microphone from the lags of all pairs, by least squares.
    fn settle(&mut self) {
        let n = self.arrivals_s.len();
        for i in 0..n {
            self.arrivals_s[i] = (0..n).map(|j| self.correlator.lag_s(i, j)).sum::<f64>() / n as f64;
        }
    }

    /// The place that fits the arrivals.
    fn place(&self) -> Location {
        let n = self.arrivals_s.len();
        let mut open = 0.0;
        for i in 0..n {
            for j in 0..i {
                let off = self.correlator.lag_s(i, j) - (self.arrivals_s[i] - self.arrivals_s[j]);
                open += off * off;
            }
        }
        let closure_s = (open / (n * (n - 1) / 2) as f64).sqrt();
        let (sigma, coherence) = (self.correlator.arrival_sigma_s(), self.correlator.coherence());
        self.array.location(&self.arrivals_s, sigma, closure_s, coherence)
    }

    /// When the impact that was localised last reached each microphone, s from the mean of all of them.
    pub fn arrivals_s(&self) -> &[f64] {
        &self.arrivals_s
    }
}
