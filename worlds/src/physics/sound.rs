//! Microphones around a table, and what they record of impacts on it and of clicks from elsewhere.

use std::f64::consts::PI;

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

type Vec3 = [f64; 3];

/// Reflections are computed one by one for this long after the direct sound, s; later ones are drawn.
const EARLY_S: f64 = 0.04;
/// Rate of late reflections until they are 40 dB down, 1/s.
const LATE_PER_S: f64 = 3e3;
/// Length of a burst, s.
const BURST_S: f64 = 0.012;
/// Samples of a burst for each sample of the recording.
const OVERSAMPLING: f64 = 8.0;

/// A room with a table and microphones.
#[derive(Debug, Clone, PartialEq)]
pub struct Room {
    /// Length, width and height, m.
    pub size_m: Vec3,
    /// The origin of the table's frame, m.
    pub table_m: Vec3,
    /// Time in which sound dies down by 60 dB, s.
    pub rt60_s: f64,
    /// Speed of sound, m/s.
    pub speed_m_s: f64,
    /// Samples a second.
    pub rate_hz: f64,
    /// The microphones in the table's frame, m.
    pub microphones_m: Vec<Vec3>,
}

impl Room {
    /// Adds a burst that begins at a time (s) at a place in the table's frame (m) to what each microphone records.
    pub fn play(
        &self,
        burst: &Burst,
        place_m: Vec3,
        t_s: f64,
        rng: &mut ChaCha8Rng,
        channels: &mut [Vec<f64>],
    ) {
        for (channel, microphone) in channels.iter_mut().zip(&self.microphones_m) {
            for (delay_s, gain) in self.paths(place_m, *microphone, rng) {
                burst.add(t_s + delay_s, gain, self.rate_hz, channel);
            }
        }
    }

    /// Reflection coefficient of the walls for pressure (Eyring 1930, doi:10.1121/1.1915175).
    fn reflection(&self) -> f64 {
        let [a, b, c] = self.size_m;
        let walls = 2.0 * (a * b + b * c + c * a);
        (-12.0 * std::f64::consts::LN_10 * a * b * c / (self.speed_m_s * walls * self.rt60_s)).exp()
    }

    /// Delay (s) and gain of every path from a place to a microphone: image sources (Allen and Berkley 1979,
    /// doi:10.1121/1.382599), and later a diffuse field of the same energy.
    fn paths(&self, place: Vec3, microphone: Vec3, rng: &mut ChaCha8Rng) -> Vec<(f64, f64)> {
        let between = |a: Vec3, b: Vec3| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
        let direct_m = between(place, microphone);
        let far_m = direct_m + EARLY_S * self.speed_m_s;
        let beta = self.reflection();
        let [source, ear]: [Vec3; 2] =
            [place, microphone].map(|p| std::array::from_fn(|k| p[k] + self.table_m[k]));
        let mut paths = Vec::new();
        let axis = |k: usize| image_offsets(source[k], ear[k], self.size_m[k], far_m);
        let [xs, ys, zs] = [axis(0), axis(1), axis(2)];
        for (x, nx) in &xs {
            for (y, ny) in &ys {
                for (z, nz) in &zs {
                    let r = (x * x + y * y + z * z).sqrt();
                    if r <= far_m {
                        paths.push((r / self.speed_m_s, beta.powi(nx + ny + nz) / r.max(0.02)));
                    }
                }
            }
        }
        let volume: f64 = self.size_m.iter().product();
        let mut t = far_m / self.speed_m_s;
        while t < far_m / self.speed_m_s + self.rt60_s * 2.0 / 3.0 {
            t -= (1.0 - rng.random::<f64>()).ln() / LATE_PER_S;
            let energy =
                4.0 * PI * self.speed_m_s / (volume * LATE_PER_S) * 10f64.powf(-6.0 * t / self.rt60_s);
            paths.push((t, if rng.random::<bool>() { energy.sqrt() } else { -energy.sqrt() }));
        }
        paths
    }
}

/// Differences along one axis between an ear and all images of a source that are near enough, with the walls on their way.
fn image_offsets(source: f64, ear: f64, length: f64, far: f64) -> Vec<(f64, i32)> {
    let most = (far / length) as i32 + 1;
    (-most..=most)
        .flat_map(|n| {
            // Even images are shifted, odd ones mirrored too.
            let at = if n % 2 == 0 { source } else { length - source };
            [(f64::from(n) * length + at - ear, n.abs())]
        })
        .filter(|(d, _)| d.abs() <= far)
        .collect()
}

