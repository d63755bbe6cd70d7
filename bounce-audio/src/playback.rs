//! A recording behind the microphones' trait: what was written for hardware runs on it unchanged.

use crate::wav::Sound;
use hw_traits::microphones::Microphones;
use hw_traits::{ErrorKind, ErrorType};

/// Plays a sound back as fast as it is read; its clock starts at 0 with the first sample.
///
/// A read that the rest of the sound does not fill is an error of the kind [`ErrorKind::EndOfRecording`]: nothing is made up.
///
/// ```
/// use bounce_audio::playback::Playback;
/// use bounce_audio::wav::Sound;
/// use hw_traits::{ErrorKind, microphones::Microphones};
///
/// let sound = Sound { rate_hz: 1000.0, channels: vec![vec![0.1, 0.2, 0.3], vec![-0.1, -0.2, -0.3]] };
/// let mut microphones = Playback::new(sound);
/// let mut two = [0.0; 4];
/// assert_eq!(microphones.read(&mut two), Ok(0.0));
/// assert_eq!(two, [0.1, -0.1, 0.2, -0.2]);
/// assert_eq!(microphones.read(&mut two), Err(ErrorKind::EndOfRecording));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Playback {
    sound: Sound,
    at: usize,
}

impl Playback {
    /// Plays a sound from its beginning.
    pub fn new(sound: Sound) -> Self {
        Self { sound, at: 0 }
    }
}

impl ErrorType for Playback {
    type Error = ErrorKind;
}

impl Microphones for Playback {
    fn channels(&self) -> usize {
        self.sound.channels.len()
    }

    fn rate_hz(&self) -> f64 {
        self.sound.rate_hz
    }

    fn read(&mut self, interleaved: &mut [f32]) -> Result<f64, ErrorKind> {
        let channels = self.channels();
        if channels == 0 || interleaved.len() < channels {
            return Err(ErrorKind::OutOfRange);
        }
        let (from, to) = (self.at, self.at + interleaved.len() / channels);
        if self.sound.channels.iter().any(|x| x.len() < to) {
            return Err(ErrorKind::EndOfRecording);
        }
        for (i, frame) in (from..to).zip(interleaved.chunks_exact_mut(channels)) {
            for (v, x) in frame.iter_mut().zip(&self.sound.channels) {
                *v = x[i] as f32;
            }
        }
        self.at = to;
        Ok(from as f64 / self.sound.rate_hz)
    }
}
