//! Onsets as they come: buffer after buffer, without allocation.

use super::filter::HighPass;
use super::floor::Floor;
use super::jump::{Jump, Running, Stretches};
use super::{AROUND_S, Instant, OnsetError, OnsetSettings};

/// Jumps that are remembered for their echoes.
const REMEMBERED: usize = 32;
/// Sums are brought back to zero beyond this, so that their differences stay exact.
const LARGE: f64 = 1e12;
/// Channels that a stream may have.
const MOST_CHANNELS: usize = 64;

/// An onset in a stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Started {
    /// The instant in the channel that heard it first, on the clock of the samples.
    pub first: Instant,
    /// The sample just before it, counted from the stream's beginning; for [`OnsetStream::cut`].
    pub sample: usize,
    /// Greatest short-time amplitude, in standard deviations of the noise.
    pub amplitude_sigmas: f64,
}

/// Looks for onsets in a stream as [`Listened`](super::Listened) does in a recording; planned once, then nothing is allocated.
///
/// The noise is that of the last 3 s, and nothing is heard in the first 50 ms. An onset is reported once the samples that judging
/// needs are there: about 6 ms after it.
pub struct OnsetStream {
    rate_hz: f64,
    settings: OnsetSettings,
    stretches: Stretches,
    channels: usize,
    filters: Vec<HighPass>,
    floors: Vec<Floor>,
    /// Rings of `room` samples (a power of two), channel after channel: as they came, and filtered.
    raw: Vec<f64>,
    filtered: Vec<f64>,
    /// Sums of the energy before each sample.
    sums: Vec<f64>,
    room: usize,
    /// Samples so far, and the next one to be judged.
    count: usize,
    next: usize,
    /// Samples that have to follow one before it is judged.
    ahead: usize,
    /// Time of sample 0 as the last buffer has it, s.
    zero_s: f64,
    found: Vec<Jump>,
    running: Running,
    instants: Vec<Instant>,
}

impl OnsetStream {
    /// For a number of channels at a sample rate (Hz); `after_s` of sound are there after each onset that is reported, for
    /// [`OnsetStream::cut`] (at most 0.1 s).
    ///
    /// # Errors
    /// [`OnsetError`].
    pub fn new(
        channels: usize,
        rate_hz: f64,
        settings: OnsetSettings,
        after_s: f64,
    ) -> Result<Self, OnsetError> {
        settings.check(rate_hz)?;
        if channels == 0 {
            return Err(OnsetError::NoChannel);
        }
        let setting = |what, expected, got| Err(OnsetError::Setting { what, expected, got });
        if channels > MOST_CHANNELS {
            return setting("the number of channels", "at most 64", channels as f64);
        }
        if !(0.0..=0.1).contains(&after_s) {
            return setting("the time after an onset", "0 to 0.1 s", after_s);
        }
        if !(1e3..=1e6).contains(&rate_hz) {
            return setting("the sample rate", "1 kHz to 1 MHz", rate_hz);
        }
        let stretches = Stretches::new(rate_hz, &settings);
        let samples = |s: f64| (s * rate_hz).ceil() as usize;
        // An onset may be as late as the reach behind the sample that is judged.
        let ahead = stretches.reach + stretches.short + samples(AROUND_S.1).max(samples(after_s)) + 2;
        let behind = stretches.behind().max(samples(AROUND_S.0) + stretches.short);
        let room = (2 * (ahead + behind)).next_power_of_two();
        let around = samples(AROUND_S.0) + samples(AROUND_S.1);
        Ok(Self {
            rate_hz,
            settings,
            stretches,
            channels,
            filters: vec![HighPass::new(settings.high_pass_hz / rate_hz); channels],
            // Not cloned: a clone would have no room.
            floors: (0..channels).map(|_| Floor::new(rate_hz)).collect(),
            raw: vec![0.0; room * channels],
            filtered: vec![0.0; room * channels],
            sums: vec![0.0; room],
            room,
            count: 0,
            next: 0,
            ahead,
            zero_s: 0.0,
            found: Vec::with_capacity(REMEMBERED),
            running: Running::new(std::iter::repeat_n(0.0, around)),
            instants: vec![Instant { t_s: 0.0, sigma_s: 0.0 }; channels],
        })
    }

    /// Number of channels.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Takes the next samples, channel after channel for each instant, the first of them at `t_s` on their clock; calls `on` for each onset.
    ///
    /// After a gap in the times it starts anew, but keeps what it knows of the noise. A buffer with a sample that is no number is left out
    /// as a whole.
    ///
    /// # Errors
    /// [`OnsetError::NotFinite`]; [`OnsetError::Length`] for a buffer that is no whole number of instants.
    pub fn push(
        &mut self,
        t_s: f64,
        interleaved: &[f32],
        mut on: impl FnMut(&Self, &Started),
    ) -> Result<(), OnsetError> {
        let got = interleaved.len();
        if !got.is_multiple_of(self.channels) {
            let expected = got.next_multiple_of(self.channels);
            return Err(OnsetError::Length { channel: got % self.channels, expected, got });
        }
        if let Some(at) = interleaved.iter().position(|v| !v.is_finite()) {
            return Err(OnsetError::NotFinite { channel: at % self.channels, sample: at / self.channels });
        }
        let expected = self.zero_s + self.count as f64 / self.rate_hz;
        if self.count > 0 && !((t_s - expected).abs() < 1.5 / self.rate_hz) {
            (self.count, self.next) = (0, 0);
            self.found.clear();
        }
        self.zero_s = t_s - self.count as f64 / self.rate_hz;
        for frame in interleaved.chunks_exact(self.channels) {
            self.take(frame);
            if self.next + self.ahead <= self.count
                && let Some(started) = self.judge()
            {
                on(self, &started);
            }
        }
        Ok(())
    }

