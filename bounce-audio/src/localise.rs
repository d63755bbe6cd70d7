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
mod error;
mod location;
mod peak;
mod rival;
mod space;
mod survey;

pub use array::{Array, ArrayError};
pub use error::LocaliseError;
pub use location::Location;
pub use rival::speed_of_sound_m_s;
pub use space::{SpaceLocation, locate_in_space};
pub use survey::{Survey, SurveyError, SurveyPrior, Tap, survey};

use correlate::Correlator;

/// The band that is listened to, Hz, cut at 0.49 of the sample rate.
pub const BAND_HZ: (f64, f64) = (1_000.0, 15_000.0);
/// How far beyond the distance of two microphones a lag may lie (their positions and the speed of sound may be off).
const LAG_MARGIN: f64 = 1.1;

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
