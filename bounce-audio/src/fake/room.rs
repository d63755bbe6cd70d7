//! A rectangular room with microphones: image sources (Allen and Berkley 1979, doi:10.1121/1.382599).

use super::error::RoomError;
use super::panel::Panel;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use rustfft::num_complex::Complex64;
use rustfft::{Fft, FftPlanner};
use std::f64::consts::PI;
use std::sync::Arc;

/// Responses are summed on samples this much finer than the microphones'.
const FINER: usize = 4;
/// Nearest that a source may be to a microphone, m.
const NEAREST_M: f64 = 0.01;
/// Length of a burst, s.
const BURST_S: f64 = 12e-3;

/// A room with a table in it; all places in the table's frame.
#[derive(Clone)]
pub struct Room {
    size_m: [f64; 3],
    table_m: [f64; 3],
    reflection: f64,
    rt60_s: f64,
    speed_m_s: f64,
    rate_hz: f64,
    microphones_m: Vec<[f64; 3]>,
    panels: Vec<Panel>,
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
}

impl Room {
    /// A room of the given size (m), the table's origin in it (m), its reverberation time (s; 0 for no echo at all), the speed of sound
    /// (m/s), the microphones (m, table's frame) and their rate (Hz). Walls absorb as Eyring's formula asks for.
    ///
    /// # Errors
    /// [`RoomError`] for values out of range, microphones outside the room, or an echo that no wall could make so short.
    pub fn new(
        size_m: [f64; 3],
        table_m: [f64; 3],
        rt60_s: f64,
        speed_m_s: f64,
        microphones_m: &[[f64; 3]],
        rate_hz: f64,
    ) -> Result<Self, RoomError> {
        let wrong = |what, expected, got| Err(RoomError { what, expected, got });
        for k in 0..3 {
            if !(size_m[k] > 0.5 && size_m[k] < 50.0) {
                return wrong("the room's size", "0.5 to 50 m", size_m[k]);
            }
            for m in microphones_m.iter().chain([&[0.0; 3]]) {
                let at = table_m[k] + m[k];
                if !(at > 0.0 && at < size_m[k]) {
                    return wrong("a microphone's place or the table's", "within the room", at);
                }
            }
        }
        if !(0.0..=3.0).contains(&rt60_s) {
            return wrong("the reverberation time", "0 to 3 s", rt60_s);
        }
        if !(100.0..=2000.0).contains(&speed_m_s) {
            return wrong("the speed of sound", "100 to 2000 m/s", speed_m_s);
        }
        if !(8e3..=200e3).contains(&rate_hz) {
            return wrong("the sample rate", "8 to 200 kHz", rate_hz);
        }
        let [a, b, c] = size_m;
        let (volume, walls) = (a * b * c, 2.0 * (a * b + b * c + c * a));
        let exponent = 24.0 * std::f64::consts::LN_10 * volume / (speed_m_s * walls * rt60_s);
        let reflection = if rt60_s > 0.0 { (-0.5 * exponent).exp() } else { 0.0 };
        if rt60_s > 0.0 && reflection < 0.05 {
            return wrong("the reverberation time", "one that walls can make", rt60_s);
        }
        let direct = size_m.iter().map(|s| s * s).sum::<f64>().sqrt() / speed_m_s;
        let length = ((rt60_s.max(direct) + BURST_S) * rate_hz) as usize * FINER;
        let n = (length + 2 * FINER).next_power_of_two();
        let mut planner = FftPlanner::new();
        Ok(Self {
            size_m,
            table_m,
            reflection,
            rt60_s,
            speed_m_s,
            rate_hz,
            microphones_m: microphones_m.to_vec(),
            panels: Vec::new(),
            forward: planner.plan_fft_forward(n),
            inverse: planner.plan_fft_inverse(n),
        })
    }

    /// The same room with furniture: each panel sends every sound back once, and shades nothing.
    ///
    /// # Errors
    /// [`RoomError`] for a panel out of range.
    pub fn furnished(mut self, panels: &[Panel]) -> Result<Self, RoomError> {
        panels.iter().try_for_each(Panel::check)?;
        self.panels.extend_from_slice(panels);
        Ok(self)
    }

    /// The microphones, m.
    pub fn microphones_m(&self) -> &[[f64; 3]] {
        &self.microphones_m
    }

    /// Sample rate of the microphones, Hz.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// The speed of sound, m/s.
    pub fn speed_m_s(&self) -> f64 {
        self.speed_m_s
    }