    /// When each channel heard the onset that was reported last.
    pub fn instants(&self) -> &[Instant] {
        &self.instants
    }

    /// The samples of a channel as they came, from one on; what the ring no longer or not yet holds is silence.
    pub fn cut(&self, channel: usize, from: isize, into: &mut [f64]) {
        self.copy(&self.raw, channel, from, into);
    }

    /// As [`OnsetStream::cut`], from the filtered sound.
    pub fn cut_filtered(&self, channel: usize, from: isize, into: &mut [f64]) {
        self.copy(&self.filtered, channel, from, into);
    }

    /// Time of a sample on their clock, s.
    pub fn time_s(&self, sample: f64) -> f64 {
        self.zero_s + sample / self.rate_hz
    }

    fn copy(&self, ring: &[f64], channel: usize, from: isize, into: &mut [f64]) {
        for (k, v) in into.iter_mut().enumerate() {
            *v = usize::try_from(from + k as isize).map_or(0.0, |i| self.at(ring, channel, i));
        }
    }

    fn at(&self, ring: &[f64], channel: usize, i: usize) -> f64 {
        let held = channel < self.channels && i < self.count && i + self.room >= self.count;
        if held { ring[channel * self.room + (i & (self.room - 1))] } else { 0.0 }
    }

    fn take(&mut self, frame: &[f32]) {
        let slot = self.count & (self.room - 1);
        let mut energy = 0.0;
        for (channel, &v) in frame.iter().enumerate() {
            let raw = f64::from(v);
            let filtered = self.filters[channel].step(raw);
            let floor = &mut self.floors[channel];
            floor.step(filtered);
            energy += (filtered / floor.sigma()).powi(2);
            self.raw[channel * self.room + slot] = raw;
            self.filtered[channel * self.room + slot] = filtered;
        }
        let sum = self.sums[slot] + energy / self.channels as f64;
        self.count += 1;
        self.sums[self.count & (self.room - 1)] = sum;
        if sum > LARGE {
            self.sums.iter_mut().for_each(|s| *s -= sum);
        }
    }

    /// Judges the next sample.
    fn judge(&mut self) -> Option<Started> {
        let k = self.next;
        self.next += 1;
        if !self.floors.iter().all(Floor::is_known) {
            return None;
        }
        let mask = self.room - 1;
        let mean =
            |a: usize, b: usize| ((self.sums[b & mask] - self.sums[a & mask]) / (b - a) as f64).max(0.0);
        let jump = self.stretches.judge(k, self.count, mean, &self.found, self.rate_hz, &self.settings)?;
        if self.found.len() == REMEMBERED {
            self.found.remove(0);
        }
        self.found.push(jump);
        self.next = k + self.stretches.refractory;
        let mut first = Instant { t_s: f64::INFINITY, sigma_s: f64::INFINITY };
        for channel in 0..self.channels {
            let instant = self.refine(channel, &jump);
            self.instants[channel] = instant;
            if instant.t_s < first.t_s {
                first = instant;
            }
        }
        let sample = ((first.t_s - self.zero_s) * self.rate_hz).max(0.0) as usize;
        Some(Started { first, sample, amplitude_sigmas: jump.level.sqrt() })
    }

    /// The change point of a channel near a jump, between samples by its posterior mean.
    fn refine(&mut self, channel: usize, jump: &Jump) -> Instant {
        let short = self.stretches.short;
        let (from, to) = (jump.at.saturating_sub(short), jump.at + self.stretches.reach);
        let loud =
            |i: usize| (i..i + short).map(|j| self.at(&self.filtered, channel, j).powi(2)).sum::<f64>();
        let peak = (from..to).map(|i| (loud(i), i)).fold((0.0, from), |a, b| if b.0 > a.0 { b } else { a });
        let samples = |s: f64| (s * self.rate_hz) as usize;
        let start = peak.1.saturating_sub(samples(AROUND_S.0));
        let scale = 1.0 / self.floors[channel].sigma();
        let end = peak.1 + samples(AROUND_S.1);
        let mut running = std::mem::replace(&mut self.running, Running::none());
        running.refill((start..end).map(|i| (scale * self.at(&self.filtered, channel, i)).powi(2)));
        let (at, sigma) = running.change(1.0, 1.0);
        self.running = running;
        Instant { t_s: self.time_s(start as f64 + at), sigma_s: sigma / self.rate_hz }
    }
}
