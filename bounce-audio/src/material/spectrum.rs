//! Features of one impact's sound that do not depend on its loudness: how the spectrum falls from band to band, how fast bands fade, and how
//! much of a band is one tone.

use rustfft::num_complex::Complex64;
use rustfft::{Fft, FftPlanner};
use std::f64::consts::PI;
use std::sync::Arc;

use super::contact;

/// Lowest edge of the bands, Hz; bands are half an octave wide.
const LOWEST_HZ: f64 = 300.0;
/// Half octaves.
pub(super) const BANDS: usize = 12;
/// Whole octaves: every second band with its neighbour.
const OCTAVES: usize = BANDS / 2;
/// Bands that are searched for a tone, Hz.
const TONES_HZ: [[f64; 2]; 2] = [[600.0, 2_400.0], [2_400.0, 14_400.0]];
/// Features of a sound: slopes, fading, tones, contact time.
pub(super) const FEATURES: usize = BANDS - 1 + OCTAVES + TONES_HZ.len() + 1;
/// Which of them is the contact time's.
pub(super) const CONTACT: usize = FEATURES - 1;
/// From this long before the onset to this long after it, s: the impact; from there to the end: how it fades.
const EARLY_S: [f64; 2] = [-1e-3, 9e-3];
pub(super) const LATE_S: f64 = 25e-3;
/// Share of the sample rate up to which a spectrum is believed.
const SHARE: f64 = 0.45;
/// The contact time is read from here on, Hz, where the sound is louder than the noise by this ratio.
const CONTACT_HZ: f64 = 120.0;
const HEARD: f64 = 4.0;
/// Least part of the noise that is left where it is taken off.
const FLOOR: f64 = 0.2;

/// What one impact sounds like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Timbre {
    /// Features; NaN for one that the sample rate does not show.
    pub(super) features: [f64; FEATURES],
    /// Mean power of all bands over the noise.
    pub(super) over_noise: f64,
}

/// Powers of bands: of the impact and of what follows, and a fine spectrum of both together.
struct Powers {
    early: [f64; BANDS],
    late: [f64; BANDS],
    fine: Vec<f64>,
}

/// The middle of a band, Hz.
pub(super) fn middle_hz(band: usize) -> f64 {
    LOWEST_HZ * f64::exp2(0.5 * band as f64 + 0.25)
}

/// Measures spectra at a sample rate.
pub(super) struct Analyser {
    rate_hz: f64,
    fft: Arc<dyn Fft<f64>>,
    noise: Powers,
}

impl Analyser {
    /// For a channel, whose quieter stretches are its noise.
    pub(super) fn new(x: &[f64], rate_hz: f64) -> Self {
        // The spectrum has bins of 25 Hz or so, by zeros behind the sound.
        let n = ((rate_hz / 25.0) as usize).next_power_of_two();
        let empty = Powers { early: [0.0; BANDS], late: [0.0; BANDS], fine: Vec::new() };
        let mut analyser = Self { rate_hz, fft: FftPlanner::new().plan_fft_forward(n), noise: empty };
        let stretch_s = LATE_S - EARLY_S[0];
        let count = ((x.len() as f64 / rate_hz / stretch_s) as usize).max(1);
        let all: Vec<Powers> =
            (0..count).map(|k| analyser.powers(x, k as f64 * stretch_s - EARLY_S[0])).collect();
        // The lower third of the stretches, each by itself: an impact is not in them.
        let mut order: Vec<usize> = (0..count).collect();
        let loudness = |p: &Powers| p.early.iter().chain(&p.late).sum::<f64>();
        order.sort_by(|&a, &b| loudness(&all[a]).total_cmp(&loudness(&all[b])));
        order.truncate((count / 3).max(1));
        let mean = |get: &dyn Fn(&Powers) -> f64| {
            order.iter().map(|&i| get(&all[i])).sum::<f64>() / order.len() as f64
        };
        let tiny = 1e-20;
        analyser.noise = Powers {
            early: std::array::from_fn(|k| mean(&|p: &Powers| p.early[k]).max(tiny)),
            late: std::array::from_fn(|k| mean(&|p: &Powers| p.late[k]).max(tiny)),
            fine: (0..n / 2).map(|k| mean(&|p: &Powers| p.fine[k]).max(tiny)).collect(),
        };
        analyser
    }

    fn hz(&self, bin: usize) -> f64 {
        bin as f64 * self.rate_hz / self.fft.len() as f64
    }

