//! A drop as a microphone records it.

use super::radiation::{ball_modes, board, motion};
use super::{Board, Striker, between};
use crate::fake::error::RoomError;
use crate::fake::room::Room;
use crate::wav::Sound;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex64;
use std::f64::consts::PI;

/// Sounds are made at this rate at least, Hz, and on this many samples.
const FINE_HZ: f64 = 170e3;
const SAMPLES: usize = 1 << 15;
/// A ball is let fall this long after the recording has begun, s; it is followed over this many impacts at most.
const QUIET_S: f64 = 0.15;
const MOST: usize = 6;
/// Impacts slower than this are left out, m/s.
const SLOWEST_M_S: f64 = 0.25;
const GRAVITY: f64 = 9.80665;

/// A room with a microphone above a table.
pub struct Recorder {
    room: Room,
    /// Cosine of the angle from the vertical at which the microphone sees the impact.
    cosine: f64,
    /// Response: slope in powers of the frequency, a ripple (its size and phase), corner of the high-pass (Hz).
    slope: f64,
    ripple: [f64; 2],
    corner_hz: f64,
    /// Noise below the loudest sample (a ratio), and the part of it that is hum.
    noise: f64,
    hum: f64,
    /// Loudest sample of a recording.
    level: f64,
}

/// A recording and what is true of it.
pub struct Recorded {
    /// The sound: one channel, full scale 1.
    pub sound: Sound,
    /// When the ball touched the table, s.
    pub impacts_s: Vec<f64>,
    /// Its speed then, m/s.
    pub speeds_m_s: Vec<f64>,
    /// How long each impact's force lasted, s.
    pub contacts_s: Vec<f64>,
    /// Restitution of each impact.
    pub restitutions: Vec<f64>,
    /// Height that the ball was let go at, m.
    pub height_m: f64,
}

impl Recorder {
    /// A room of 3 to 6 m with 0.12 to 0.35 s of reverberation, a microphone 0.25 to 0.8 m from the impact, 0.08 to 0.5 m above the table, a
    /// response that slopes by up to 3 dB a decade and ripples by up to 1.5 dB, noise 35 to 60 dB below the loudest sample; rate in Hz.
    ///
    /// # Errors
    /// [`RoomError`] for a rate that is not 8 to 200 kHz.
    pub fn draw<R: Rng + ?Sized>(rate_hz: f64, rng: &mut R) -> Result<Self, RoomError> {
        let size = [between([3.0, 6.0], rng), between([3.0, 5.0], rng), between([2.4, 3.0], rng)];
        let table =
            [0.5 * size[0] + between([-0.6, 0.6], rng), 0.5 * size[1] + between([-0.6, 0.6], rng), 0.75];
        let (away, up) = (between([0.25, 0.8], rng), between([0.08, 0.5], rng));
        let around = 2.0 * PI * rng.random::<f64>();
        let flat = (away * away - up * up).max(0.01).sqrt();
        let microphone = [flat * around.cos(), flat * around.sin(), up];
        let room = Room::new(size, table, between([0.12, 0.35], rng), 343.0, &[microphone], rate_hz)?;
        Ok(Self {
            room,
            cosine: up / flat.hypot(up),
            slope: between([-0.15, 0.15], rng),
            ripple: [between([0.0, 0.17], rng), 2.0 * PI * rng.random::<f64>()],
            corner_hz: between([40.0, 120.0], rng),
            noise: 10f64.powf(-between([35.0, 60.0], rng) / 20.0),
            hum: between([0.0, 0.5], rng),
            level: between([0.05, 0.8], rng),
        })
    }

    /// The same with noise so many decibels below the loudest sample.
    #[must_use]
    pub fn with_noise_db(self, below: f64) -> Self {
        Self { noise: 10f64.powf(-below / 20.0), ..self }
    }

    /// Pressure at the microphone over force, at each frequency of the fine rate (Hz) up to the microphone's limit.
    fn response<R: Rng + ?Sized>(
        &self,
        ball: &Striker,
        plate: &Board,
        fine_hz: f64,
        rng: &mut R,
    ) -> Vec<Complex64> {
        let mut planner = FftPlanner::new();
        let forward = planner.plan_fft_forward(SAMPLES);
        let mut spectrum: Vec<Complex64> =
            board(plate, fine_hz, SAMPLES / 2, rng).into_iter().map(|p| p.into()).collect();
        spectrum.resize(SAMPLES, 0.0.into());
        forward.process(&mut spectrum);
        let mut echoes = vec![Complex64::default(); SAMPLES];
        self.room.ways([0.0; 3], 0, |delay_s, gain| {
            let at = delay_s * fine_hz;
            let (i, part) = (at as usize, at.fract());
            if i + 1 < SAMPLES / 2 {
                echoes[i].re += gain * (1.0 - part);
                echoes[i + 1].re += gain * part;
            }
        });
        forward.process(&mut echoes);
        let modes = ball_modes(ball);
        let limit_hz = 0.47 * self.room.rate_hz();
        let count = ((limit_hz / fine_hz * SAMPLES as f64) as usize).min(SAMPLES / 2);
        (0..count)
            .map(|k| {
                let hz = k as f64 * fine_hz / SAMPLES as f64;
                let own: Complex64 = modes.iter().map(|m| m.at(hz)).sum();
                // The plate's impulse response is a sum over samples; the ball's is a density over time.
                let source = spectrum[k] / fine_hz + motion(ball, self.cosine, hz) + own;
                source * echoes[k] * self.microphone(hz)
            })
            .collect()
    }

