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
mod settings;

pub use settings::{OnsetError, OnsetSettings};

use filter::{at, high_pass};

/// Stretch over which the energy is averaged, s.
const SHORT_S: f64 = 0.5e-3;
/// What came just before: this stretch, s, with a gap from the instant itself, s.
const BEFORE_S: (f64, f64) = (4.5e-3, 0.5e-3);
/// How far apart one impact's sounds may reach the channels, s.
const SPREAD_S: f64 = 4e-3;
/// The stretch around an onset that the change point is looked for in: before it and after its loudest part, s.
const AROUND_S: (f64, f64) = (3e-3, 1e-3);
/// Instants a sample on which the change point is looked for.
const OVERSAMPLING: f64 = 8.0;
/// Blocks of the noise floor, s; their quantile that is taken, and what it is of the mean for such blocks of noise.
const FLOOR: (f64, f64, f64) = (2e-3, 0.2, 0.85);
/// What counts as no sound next to an onset: this part of the noise's power, and of the mean power around the onset.
const QUIET: (f64, f64) = (1e-2, 1e-4);
/// The noise is at least this part of a channel's root mean square, so that digital silence is a floor too.
const LEAST_NOISE: f64 = 1e-4;

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
        let positive = "a finite number above 0";
        for (what, got) in [
            ("the sample rate", rate_hz),
            ("the threshold", settings.threshold_sigmas),
            ("the rise", settings.rise),
            ("the refractory time", settings.refractory_s),
            ("the high-pass corner", settings.high_pass_hz),
        ] {
            if !(got > 0.0 && got.is_finite()) {
                return Err(OnsetError::Setting { what, expected: positive, got });
            }
        }
        if !(settings.high_pass_hz < 0.4 * rate_hz) {
            let expected = "below 0.4 of the sample rate";
            return Err(OnsetError::Setting {
                what: "the high-pass corner",
                expected,
                got: settings.high_pass_hz,
            });
        }
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
        let s = &self.settings;
        let energy = Running::new(&self.energy());
        let n = energy.len();
        let short = self.samples(SHORT_S).max(2);
        let (before, gap) = (self.samples(BEFORE_S.0), self.samples(BEFORE_S.1));
        let refractory = self.samples(s.refractory_s).max(1);
        let reach = self.samples(SPREAD_S);
        let mut found: Vec<(usize, f64, usize)> = Vec::new();
        let mut k = 0;
        while k + short <= n {
            let now = energy.mean(k, k + short);
            // Before the recording there is noise.
            let end = k.saturating_sub(gap);
            let quiet = if end < short { 1.0 } else { energy.mean(end.saturating_sub(before), end).max(1.0) };
            if !(now > s.threshold_sigmas.powi(2) && now > s.rise.powi(2) * quiet) {
                k += 1;
                continue;
            }
            let loudest = (k..(k + reach).min(n - short + 1))
                .map(|i| (energy.mean(i, i + short), i))
                .fold((0.0, k), |a, b| if b.0 > a.0 { b } else { a });
            let echo = |&(_, level, at): &(usize, f64, usize)| {
                let passed = (loudest.1.saturating_sub(at)) as f64 / self.rate_hz;
                let left = |(part, decay): (f64, f64)| part * 10f64.powf(-0.05 * decay * passed);
                level * left(s.early_echo).max(left(s.reverberation)).powi(2)
            };
            if found.iter().map(echo).fold(0.0, f64::max) > loudest.0 {
                k += 1;
                continue;
            }
            found.push((k, loudest.0, loudest.1));
            k += refractory;
        }
        found.iter().map(|&(k, level, _)| self.refine(k, level)).collect()
    }

    fn samples(&self, seconds: f64) -> usize {
        (seconds * self.rate_hz).round() as usize
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

    fn refine(&self, near: usize, level: f64) -> Onset {
        let short = self.samples(SHORT_S).max(2);
        let (from, to) = (near.saturating_sub(short), near + self.samples(SPREAD_S));
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
        Onset { channels: (0..self.channels.len()).map(instant).collect(), amplitude_sigmas: level.sqrt() }
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
        let total = Running::new(&energy);
        // A stretch of a few samples has no variance to speak of.
        let edge = (4.0 * OVERSAMPLING) as usize;
        let quiet = QUIET.0 + QUIET.1 * total.mean(0, n) / count;
        let log = |a: usize, b: usize| (total.mean(a, b) / count + quiet).ln();
        let likelihood = |k: usize| {
            let (before, after) = (k as f64, (n - k) as f64);
            -0.5 * count * (before * log(0, k) + after * log(k, n)) / OVERSAMPLING
        };
        let range = edge..n.saturating_sub(edge);
        let best = range.clone().map(likelihood).fold(f64::NEG_INFINITY, f64::max);
        let (mut w, mut first, mut second) = (0.0, 0.0, 0.0);
        for k in range {
            let p = (likelihood(k) - best).exp();
            let t = k as f64 / fine;
            w += p;
            first += p * t;
            second += p * t * t;
        }
        let (mean, square) = (first / w, second / w);
        let sigma_s = ((square - mean * mean).max(0.0) + 1.0 / (12.0 * fine * fine)).sqrt();
        Instant { t_s: start_s + mean, sigma_s }
    }
}

/// Sums from the start, for means of any stretch.
struct Running(Vec<f64>);

impl Running {
    fn new(values: &[f64]) -> Self {
        let mut sums = Vec::with_capacity(values.len() + 1);
        let mut sum = 0.0;
        sums.push(sum);
        for v in values {
            sum += v;
            sums.push(sum);
        }
        Self(sums)
    }

    fn len(&self) -> usize {
        self.0.len() - 1
    }

    fn mean(&self, from: usize, to: usize) -> f64 {
        ((self.0[to] - self.0[from]) / (to - from) as f64).max(0.0)
    }
}

/// Standard deviation of the noise: from the quieter stretches.
fn noise(x: &[f64], rate_hz: f64) -> f64 {
    let power = |b: &[f64]| b.iter().map(|v| v * v).sum::<f64>() / b.len().max(1) as f64;
    let all = power(x);
    let mut blocks: Vec<f64> = x.chunks(((FLOOR.0 * rate_hz) as usize).max(8)).map(power).collect();
    blocks.sort_by(f64::total_cmp);
    let quiet = blocks.get((FLOOR.1 * blocks.len() as f64) as usize).copied().unwrap_or(0.0) / FLOOR.2;
    quiet.max(LEAST_NOISE.powi(2) * all).max(1e-24).sqrt()
}
