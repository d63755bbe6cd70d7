//! What the tests of hearing share: where the practice recordings are, and sounds made by other means than the code under test.
#![allow(
    dead_code,
    clippy::too_many_arguments,
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, says what it saw, and does not use all of this"
)]

use std::f64::consts::PI;
use std::path::PathBuf;

/// A folder of the recordings in the repository.
pub(crate) fn bundled(folder: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../recordings").join(folder)
}

/// A folder of the data that lie beside the workspace.
pub(crate) fn shared(folder: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared").join(folder)
}

/// Uniform numbers in [0, 1) (Knuth's linear congruence with Numerical Recipes' constants, its upper bits).
pub(crate) struct Dice(pub(crate) u64);

impl Dice {
    pub(crate) fn roll(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Standard normal (Box and Muller).
    pub(crate) fn normal(&mut self) -> f64 {
        let (u, v) = (1.0 - self.roll(), self.roll());
        (-2.0 * u.ln()).sqrt() * (2.0 * PI * v).cos()
    }
}

/// A burst of sound as a sum of cosines of 3 to 8 kHz that starts at once and decays: exact at any instant, so that it can be
/// delayed by parts of a sample.
pub(crate) struct Burst {
    tones: Vec<(f64, f64, f64)>,
    pub(crate) decay_s: f64,
}

impl Burst {
    pub(crate) fn new(dice: &mut Dice) -> Self {
        let tone =
            |d: &mut Dice| (2.0 * PI * (3_000.0 + 5_000.0 * d.roll()), 2.0 * PI * d.roll(), d.normal());
        Self { tones: (0..60).map(|_| tone(dice)).collect(), decay_s: 1.5e-3 }
    }

    /// The pressure at a time (s) after its start.
    pub(crate) fn at(&self, t: f64) -> f64 {
        if t < 0.0 || t > 12.0 * self.decay_s {
            return 0.0;
        }
        // 0.1 ms of rise keeps it within the band.
        let rise = (t / 1e-4).min(1.0);
        let envelope = (-t / self.decay_s).exp() * (0.5 - 0.5 * (PI * rise).cos());
        envelope * self.tones.iter().map(|(w, p, a)| a * (w * t + p).cos()).sum::<f64>() / 8.0
    }
}

/// Adds an impact at a place on the table and a time (s) to channels of microphones, falling off as 1/r.
pub(crate) fn strike(
    channels: &mut [Vec<f64>],
    rate_hz: f64,
    microphones_m: &[[f64; 3]],
    speed_m_s: f64,
    place: [f64; 2],
    time_s: f64,
    burst: &Burst,
    loudness: f64,
) {
    for (x, m) in channels.iter_mut().zip(microphones_m) {
        let r = ((m[0] - place[0]).powi(2) + (m[1] - place[1]).powi(2) + m[2].powi(2)).sqrt();
        let arrival = time_s + r / speed_m_s;
        let from = (arrival * rate_hz) as usize;
        for (k, v) in x.iter_mut().enumerate().skip(from).take((20e-3 * rate_hz) as usize) {
            *v += loudness * 0.3 / r * burst.at(k as f64 / rate_hz - arrival);
        }
    }
}

/// White noise on every channel.
pub(crate) fn hiss(channels: &mut [Vec<f64>], sigma: f64, dice: &mut Dice) {
    channels.iter_mut().flatten().for_each(|v| *v += sigma * dice.normal());
}

/// A quantile of unordered values.
pub(crate) fn quantile(values: &[f64], q: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[((sorted.len() - 1) as f64 * q).round() as usize]
}
