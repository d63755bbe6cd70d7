//! Jumps of the short-time energy: which of them an impact made, and when exactly.

use super::OnsetSettings;

/// Stretch over which the energy is averaged, s.
const SHORT_S: f64 = 0.5e-3;
/// What came just before: this stretch, s, with a gap from the instant itself, s.
const BEFORE_S: (f64, f64) = (4.5e-3, 0.5e-3);
/// How far apart one impact's sounds may reach the channels, s.
const SPREAD_S: f64 = 4e-3;
/// What counts as no sound next to an onset: this part of the noise's power, and of the mean power around the onset.
const QUIET: (f64, f64) = (1e-2, 1e-4);

/// Stretches in samples.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretches {
    pub(super) short: usize,
    before: usize,
    gap: usize,
    pub(super) refractory: usize,
    pub(super) reach: usize,
}

/// A jump that an impact made.
#[derive(Debug, Clone, Copy)]
pub(super) struct Jump {
    /// The sample where the energy first exceeds what is asked for.
    pub(super) at: usize,
    /// Greatest short-time energy.
    pub(super) level: f64,
    /// The sample where it is.
    loudest: usize,
}

impl Stretches {
    pub(super) fn new(rate_hz: f64, settings: &OnsetSettings) -> Self {
        let samples = |seconds: f64| (seconds * rate_hz).round() as usize;
        Self {
            short: samples(SHORT_S).max(2),
            before: samples(BEFORE_S.0),
            gap: samples(BEFORE_S.1),
            refractory: samples(settings.refractory_s).max(1),
            reach: samples(SPREAD_S),
        }
    }

    /// Samples before an instant that judging it looks at.
    pub(super) fn behind(&self) -> usize {
        self.before + self.gap
    }

    /// Whether an impact's sound begins at sample `k` of `n`: the energy's mean over a stretch, and the jumps before.
    pub(super) fn judge(
        &self,
        k: usize,
        n: usize,
        mean: impl Fn(usize, usize) -> f64,
        before: &[Jump],
        rate_hz: f64,
        settings: &OnsetSettings,
    ) -> Option<Jump> {
        let now = mean(k, k + self.short);
        if !(now > settings.threshold_sigmas.powi(2)) {
            return None;
        }
        // Before the recording there is noise.
        let end = k.saturating_sub(self.gap);
        let quiet = if end < self.short { 1.0 } else { mean(end.saturating_sub(self.before), end).max(1.0) };
        if !(now > settings.rise.powi(2) * quiet) {
            return None;
        }
        let (level, loudest) = (k..(k + self.reach).min(n - self.short + 1))
            .map(|i| (mean(i, i + self.short), i))
            .fold((0.0, k), |a, b| if b.0 > a.0 { b } else { a });
        let echo = |jump: &Jump| {
            let passed = (loudest.saturating_sub(jump.loudest)) as f64 / rate_hz;
            let left = |(part, decay): (f64, f64)| part * 10f64.powf(-0.05 * decay * passed);
            jump.level * left(settings.early_echo).max(left(settings.reverberation)).powi(2)
        };
        let echoes = before.iter().map(echo).fold(0.0, f64::max) > level;
        (!echoes).then_some(Jump { at: k, level, loudest })
    }
}

/// Sums from the start, for means of any stretch.
#[derive(Debug, Clone)]
pub(super) struct Running(Vec<f64>);

impl Running {
    pub(super) fn new(values: impl Iterator<Item = f64>) -> Self {
        let mut running = Self(Vec::with_capacity(values.size_hint().0 + 1));
        running.refill(values);
        running
    }

    /// Sums of nothing, in no memory.
    pub(super) fn none() -> Self {
        Self(Vec::new())
    }

    /// Sums of other values, in the same memory where they are no more than before.
    pub(super) fn refill(&mut self, values: impl Iterator<Item = f64>) {
        self.0.clear();
        let mut sum = 0.0;
        self.0.push(sum);
        for v in values {
            sum += v;
            self.0.push(sum);
        }
    }

    pub(super) fn len(&self) -> usize {
        self.0.len() - 1
    }

    pub(super) fn mean(&self, from: usize, to: usize) -> f64 {
        ((self.0[to] - self.0[from]) / (to - from) as f64).max(0.0)
    }

    /// Where the variance changes most probably: mean and standard deviation over all places, in samples of the original rate of which
    /// there are `oversampling` values each. The values are sums over `count` channels of squares over the noise's.
    pub(super) fn change(&self, count: f64, oversampling: f64) -> (f64, f64) {
        let n = self.len();
        // A stretch of a few samples has no variance to speak of.
        let edge = (4.0 * oversampling) as usize;
        let quiet = QUIET.0 + QUIET.1 * self.mean(0, n) / count;
        let log = |a: usize, b: usize| (self.mean(a, b) / count + quiet).ln();
        let likelihood = |k: usize| {
            let (before, after) = (k as f64, (n - k) as f64);
            -0.5 * count * (before * log(0, k) + after * log(k, n)) / oversampling
        };
        let range = edge..n.saturating_sub(edge);
        let best = range.clone().map(likelihood).fold(f64::NEG_INFINITY, f64::max);
        let (mut w, mut first, mut second) = (0.0, 0.0, 0.0);
        for k in range {
            let p = (likelihood(k) - best).exp();
            let t = k as f64 / oversampling;
            w += p;
            first += p * t;
            second += p * t * t;
        }
        let (mean, square) = (first / w, second / w);
        let grain = 1.0 / (12.0 * oversampling * oversampling);
        (mean, ((square - mean * mean).max(0.0) + grain).sqrt())
    }
}
