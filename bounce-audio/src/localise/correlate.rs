//! Time differences of arrival between channels, by the phase transform.

use super::error::LocaliseError;
use super::peak::{OVERSAMPLING, Peak, candidates};
use rustfft::num_complex::Complex64;
use rustfft::{Fft, FftPlanner};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Longest buffer, samples.
const LONGEST: usize = 1 << 16;
/// Fewest frequencies in the band.
const FEWEST_BINS: usize = 16;
/// Part of the buffer that fades in, and part that fades out.
const FADES: (f64, f64) = (1.0 / 16.0, 0.35);
/// Part of the buffer at its start that is taken for noise.
const LEAD: usize = 8;
/// Weight of the noise against the cross-spectrum: chosen on the practice sounds, flat between 2 and 20.
const NOISE_WEIGHT: f64 = 5.0;
/// What errors are over what the scatter of the phases says: echoes disturb neighbouring frequencies and all channels alike.
/// Measured on the practice sounds (1.8 to 2.6; 0.9 without echoes).
const SIGMA_SCALE: f64 = 2.0;

pub(super) struct Correlator {
    channels: usize,
    rate_hz: f64,
    buffer: usize,
    window: Vec<f64>,
    /// Sum of the squares of the window.
    window_power: f64,
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
    scratch: Vec<Complex64>,
    packed: Vec<Complex64>,
    lattice: Vec<Complex64>,
    /// First and last-but-one frequency of the band, bins.
    band: (usize, usize),
    spectra: Vec<Complex64>,
    noise: Vec<f64>,
    pairs: Vec<Pair>,
    cross: Vec<Complex64>,
}

/// Two channels: `i > j`.
struct Pair {
    i: usize,
    j: usize,
    longest_s: f64,
    lag_s: f64,
    variance_s2: f64,
    /// Height of the peak over what it would be if all phases agreed.
    coherence: f64,
}