    /// Power spectrum of a stretch between two times (s), its first and last tenth faded.
    fn power(&self, x: &[f64], from_s: f64, to_s: f64) -> Vec<f64> {
        let start = (from_s * self.rate_hz).round() as isize;
        let n = ((to_s - from_s) * self.rate_hz).round() as usize;
        let fade = (n / 10).max(1);
        let mut z = vec![Complex64::default(); self.fft.len()];
        for (k, z) in z.iter_mut().enumerate().take(n) {
            let at = usize::try_from(start + k as isize).ok().and_then(|i| x.get(i));
            let edge = k.min(n - 1 - k);
            let window = if edge < fade { 0.5 - 0.5 * (PI * edge as f64 / fade as f64).cos() } else { 1.0 };
            z.re = window * at.copied().unwrap_or(0.0);
        }
        self.fft.process(&mut z);
        z.iter().take(self.fft.len() / 2).map(Complex64::norm_sqr).collect()
    }

    fn powers(&self, x: &[f64], onset_s: f64) -> Powers {
        let [begin, middle] = EARLY_S;
        let early = self.power(x, onset_s + begin, onset_s + middle);
        let late = self.power(x, onset_s + middle, onset_s + LATE_S);
        let bands = |power: &[f64]| {
            std::array::from_fn(|band| {
                let edges = [band as f64, band as f64 + 1.0].map(|k| LOWEST_HZ * f64::exp2(0.5 * k));
                self.bins(edges).filter_map(|k| power.get(k)).sum()
            })
        };
        Powers {
            early: bands(&early),
            late: bands(&late),
            fine: early.iter().zip(&late).map(|(a, b)| a + b).collect(),
        }
    }

    fn bins(&self, [low, high]: [f64; 2]) -> std::ops::Range<usize> {
        let bin = |hz: f64| (hz * self.fft.len() as f64 / self.rate_hz).ceil() as usize;
        bin(low)..bin(high)
    }

    /// Bands that the sample rate shows.
    fn shown(&self) -> usize {
        (0..BANDS)
            .take_while(|k| LOWEST_HZ * f64::exp2(0.5 * (*k as f64 + 1.0)) <= SHARE * self.rate_hz)
            .count()
    }

    /// What the impact that began at a time (s) sounds like.
    pub(super) fn timbre(&self, x: &[f64], onset_s: f64) -> Timbre {
        let powers = self.powers(x, onset_s);
        let without = |power: f64, noise: f64| (power - noise).max(FLOOR * noise);
        let clean = |power: &[f64; BANDS], noise: &[f64; BANDS]| -> [f64; BANDS] {
            std::array::from_fn(|k| without(power[k], noise[k]))
        };
        let early = clean(&powers.early, &self.noise.early);
        let late = clean(&powers.late, &self.noise.late);
        let fine: Vec<f64> = powers.fine.iter().zip(&self.noise.fine).map(|(p, n)| without(*p, *n)).collect();
        let shown = self.shown();
        let mut features = [f64::NAN; FEATURES];
        for k in 1..shown {
            features[k - 1] = (early[k] / early[k - 1]).ln();
        }
        for k in 0..shown / 2 {
            let pair = |p: &[f64; BANDS]| p[2 * k] + p[2 * k + 1];
            features[BANDS - 1 + k] = (pair(&late) / pair(&early)).ln();
        }
        for (k, tones) in TONES_HZ.iter().enumerate() {
            if tones[1] <= SHARE * self.rate_hz {
                features[BANDS - 1 + OCTAVES + k] = prominence(&fine[self.bins(*tones)]);
            }
        }
        let heard = |k: &usize| powers.fine[*k] > HEARD * self.noise.fine[*k];
        let spectrum: Vec<[f64; 2]> = (1..fine.len())
            .filter(heard)
            .map(|k| [self.hz(k), fine[k]])
            .filter(|[hz, _]| *hz >= CONTACT_HZ && *hz <= SHARE * self.rate_hz)
            .collect();
        features[CONTACT] = contact::fitted(&spectrum).ln();
        let noise = self.noise.early[..shown].iter().sum::<f64>();
        Timbre { features, over_noise: powers.early[..shown].iter().sum::<f64>() / noise }
    }

    /// Whether the rate shows enough: an octave and a half above 1 kHz.
    pub(super) fn least_rate_hz() -> f64 {
        2_400.0 / SHARE
    }
}

/// Logarithm of the largest over the mean power, of powers smoothed over three bins.
fn prominence(power: &[f64]) -> f64 {
    let smooth = |w: &[f64]| w.iter().sum::<f64>() / w.len() as f64;
    let most = power.windows(3).map(smooth).fold(0.0, f64::max);
    (most / smooth(power)).ln()
}