/// The modes of a table, which ring and fade when something hits it.
#[derive(Debug, Clone, PartialEq)]
pub struct TableModes {
    /// Frequency (Hz), time to fade by 1/e (s) and gain of each mode.
    modes: Vec<Vec3>,
    /// How long a ball at 1 m/s touches the table, s.
    contact_s: f64,
}

impl TableModes {
    /// Thirty modes below a frequency, drawn at random.
    pub fn new(highest_hz: f64, rng: &mut ChaCha8Rng) -> Self {
        let mode = |_| {
            let gain: f64 = StandardNormal.sample(rng);
            [rng.random_range(1e3..highest_hz), rng.random_range(4e-4..2.5e-3), gain]
        };
        Self { modes: (0..30).map(mode).collect(), contact_s: 1.5e-4 }
    }

    /// The sound of an impact at a speed (m/s); no two are alike, since the place of the impact decides how much each mode rings.
    ///
    /// The force is that of a sphere on a flat surface (Hertz 1882): as the sine to the power 3/2, to the peak as speed to the
    /// power 6/5, in a time as speed to the power -1/5.
    pub fn strike(&self, speed_m_s: f64, rate_hz: f64, rng: &mut ChaCha8Rng) -> Burst {
        let step = 1.0 / (OVERSAMPLING * rate_hz);
        let contact = self.contact_s * speed_m_s.powf(-0.2);
        let peak = speed_m_s.powf(1.2) / self.contact_s;
        let mut samples = vec![0.0; (BURST_S / step) as usize];
        for [hz, fade, gain] in &self.modes {
            let normal: f64 = StandardNormal.sample(rng);
            let gain = gain * (1.0 + 0.3 * normal);
            let (turn, keep) = (2.0 * PI * hz * step, (-step / fade).exp());
            let (cosine, sine) = (keep * turn.cos(), keep * turn.sin());
            let (mut re, mut im) = (0.0, 0.0);
            for (k, sample) in samples.iter_mut().enumerate() {
                let touched = (k as f64 * step / contact).min(1.0);
                (re, im) = (cosine * re - sine * im, sine * re + cosine * im);
                re += step * peak * (PI * touched).sin().max(0.0).powf(1.5);
                *sample += gain * im;
            }
        }
        Burst { samples }
    }
}

/// One sound, at 1 m.
#[derive(Debug, Clone, PartialEq)]
pub struct Burst {
    samples: Vec<f64>,
}

impl Burst {
    /// Root mean square over its first 5 ms.
    pub fn loudness(&self) -> f64 {
        let n = ((5e-3 / BURST_S) * self.samples.len() as f64) as usize;
        (self.samples[..n].iter().map(|v| v * v).sum::<f64>() / n.max(1) as f64).sqrt()
    }

    /// Adds the burst to a recording from a time (s) on, interpolated by a cubic through four samples.
    fn add(&self, begin_s: f64, gain: f64, rate_hz: f64, into: &mut [f64]) {
        let first = (begin_s * rate_hz).ceil().max(0.0);
        let at = |k: isize| usize::try_from(k).ok().and_then(|k| self.samples.get(k)).copied().unwrap_or(0.0);
        let mut fine = (first / rate_hz - begin_s) * rate_hz * OVERSAMPLING;
        for v in into.iter_mut().skip(first as usize) {
            if fine as usize > self.samples.len() {
                break;
            }
            let (k, s) = (fine as isize, fine.fract());
            let [a, b, c, d] = [at(k - 1), at(k), at(k + 1), at(k + 2)];
            let bend = s * (2.0 * a - 5.0 * b + 4.0 * c - d + s * (3.0 * (b - c) + d - a));
            *v += gain * (b + 0.5 * s * (c - a + bend));
            fine += OVERSAMPLING;
        }
    }
}

/// Noise as a preamplifier makes it: white, and mains hum that the microphones share.
pub fn add_noise(sigma: f64, rate_hz: f64, rng: &mut ChaCha8Rng, channels: &mut [Vec<f64>]) {
    let hum: [f64; 2] = std::array::from_fn(|_| rng.random_range(0.0..2.0 * PI));
    for channel in channels {
        for (k, v) in channel.iter_mut().enumerate() {
            let turns = 2.0 * PI * 50.0 * k as f64 / rate_hz;
            let white: f64 = StandardNormal.sample(rng);
            *v += sigma * (white + 2.0 * (turns + hum[0]).sin() + 0.7 * (3.0 * turns + hum[1]).sin());
        }
    }
}