impl Correlator {
    pub(super) fn new(
        channels: usize,
        rate_hz: f64,
        buffer: usize,
        band_hz: (f64, f64),
        longest_s: f64,
        lag_s: impl Fn(usize, usize) -> f64,
    ) -> Result<Self, LocaliseError> {
        let expected = 2.0 * band_hz.0;
        if !(rate_hz > expected && rate_hz.is_finite()) {
            return Err(LocaliseError::Rate { expected, got: rate_hz });
        }
        // A microphone's spacing in samples that no buffer holds saturates.
        let reach = (longest_s * rate_hz).ceil().min(1e9) as usize + 2;
        let least = reach.saturating_mul(2).max(4 * LEAD);
        if buffer < least || buffer > LONGEST {
            return Err(LocaliseError::Buffer { least, most: LONGEST, got: buffer });
        }
        let n = (buffer + reach).next_power_of_two();
        let bin = |hz: f64| (hz / rate_hz * n as f64).ceil().max(1.0) as usize;
        let band = (bin(band_hz.0), bin(band_hz.1.min(0.49 * rate_hz)));
        let bins = band.1.saturating_sub(band.0);
        if bins < FEWEST_BINS {
            return Err(LocaliseError::Band { expected: FEWEST_BINS, bins });
        }
        let (rise, fall) = (FADES.0 * buffer as f64, FADES.1 * buffer as f64);
        let window: Vec<f64> = (0..buffer)
            .map(|k| ((k as f64 + 0.5) / rise).min((buffer as f64 - k as f64 - 0.5) / fall).min(1.0))
            .map(|t| 0.5 - 0.5 * (0.5 * TAU * t).cos())
            .collect();
        let mut planner = FftPlanner::new();
        let (forward, inverse) = (planner.plan_fft_forward(n), planner.plan_fft_inverse(OVERSAMPLING * n));
        let scratch = forward.get_inplace_scratch_len().max(inverse.get_inplace_scratch_len());
        let pair = |i, j| Pair { i, j, longest_s: lag_s(i, j), lag_s: 0.0, variance_s2: 0.0, coherence: 0.0 };
        let pairs: Vec<Pair> =
            (0..channels).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| pair(i, j)).collect();
        let zero = Complex64::new(0.0, 0.0);
        Ok(Self {
            channels,
            rate_hz,
            buffer,
            window_power: window.iter().map(|w| w * w).sum(),
            window,
            forward,
            inverse,
            scratch: vec![zero; scratch],
            packed: vec![zero; n],
            lattice: vec![zero; OVERSAMPLING * n],
            band,
            spectra: vec![zero; channels * bins],
            noise: vec![0.0; channels],
            cross: vec![zero; pairs.len() * bins],
            pairs,
        })
    }

    pub(super) fn buffer(&self) -> usize {
        self.buffer
    }

    /// Arrival at `i` less that at `j`, s.
    pub(super) fn lag_s(&self, i: usize, j: usize) -> f64 {
        match i.cmp(&j) {
            std::cmp::Ordering::Equal => 0.0,
            std::cmp::Ordering::Greater => self.pairs[i * (i - 1) / 2 + j].lag_s,
            std::cmp::Ordering::Less => -self.pairs[j * (j - 1) / 2 + i].lag_s,
        }
    }

    /// Standard deviation of an arrival, s: a lag has the variance of two.
    pub(super) fn arrival_sigma_s(&self) -> f64 {
        let mean = self.pairs.iter().map(|p| p.variance_s2).sum::<f64>() / self.pairs.len() as f64;
        SIGMA_SCALE * (0.5 * mean).sqrt()
    }

    /// How well the phases of the pair that agrees least do so, 1 at best.
    pub(super) fn coherence(&self) -> f64 {
        self.pairs.iter().map(|p| p.coherence).fold(1.0, f64::min)
    }

    /// Correlates the channels, each a slice as long as the buffer.
    pub(super) fn listen<'a>(&mut self, channel: impl Fn(usize) -> &'a [f64]) -> Result<(), LocaliseError> {
        for first in (0..self.channels).step_by(2) {
            let second = (first + 1 < self.channels).then(|| channel(first + 1));
            self.transform(first, channel(first), second)?;
        }
        self.cross_spectra();
        let bins = self.band.1 - self.band.0;
        for first in (0..self.pairs.len()).step_by(2) {
            self.correlate(first);
            for p in first..(first + 2).min(self.pairs.len()) {
                let cross = &self.cross[p * bins..][..bins];
                let radians = TAU * self.rate_hz / self.packed.len() as f64;
                let peak = |t| Peak::climb(cross, self.band.0, radians, t);
                let mut best: Option<Peak> = None;
                for start in candidates(&self.lattice, p - first, self.pairs[p].longest_s, self.rate_hz) {
                    let Some(found) = start.map(peak) else { continue };
                    if best.as_ref().is_none_or(|b| found.height > b.height) {
                        best = Some(found);
                    }
                }
                if let Some(best) = best {
                    // Zero padding and the window correlate neighbouring frequencies.
                    let correlated = self.packed.len() as f64 / self.window_power;
                    let most = cross.iter().map(|g| g.norm_sqr().sqrt()).sum::<f64>() + f64::MIN_POSITIVE;
                    self.pairs[p].coherence = best.height / most;
                    self.pairs[p].lag_s = best.lag_s;
                    self.pairs[p].variance_s2 = correlated * best.scatter / (best.curvature * best.curvature);
                }
            }
        }
        Ok(())
    }

    /// Spectra in the band of one channel or two, which one complex transform takes together.
    fn transform(&mut self, first: usize, one: &[f64], second: Option<&[f64]>) -> Result<(), LocaliseError> {
        let n = self.packed.len();
        let bins = self.band.1 - self.band.0;
        self.packed[self.buffer..].fill(Complex64::new(0.0, 0.0));
        for (k, (z, w)) in self.packed.iter_mut().zip(&self.window).enumerate() {
            *z = Complex64::new(one[k] * w, second.map_or(0.0, |x| x[k] * w));
        }
        self.forward.process_with_scratch(&mut self.packed, &mut self.scratch);
        for (which, x) in std::iter::once(one).chain(second).enumerate() {
            let channel = first + which;
            let mut energy = 0.0;
            for b in 0..bins {
                let k = self.band.0 + b;
                let (z, mirror) = (self.packed[k], self.packed[n - k].conj());
                let s =
                    if which == 0 { 0.5 * (z + mirror) } else { Complex64::new(0.0, -0.5) * (z - mirror) };
                energy += s.norm_sqr();
                self.spectra[channel * bins + b] = s;
            }
            if !(energy.is_finite() && energy > 0.0) {
                return Err(LocaliseError::Energy { channel, got: energy });
            }
            // Differences of neighbours leave white noise and lose hum.
            let lead = &x[..self.buffer / LEAD];
            let power = lead.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum::<f64>();
            self.noise[channel] = 0.5 * power / (lead.len() - 1) as f64 * self.window_power;
        }
        Ok(())
    }

    fn cross_spectra(&mut self) {
        let bins = self.band.1 - self.band.0;
        for (p, pair) in self.pairs.iter().enumerate() {
            let (a, b) = (&self.spectra[pair.i * bins..][..bins], &self.spectra[pair.j * bins..][..bins]);
            let noise = NOISE_WEIGHT * (self.noise[pair.i] * self.noise[pair.j]).sqrt();
            for ((out, a), b) in self.cross[p * bins..].iter_mut().zip(a).zip(b) {
                let g = a * b.conj();
                *out = g / (g.norm_sqr().sqrt() + noise + f64::MIN_POSITIVE);
            }
        }
    }

    /// Correlations of one pair (real part) and the next (imaginary part) on the lattice of lags.
    fn correlate(&mut self, first: usize) {
        let n = self.lattice.len();
        let bins = self.band.1 - self.band.0;
        self.lattice.fill(Complex64::new(0.0, 0.0));
        let a = &self.cross[first * bins..][..bins];
        let b = self.cross.get((first + 1) * bins..(first + 2) * bins);
        for (k, a) in a.iter().enumerate() {
            let b = b.map_or(Complex64::new(0.0, 0.0), |b| b[k]);
            let i_b = Complex64::new(-b.im, b.re);
            let i_b_conj = Complex64::new(b.im, b.re);
            self.lattice[self.band.0 + k] = a + i_b;
            self.lattice[n - self.band.0 - k] = a.conj() + i_b_conj;
        }
        self.inverse.process_with_scratch(&mut self.lattice, &mut self.scratch);
    }
}