    /// Adds a burst at a place (m) to what the microphones hear; `channels` begin at time 0 of `t_s`. What comes after their end is cut.
    pub fn strike(&self, place_m: [f64; 3], t_s: f64, burst: &Burst, channels: &mut [Vec<f64>]) {
        let fine = self.rate_hz * FINER as f64;
        let first = (t_s * self.rate_hz).floor().max(0.0);
        let late_s = t_s - first / self.rate_hz;
        let n = self.forward.len();
        let zero = Complex64::new(0.0, 0.0);
        let mut spectrum = vec![zero; n];
        for (k, z) in spectrum.iter_mut().enumerate().take((BURST_S * fine) as usize) {
            z.re = burst.at(k as f64 / fine);
        }
        self.forward.process(&mut spectrum);
        for (x, m) in channels.iter_mut().zip(&self.microphones_m) {
            let mut response = vec![zero; n];
            self.images(place_m, *m, |delay_s, gain| {
                let at = (delay_s + late_s) * fine;
                let (i, part) = (at as usize, at.fract());
                if i + 1 < n {
                    response[i].re += gain * (1.0 - part);
                    response[i + 1].re += gain * part;
                }
            });
            self.forward.process(&mut response);
            response.iter_mut().zip(&spectrum).for_each(|(r, s)| *r *= s / n as f64);
            self.inverse.process(&mut response);
            for (v, r) in x.iter_mut().skip(first as usize).zip(response.iter().step_by(FINER)) {
                *v += r.re;
            }
        }
    }

    /// Calls `add` with the delay (s) and the gain of every way from a place (m) to a microphone by its number, down to -60 dB.
    pub(super) fn ways(&self, place_m: [f64; 3], microphone: usize, add: impl FnMut(f64, f64)) {
        if let Some(m) = self.microphones_m.get(microphone) {
            self.images(place_m, *m, add);
        }
    }

    /// Calls `add` with the delay (s) and the gain of every way from a place to a microphone, down to -60 dB.
    fn images(&self, place_m: [f64; 3], microphone_m: [f64; 3], mut add: impl FnMut(f64, f64)) {
        for panel in &self.panels {
            if let Some(r) = panel.way_m(place_m, microphone_m) {
                let r = r.max(NEAREST_M);
                add(r / self.speed_m_s, panel.reflection / r);
            }
        }
        let farthest = self.speed_m_s * self.rt60_s;
        let axis = |k: usize| {
            let (l, s) = (self.size_m[k], self.table_m[k] + place_m[k]);
            let m = self.table_m[k] + microphone_m[k];
            let most = if self.reflection > 0.0 { (0.5 * farthest / l).ceil() as i32 + 1 } else { 0 };
            let mut ways = Vec::new();
            for n in -most..=most {
                let shift = 2.0 * f64::from(n) * l;
                ways.push((shift + s - m, (2 * n).unsigned_abs()));
                if self.reflection > 0.0 {
                    ways.push((shift - s - m, (2 * n - 1).unsigned_abs()));
                }
            }
            ways
        };
        let ways = [axis(0), axis(1), axis(2)];
        for &(x, a) in &ways[0] {
            for &(y, b) in &ways[1] {
                let flat = x * x + y * y;
                if flat > farthest * farthest && a + b > 0 {
                    continue;
                }
                for &(z, c) in &ways[2] {
                    let r = (flat + z * z).sqrt().max(NEAREST_M);
                    let walls = a + b + c;
                    if walls == 0 || r <= farthest {
                        add(r / self.speed_m_s, self.reflection.powi(walls as i32) / r);
                    }
                }
            }
        }
    }
}

/// The sound that an impact makes, at 1 m: modes of ball and table that ring and fade.
#[derive(Debug, Clone, PartialEq)]
pub struct Burst {
    modes: Vec<[f64; 4]>,
}

impl Burst {
    /// Modes of 2.5 to 9 kHz that fade within 0.5 to 2.5 ms, drawn at random, of a given loudness.
    pub fn new<R: Rng + ?Sized>(loudness: f64, rng: &mut R) -> Self {
        let mode = |_| {
            let uniform = |rng: &mut R, a: f64, b: f64| a + (b - a) * rng.random::<f64>();
            let gain = loudness * rng.sample::<f64, _>(StandardNormal) / 40f64.sqrt();
            [uniform(rng, 2.5e3, 9e3), uniform(rng, 0.0, 2.0 * PI), uniform(rng, 0.5e-3, 2.5e-3), gain]
        };
        Self { modes: (0..40).map(mode).collect() }
    }

    /// The sound at a time (s) after it began; it takes 0.1 ms to rise.
    pub fn at(&self, t_s: f64) -> f64 {
        if !(t_s > 0.0 && t_s < BURST_S) {
            return 0.0;
        }
        let rise = 0.5 - 0.5 * (PI * (t_s / 1e-4).min(1.0)).cos();
        let ring = |[hz, phase, fade, gain]: &[f64; 4]| {
            gain * (-t_s / fade).exp() * (2.0 * PI * hz * t_s + phase).cos()
        };
        rise * self.modes.iter().map(ring).sum::<f64>()
    }
}