/// A WAV file of 16 bit, the loudest sample at `peak` of full scale.
pub fn wav(channels: &[Vec<f64>], rate_hz: u32, peak: f64) -> Vec<u8> {
    let loudest = channels.iter().flatten().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
    let scale = peak * f64::from(i16::MAX) / loudest;
    let spec = hound::WavSpec {
        channels: channels.len() as u16,
        sample_rate: rate_hz,
        bits_per_sample: 16,
        sample_format: hound::SampleFormat::Int,
    };
    let mut bytes = std::io::Cursor::new(Vec::new());
    let write = |bytes: &mut std::io::Cursor<Vec<u8>>| -> hound::Result<()> {
        let mut writer = hound::WavWriter::new(bytes, spec)?;
        for k in 0..channels.first().map_or(0, Vec::len) {
            for channel in channels {
                writer.write_sample((channel[k] * scale).round() as i16)?;
            }
        }
        writer.finalize()
    };
    // Writing to memory fails only where there are no channels, and then the file is empty.
    match write(&mut bytes) {
        Ok(()) => bytes.into_inner(),
        Err(_) => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;
    use rand::SeedableRng as _;

    fn room() -> Room {
        Room {
            size_m: [4.0, 5.0, 2.5],
            table_m: [1.7, 2.1, 0.7],
            rt60_s: 0.3,
            speed_m_s: 343.0,
            rate_hz: 48e3,
            microphones_m: vec![[0.0, 0.0, 0.08]],
        }
    }

    #[test]
    fn the_first_way_is_the_straight_one_and_energy_falls_by_60_db_in_rt60() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let room = room();
        let mut paths = room.paths([0.3, 0.4, 0.0], room.microphones_m[0], &mut rng);
        paths.sort_by(|a, b| a.0.total_cmp(&b.0));
        let r = (0.25f64 + 0.0064).sqrt();
        approx::assert_relative_eq!(paths[0].0, r / 343.0, max_relative = 1e-12);
        approx::assert_relative_eq!(paths[0].1, 1.0 / r, max_relative = 1e-12);
        // In decibels a second, images and what is drawn later alike, by least squares over slices of 10 ms.
        let slices: Vec<[f64; 2]> = (1..18)
            .map(|k| {
                let (from, to) = (0.01 * f64::from(k), 0.01 * f64::from(k + 1));
                let energy: f64 = paths.iter().filter(|w| (from..to).contains(&w.0)).map(|w| w.1 * w.1).sum();
                [0.5 * (from + to), 10.0 * energy.log10()]
            })
            .collect();
        let n = slices.len() as f64;
        let mean = [0, 1].map(|i| slices.iter().map(|s| s[i]).sum::<f64>() / n);
        let slope = slices.iter().map(|s| (s[0] - mean[0]) * (s[1] - mean[1])).sum::<f64>()
            / slices.iter().map(|s| (s[0] - mean[0]).powi(2)).sum::<f64>();
        assert!((slope / -200.0 - 1.0).abs() < 0.2, "{slope} dB/s");
    }

    #[test]
    fn a_burst_that_begins_between_samples_is_the_burst_of_a_finer_recording() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let burst = TableModes::new(8e3, &mut rng).strike(1.0, 48e3, &mut rng);
        let (mut coarse, mut fine) = (vec![0.0; 400], vec![0.0; 3200]);
        let begin = 1.3 / 48e3;
        burst.add(begin, 1.0, 48e3, &mut coarse);
        // As many samples as the burst itself has: no interpolation but of the beginning.
        let shift = begin * 48e3 * OVERSAMPLING;
        for (k, v) in fine.iter_mut().enumerate() {
            let at = k as f64 - shift;
            if at >= 0.0 {
                let (i, s) = (at as usize, at.fract());
                *v = burst.samples[i] + s * (burst.samples[i + 1] - burst.samples[i]);
            }
        }
        let loudest = burst.samples.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        for (k, v) in coarse.iter().enumerate() {
            approx::assert_abs_diff_eq!(*v, fine[8 * k], epsilon = 0.02 * loudest);
        }
        assert!(burst.samples[..4].iter().all(|v| v.abs() < 0.01 * loudest));
    }
}
