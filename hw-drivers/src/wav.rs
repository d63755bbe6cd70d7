//! A WAV file as microphones.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use hw_traits::ErrorType;
use hw_traits::microphones::Microphones;

use crate::error::{DriverError, within};

/// Plays a WAV file back as fast as it is read; times begin at zero.
///
/// A read that the rest of the sound does not fill is an error of the kind [`hw_traits::ErrorKind::EndOfRecording`].
pub struct WavMicrophones {
    reader: hound::WavReader<BufReader<File>>,
    read: u64,
}

impl WavMicrophones {
    /// Opens a file of integers of up to 32 bits, or floats.
    ///
    /// # Errors
    /// [`DriverError::File`].
    pub fn open(path: impl AsRef<Path>) -> Result<Self, DriverError> {
        let file = path.as_ref().display().to_string();
        let reader = hound::WavReader::open(path);
        let reader = reader.map_err(|e| DriverError::File { file: file.clone(), words: e.to_string() })?;
        if reader.spec().channels == 0 || reader.spec().sample_rate == 0 {
            return Err(DriverError::File { file, words: "it has no channel, or no rate".into() });
        }
        Ok(Self { reader, read: 0 })
    }
}

impl ErrorType for WavMicrophones {
    type Error = DriverError;
}

impl Microphones for WavMicrophones {
    fn channels(&self) -> usize {
        usize::from(self.reader.spec().channels)
    }

    fn rate_hz(&self) -> f64 {
        f64::from(self.reader.spec().sample_rate)
    }

    fn read(&mut self, interleaved: &mut [f32]) -> Result<f64, DriverError> {
        let channels = self.channels();
        let instants = interleaved.len() / channels;
        within("instants of the buffer", instants as f64, 1.0, f64::MAX)?;
        let wanted = instants * channels;
        if (self.reader.len() as usize).saturating_sub(self.read as usize * channels) < wanted {
            return Err(DriverError::End);
        }
        let spec = self.reader.spec();
        let wrong = |e: hound::Error| DriverError::File { file: "WAV".into(), words: e.to_string() };
        let out = interleaved[..wanted].iter_mut();
        if spec.sample_format == hound::SampleFormat::Float {
            for (out, sample) in out.zip(self.reader.samples::<f32>()) {
                *out = sample.map_err(wrong)?.clamp(-1.0, 1.0);
            }
        } else {
            let largest = f64::from(spec.bits_per_sample.clamp(1, 32) - 1).exp2();
            for (out, sample) in out.zip(self.reader.samples::<i32>()) {
                *out = (f64::from(sample.map_err(wrong)?) / largest) as f32;
            }
        }
        let begin_s = self.read as f64 / self.rate_hz();
        self.read += instants as u64;
        Ok(begin_s)
    }
}
