//! When impacts begin in a sound.
//!
//! The sound is high-passed by a causal filter, so that nothing rings before an onset, and its short-time energy over the noise
//! floor, summed over the channels, is searched for jumps: above the noise, above what came just before, and above the echoes that
//! the impacts before it may still send (a wall at 1.7 m answers after 10 ms, in the real sound that this was tried on with half
//! the amplitude or more). The onset itself is the change point of the variance: the instant that splits the sound
//! around it into two stretches of white Gaussian noise most probably (Maeda 1985's picker of seismic arrivals,
//! `L(k) = -(k ln v_before + (n - k) ln v_after) / 2`), its mean and spread taken over all instants, on eighths of a sample. The
//! filter and the rise of the sound leave a common bias of some 20 to 40 us, which times between impacts do not see.

mod filter;
mod floor;
mod jump;
mod settings;
mod stream;

pub use settings::{OnsetError, OnsetSettings};
pub use stream::{OnsetStream, Started};

use filter::{at, high_pass};
use jump::{Jump, Running, Stretches};

/// The stretch around an onset that the change point is looked for in: before it and after its loudest part, s.
const AROUND_S: (f64, f64) = (3e-3, 1e-3);
/// Instants a sample on which the change point is looked for.
const OVERSAMPLING: f64 = 8.0;

/// A sound in which impacts are looked for: high-passed, its noise measured.
pub struct Listened {
    rate_hz: f64,
    settings: OnsetSettings,
    channels: Vec<Vec<f64>>,
    sigmas: Vec<f64>,
}

/// An instant, with its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instant {
    /// From the first sample, s.
    pub t_s: f64,
    /// Standard deviation, s.
    pub sigma_s: f64,
}

/// A jump of the sound that an impact may have made.
#[derive(Debug, Clone, PartialEq)]
pub struct Onset {
    /// The instant in each channel.
    pub channels: Vec<Instant>,
    /// Greatest short-time amplitude, in standard deviations of the noise (root mean square over the channels).
    pub amplitude_sigmas: f64,
}

impl Onset {
    /// The instant in the channel that heard it first.
    pub fn first(&self) -> Instant {
        let none = Instant { t_s: f64::INFINITY, sigma_s: f64::INFINITY };
        self.channels.iter().copied().fold(none, |a, b| if b.t_s < a.t_s { b } else { a })
    }
}

impl Listened {
    /// Filters the channels of a sound (all of one length) and measures their noise.
    pub fn new(channels: &[Vec<f64>], rate_hz: f64, settings: OnsetSettings) -> Result<Self, OnsetError> {
        let expected = channels.first().ok_or(OnsetError::NoChannel)?.len();
        for (channel, x) in channels.iter().enumerate() {
            if x.len() != expected {
                return Err(OnsetError::Length { channel, expected, got: x.len() });
            }
            if let Some(sample) = x.iter().position(|v| !v.is_finite()) {
                return Err(OnsetError::NotFinite { channel, sample });
            }
        }
        settings.check(rate_hz)?;
        let channels: Vec<Vec<f64>> =
            channels.iter().map(|x| high_pass(x, settings.high_pass_hz / rate_hz)).collect();
        let sigmas = channels.iter().map(|x| noise(x, rate_hz)).collect();
        Ok(Self { rate_hz, settings, channels, sigmas })
    }

    /// Standard deviation of the high-passed noise of each channel.
    pub fn noise_sigmas(&self) -> &[f64] {
        &self.sigmas
    }

    /// All impacts, in order of time.
    pub fn onsets(&self) -> Vec<Onset> {
        let energy = Running::new(self.energy().into_iter());
        let n = energy.len();
        let stretches = Stretches::new(self.rate_hz, &self.settings);
        let mut found: Vec<Jump> = Vec::new();
        let mut k = 0;
        while k + stretches.short <= n {
            let mean = |from, to| energy.mean(from, to);
            match stretches.judge(k, n, mean, &found, self.rate_hz, &self.settings) {
                Some(jump) => {
                    found.push(jump);
                    k += stretches.refractory;
                }
                None => k += 1,
            }
        }
        found.iter().map(|jump| self.refine(jump, &stretches)).collect()
    }

    /// Mean over the channels of the squares over the noise's.
    fn energy(&self) -> Vec<f64> {
        let mut sum = vec![0.0; self.channels[0].len()];
        for (x, sigma) in self.channels.iter().zip(&self.sigmas) {
            let scale = 1.0 / (sigma * sigma * self.channels.len() as f64);
            sum.iter_mut().zip(x).for_each(|(s, v)| *s += scale * v * v);
        }
        sum
    }

    fn refine(&self, jump: &Jump, stretches: &Stretches) -> Onset {
        let short = stretches.short;
        let (from, to) = (jump.at.saturating_sub(short), jump.at + stretches.reach);
        let instant = |channel: usize| {
            let x = &self.channels[channel];
            let to = to.min(x.len().saturating_sub(short)).max(from + 1);
            let loud = |i: usize| x[i..(i + short).min(x.len())].iter().map(|v| v * v).sum::<f64>();
            let peak =
                (from..to).map(|i| (loud(i), i)).fold((0.0, from), |a, b| if b.0 > a.0 { b } else { a });
            let mut delays = vec![None; self.channels.len()];
            delays[channel] = Some(0.0);
            self.change(peak.1 as f64 / self.rate_hz, &delays)
        };
        Onset {
            channels: (0..self.channels.len()).map(instant).collect(),
            amplitude_sigmas: jump.level.sqrt(),
        }
    }

    /// The onset near an instant (s) of a sound that reaches each channel the given delay (s) after it; channels without one are
    /// not listened to.
    pub fn aligned(&self, near_s: f64, delays_s: &[f64]) -> Result<Instant, OnsetError> {
        if delays_s.len() != self.channels.len() {
            let got = delays_s.len() as f64;
            return Err(OnsetError::Setting { what: "the number of delays", expected: "one a channel", got });
        }
        let delays: Vec<Option<f64>> = delays_s.iter().copied().map(Some).collect();
        Ok(self.change(near_s, &delays))
    }

    fn change(&self, near_s: f64, delays_s: &[Option<f64>]) -> Instant {
        let fine = self.rate_hz * OVERSAMPLING;
        let n = ((AROUND_S.0 + AROUND_S.1) * fine) as usize;
        let start_s = near_s - AROUND_S.0;
        let mut energy = vec![0.0; n];
        for ((x, sigma), delay) in self.channels.iter().zip(&self.sigmas).zip(delays_s) {
            let Some(delay) = delay else { continue };
            for (k, e) in energy.iter_mut().enumerate() {
                let v = at(x, (start_s + delay) * self.rate_hz + k as f64 / OVERSAMPLING) / sigma;
                *e += v * v;
            }
        }
        let count = delays_s.iter().flatten().count().max(1) as f64;
        let (at, sigma) = Running::new(energy.into_iter()).change(count, OVERSAMPLING);
        Instant { t_s: start_s + at / self.rate_hz, sigma_s: sigma / self.rate_hz }
    }
}

/// Standard deviation of the noise: from the quieter stretches.
fn noise(x: &[f64], rate_hz: f64) -> f64 {
    let power = |b: &[f64]| b.iter().map(|v| v * v).sum::<f64>() / b.len().max(1) as f64;
    let mut blocks: Vec<f64> = x.chunks(floor::block(rate_hz)).map(power).collect();
    floor::sigma(&mut blocks, power(x))
}