    fn microphone(&self, hz: f64) -> Complex64 {
        let log = (hz.max(20.0) / 1e3).ln();
        let [size, phase] = self.ripple;
        let gain = (self.slope * log + size * (2.5 * log + phase).sin()).exp();
        let ratio = hz / self.corner_hz;
        Complex64::new(0.0, ratio) / Complex64::new(1.0, ratio) * gain
    }

    /// Drops a ball on a board from a height (m).
    pub fn drop<R: Rng + ?Sized>(
        &self,
        ball: &Striker,
        plate: &Board,
        height_m: f64,
        rng: &mut R,
    ) -> Recorded {
        let rate_hz = self.room.rate_hz();
        let finer = (FINE_HZ / rate_hz).ceil();
        let fine_hz = rate_hz * finer;
        let response = self.response(ball, plate, fine_hz, rng);
        let mut contact = ball.contact(plate).with_restitution(ball.restitution);
        contact.impedance = plate.impedance();
        let mut planner = FftPlanner::new();
        let (forward, inverse) = (planner.plan_fft_forward(SAMPLES), planner.plan_fft_inverse(SAMPLES));
        let mut recorded = Recorded {
            sound: Sound { rate_hz, channels: Vec::new() },
            impacts_s: Vec::new(),
            speeds_m_s: Vec::new(),
            contacts_s: Vec::new(),
            restitutions: Vec::new(),
            height_m,
        };
        let mut x: Vec<f64> = Vec::new();
        let (mut t_s, mut speed) = (QUIET_S, fall(ball, height_m));
        while recorded.impacts_s.len() < MOST && speed > SLOWEST_M_S {
            let collision = contact.collide(speed, 1.0 / fine_hz);
            let start = (t_s * rate_hz).floor();
            let late_s = t_s - start / rate_hz;
            let mut spectrum = vec![Complex64::default(); SAMPLES];
            spectrum.iter_mut().zip(&collision.force_n).for_each(|(z, f)| z.re = *f);
            forward.process(&mut spectrum);
            for (k, z) in spectrum.iter_mut().enumerate() {
                let Some(h) = response.get(k) else {
                    *z = Complex64::default();
                    continue;
                };
                let late = Complex64::cis(-2.0 * PI * k as f64 * fine_hz / SAMPLES as f64 * late_s);
                *z *= h * late;
            }
            inverse.process(&mut spectrum);
            let heard: Vec<f64> = spectrum.iter().step_by(finer as usize).map(|z| z.re).collect();
            let start = start as usize;
            x.resize(x.len().max(start + heard.len()), 0.0);
            x[start..].iter_mut().zip(&heard).for_each(|(v, h)| *v += h);
            // The skin differs from place to place by a hundredth.
            let scatter = 1.0 + 0.01 * rng.sample::<f64, _>(StandardNormal);
            let rebound = (collision.rebound_m_s * scatter).min(speed);
            recorded.impacts_s.push(t_s);
            recorded.speeds_m_s.push(speed);
            recorded.contacts_s.push(collision.duration_s);
            recorded.restitutions.push(rebound / speed);
            let (flight_s, landing) = flight(ball, rebound);
            t_s += flight_s;
            speed = landing;
        }
        x.resize(x.len().max(((t_s + 0.1) * rate_hz) as usize), 0.0);
        self.noisy(&mut x, rate_hz, rng);
        recorded.sound.channels.push(x);
        recorded
    }

    /// Scales to the level, adds noise that drifts and hum, rounds to 16 bits.
    fn noisy<R: Rng + ?Sized>(&self, x: &mut [f64], rate_hz: f64, rng: &mut R) {
        let loudest = x.iter().fold(f64::MIN_POSITIVE, |most, v| most.max(v.abs()));
        let mut slow = 0.0;
        let phase = 2.0 * PI * rng.random::<f64>();
        for (k, v) in x.iter_mut().enumerate() {
            let t = k as f64 / rate_hz;
            let drift = 1.0 + 0.2 * (2.0 * PI * 0.7 * t + phase).sin();
            slow += 0.02 * (7.0 * rng.sample::<f64, _>(StandardNormal) - slow);
            let hiss = 0.8 * rng.sample::<f64, _>(StandardNormal) + 0.6 * slow;
            let hum = 1.4 * self.hum * (2.0 * PI * 50.0 * t + phase).sin();
            let noise = self.noise * (drift * hiss + hum);
            let sample = self.level * (*v / loudest + noise);
            *v = (sample.clamp(-1.0, 1.0) * 32768.0).round() / 32768.0;
        }
    }
}

/// Drag of a ball, 1/m.
fn drag(ball: &Striker) -> f64 {
    0.5 * 1.2 * 0.5 * PI * 0.25 * ball.diameter_m * ball.diameter_m / ball.mass_kg
}

/// Speed after a fall from a height (m) through air, m/s.
fn fall(ball: &Striker, height_m: f64) -> f64 {
    let k = drag(ball);
    (GRAVITY / k * (1.0 - (-2.0 * k * height_m).exp())).sqrt()
}

/// How long a ball that leaves upwards at a speed (m/s) flies (s), and its speed when it is back.
fn flight(ball: &Striker, speed_m_s: f64) -> (f64, f64) {
    let k = drag(ball);
    let terminal = (GRAVITY / k).sqrt();
    let up_s = terminal / GRAVITY * (speed_m_s / terminal).atan();
    let top_m = (1.0 + speed_m_s * speed_m_s / (terminal * terminal)).ln() / (2.0 * k);
    let down_s = terminal / GRAVITY * (k * top_m).exp().acosh();
    (up_s + down_s, fall(ball, top_m))
}
