//! Microphones of this computer, by the crate `cpal` (ALSA on Linux, whose headers have to be there; WASAPI, CoreAudio).

use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, Instant};

use cpal::traits::{DeviceTrait as _, HostTrait as _, StreamTrait as _};
use hw_traits::ErrorType;
use hw_traits::microphones::Microphones;

use crate::error::{DriverError, within};

/// Blocks that may wait; what does not fit is lost, and the times say so.
const BLOCKS: usize = 256;

/// A block of samples with the number of its first instant.
type Block = (u64, Vec<f32>);

/// The default microphones of this computer, at their own rate.
pub struct SoundCard {
    _stream: cpal::Stream,
    blocks: Receiver<Block>,
    waiting: Vec<f32>,
    /// The instant of the first sample that waits.
    first: u64,
    channels: usize,
    rate_hz: f64,
    timeout: Duration,
}

impl SoundCard {
    /// Opens the default input; a buffer is waited for `timeout_s` beyond its own length.
    ///
    /// # Errors
    /// [`DriverError::Device`] where there is no microphone that gives floats, and what the system says else.
    pub fn open(timeout_s: f64) -> Result<Self, DriverError> {
        within("timeout in s", timeout_s, 1e-3, 10.0)?;
        let none = |words| DriverError::Device { device: "microphones".into(), words, code: 0 };
        let device = cpal::default_host().default_input_device().ok_or_else(|| none("there is none"))?;
        let config = device.default_input_config().map_err(|_| none("it has no configuration"))?;
        let (channels, rate) = (usize::from(config.channels()), config.sample_rate());
        within("channels", channels as f64, 1.0, 1024.0)?;
        let (sender, blocks): (SyncSender<Block>, _) = sync_channel(BLOCKS);
        let mut heard = 0u64;
        let take = move |samples: &[f32], _: &cpal::InputCallbackInfo| {
            // A full queue loses a block; the number of its instants is kept.
            let _ = sender.try_send((heard, samples.to_vec()));
            heard += (samples.len() / channels) as u64;
        };
        let stream = device
            .build_input_stream(&config.into(), take, |_| (), None)
            .map_err(|_| none("it does not give floats"))?;
        stream.play().map_err(|_| none("it does not start"))?;
        let timeout = Duration::from_secs_f64(timeout_s);
        let (waiting, rate_hz) = (Vec::new(), f64::from(rate));
        Ok(Self { _stream: stream, blocks, waiting, first: 0, channels, rate_hz, timeout })
    }
}

impl ErrorType for SoundCard {
    type Error = DriverError;
}

/// Times count the card's own samples.
impl Microphones for SoundCard {
    fn channels(&self) -> usize {
        self.channels
    }

    fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    fn read(&mut self, interleaved: &mut [f32]) -> Result<f64, DriverError> {
        let instants = interleaved.len() / self.channels;
        within("instants of the buffer", instants as f64, 1.0, f64::MAX)?;
        let (wanted, begin) = (instants * self.channels, Instant::now());
        let patience = self.timeout + Duration::from_secs_f64(instants as f64 / self.rate_hz);
        while self.waiting.len() < wanted {
            let rest = patience.saturating_sub(begin.elapsed());
            match self.blocks.recv_timeout(rest) {
                Ok((number, samples)) => {
                    let next = self.first + (self.waiting.len() / self.channels) as u64;
                    if number != next || self.waiting.is_empty() {
                        // After a gap a new stretch begins.
                        (self.first, self.waiting) = (number, Vec::new());
                    }
                    self.waiting.extend(samples.iter().map(|s| s.clamp(-1.0, 1.0)));
                }
                Err(RecvTimeoutError::Timeout) => {
                    let waited_s = patience.as_secs_f64();
                    return Err(DriverError::Late { device: "microphones".into(), waited_s });
                }
                Err(RecvTimeoutError::Disconnected) => {
                    let (device, error) = ("microphones".into(), std::io::ErrorKind::NotConnected);
                    return Err(DriverError::Link { device, what: "listen", error });
                }
            }
        }
        for (out, sample) in interleaved.iter_mut().zip(self.waiting.drain(..wanted)) {
            *out = sample;
        }
        let begin_s = self.first as f64 / self.rate_hz;
        self.first += instants as u64;
        Ok(begin_s)
    }
}
