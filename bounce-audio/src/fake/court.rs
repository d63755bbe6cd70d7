//! The whole rig: throws, sound, arm; time goes on as the microphones are read.

use super::arm::{ArmLimits, PaddleArm};
use super::ball::{FakeBall, Flown};
use super::error::RoomError;
use super::room::{Burst, Room};
use hw_traits::arm::{Arm, Pose};
use hw_traits::clock::Stamped;
use hw_traits::microphones::Microphones;
use hw_traits::{ErrorKind, ErrorType};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::f64::consts::TAU;
use thiserror::Error;

/// Silence before each throw, s.
const QUIET_S: f64 = 0.15;
/// A throw is followed for this long at most, s.
const LONGEST_S: f64 = 4.0;
/// What the arm's motors sing at, Hz, at a speed of 1 m/s; above the hum their whine.
const MOTORS_HZ: [f64; 4] = [90.0, 430.0, 1250.0, 2100.0];

/// What the court is like.
#[derive(Debug, Clone, PartialEq)]
pub struct CourtSettings {
    /// The paddle moves in the plane x = this, m.
    pub plane_x_m: f64,
    /// Edges of the table along y, m; the ball is out beyond them.
    pub side_m: [f64; 2],
    /// The paddle's radius, m.
    pub paddle_radius_m: f64,
    /// What the arm can do.
    pub arm: ArmLimits,
    /// Where the paddle waits, m.
    pub home_m: [f64; 3],
    /// Standard deviation of the microphones' own noise.
    pub noise: f64,
    /// Amplitude of the arm's noise at 1 m/s.
    pub arm_noise: f64,
}

impl Default for CourtSettings {
    /// The table of 0.55 m and the paddle of 4.5 inches of [Matl 2021], and an arm with an industrial one's limits.
    fn default() -> Self {
        let reach_m = [[0.5, 0.6], [-0.05, 0.6], [0.02, 0.5]];
        Self {
            plane_x_m: 0.55,
            side_m: [0.0, 0.55],
            paddle_radius_m: 0.05715,
            arm: ArmLimits { latency_s: 0.05, speed_m_s: 1.0, acceleration_m_s2: 10.0, reach_m },
            home_m: [0.55, 0.275, 0.1],
            noise: 1e-3,
            arm_noise: 2e-3,
        }
    }
}

/// A throw onto the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Toss {
    /// Where the ball's centre is let go, m.
    pub place_m: [f64; 3],
    /// Velocity of the ball's centre, m/s.
    pub velocity_m_s: [f64; 3],
}

/// How a throw ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Verdict {
    /// The ball has not come to the plane yet.
    Flying,
    /// The paddle touched the ball.
    Touched,
    /// The ball went by, this far from the paddle's edge, m.
    Missed(f64),
    /// The ball never came to where the paddle could have been.
    Out,
}

/// What goes wrong on the court.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct FakeError(ErrorKind);

impl hw_traits::Error for FakeError {
    fn kind(&self) -> ErrorKind {
        self.0
    }
}

/// A court with a ball: [`Microphones`] and [`Arm`] on one clock. A copy goes on as the original would.
#[derive(Clone)]
pub struct Court {
    room: Room,
    settings: CourtSettings,
    ball: FakeBall,
    rng: ChaCha8Rng,
    arm: PaddleArm,
    energy: f64,
    /// What the microphones will hear of the throw, and its first sample's number.
    sound: Vec<Vec<f64>>,
    sound_from: usize,
    /// Samples that were read.
    read: usize,
    flown: Flown,
    /// When and where (y, z) the ball goes through the plane.
    crossing: Option<(f64, [f64; 2])>,
    verdict: Verdict,
    phases: [f64; 4],
}

impl ErrorType for Court {
    type Error = FakeError;
}

impl Court {
    /// A court in a room, with a ball.
    pub fn new(room: Room, ball: FakeBall, settings: CourtSettings, seed: u64) -> Self {
        let channels = room.microphones_m().len();
        let arm = PaddleArm::new(settings.arm, settings.home_m);
        Self {
            room,
            settings,
            ball,
            rng: ChaCha8Rng::seed_from_u64(seed),
            arm,
            energy: 0.0,
            sound: vec![Vec::new(); channels],
            sound_from: 0,
            read: 0,
            flown: Flown { touchdowns: Vec::new(), path: Vec::new() },
            crossing: None,
            verdict: Verdict::Out,
            phases: [0.0; 4],
        }
    }

    /// A living room of 4 x 5 x 2.7 m with the table of [Matl 2021] and three microphones 3 inches above it.
    ///
    /// # Errors
    /// [`RoomError`] for a reverberation time out of range, s.
    pub fn living_room(rt60_s: f64) -> Result<Room, RoomError> {
        let microphones = [[0.0, 0.0, 0.0762], [0.55, 0.0, 0.0762], [0.275, 0.55, 0.0762]];
        Room::new([4.0, 5.0, 2.7], [1.7, 2.2, 0.75], rt60_s, 343.0, &microphones, 44_100.0)
    }

    /// Throws the ball. It flies as it will; what the paddle does changes nothing of it.
    pub fn toss(&mut self, toss: &Toss) {
        let now = self.now_s();
        let CourtSettings { plane_x_m, side_m, .. } = self.settings;
        let mut crossing = None;
        let mut last: Option<(f64, [f64; 3])> = None;
        let over = |t: f64, at: [f64; 3]| {
            if let (Some((t0, p)), true) = (last, at[0] >= plane_x_m) {
                let part = (plane_x_m - p[0]) / (at[0] - p[0]).max(f64::MIN_POSITIVE);
                let between = |k: usize| p[k] + part * (at[k] - p[k]);
                crossing = Some((t0 + part * (t - t0), [between(1), between(2)]));
            }
            last = Some((t, at));
            at[0] >= plane_x_m || !(side_m[0]..=side_m[1]).contains(&at[1]) || at[0] < -0.1
        };
        let up = [0.0, 0.0, 1.0];
        self.flown = self.ball.fly(toss.place_m, toss.velocity_m_s, up, LONGEST_S, over, &mut self.rng);
        let begin = now + QUIET_S;
        self.crossing = crossing.map(|(t, at)| (begin + t, at));
        let reach = self.settings.arm.reach_m;
        let within = |at: &[f64; 2]| (0..2).all(|k| (reach[k + 1][0]..=reach[k + 1][1]).contains(&at[k]));
        self.verdict = match &self.crossing {
            Some((_, at)) if within(at) => Verdict::Flying,
            _ => Verdict::Out,
        };
        self.sound_from = self.read;
        let lasts = self.flown.path.last().map_or(0.0, |p| p.0) + QUIET_S + 0.5;
        let length = (lasts * self.room.rate_hz()) as usize;
        self.sound.iter_mut().for_each(|x| {
            x.clear();
            x.resize(length, 0.0);
        });
        for down in &self.flown.touchdowns {
            let burst = Burst::new(0.02 * down.speed_m_s, &mut self.rng);
            self.room.strike(down.place_m, QUIET_S + down.t_s, &burst, &mut self.sound);
        }
    }

    /// Now, on the one clock, s.
    pub fn now_s(&self) -> f64 {
        self.read as f64 / self.room.rate_hz()
    }

    /// How the throw ended.
    pub fn verdict(&self) -> Verdict {
        self.verdict
    }

    /// Whether the throw is over and its sound has faded.
    pub fn is_over(&self) -> bool {
        self.verdict != Verdict::Flying
            || self.read >= self.sound_from + self.sound.first().map_or(0, Vec::len)
    }

    /// The throw as it is, impacts in s from its start: nothing that a robot could know.
    pub fn truth(&self) -> &Flown {
        &self.flown
    }

    /// When a throw's impacts are heard at the table, s on the clock.
    pub fn impact_times_s(&self) -> impl Iterator<Item = f64> {
        let begin = self.sound_from as f64 / self.room.rate_hz() + QUIET_S;
        self.flown.touchdowns.iter().map(move |d| begin + d.t_s)
    }

    /// Kinetic energy of the paddle over its mass, integrated over time so far, m^2/s.
    pub fn energy_m2_s(&self) -> f64 {
        self.energy
    }

    /// Puts the paddle back where it waits, at once, and forgets the energy.
    pub fn rest(&mut self) {
        self.arm = PaddleArm::new(self.settings.arm, self.settings.home_m);
        self.energy = 0.0;
    }

    /// One instant: what the microphones hear, and what goes on meanwhile.
    fn instant(&mut self, frame: &mut [f32]) {
        let (t, rate) = (self.now_s(), self.room.rate_hz());
        let (paddle, velocity) = self.arm.at(t);
        let square = velocity.iter().map(|v| v * v).sum::<f64>();
        self.energy += 0.5 * square / rate;
        if let (Verdict::Flying, Some((when, [y, z]))) = (self.verdict, self.crossing)
            && t >= when
        {
            let off = (paddle[1] - y).hypot(paddle[2] - z);
            let by = off - self.settings.paddle_radius_m - self.ball.radius_m;
            self.verdict = if by <= 0.0 { Verdict::Touched } else { Verdict::Missed(by) };
        }
        let speed = square.sqrt();
        let mut motors = 0.0;
        for (phase, hz) in self.phases.iter_mut().zip(MOTORS_HZ) {
            *phase = (*phase + TAU * hz * (0.5 + 0.5 * speed) / rate) % TAU;
            motors += phase.sin();
        }
        let at = self.read - self.sound_from;
        for (v, x) in frame.iter_mut().zip(&self.sound) {
            let hiss = self.settings.noise * self.rng.sample::<f64, _>(StandardNormal);
            let arm = self.settings.arm_noise * speed * (motors + self.rng.sample::<f64, _>(StandardNormal));
            let sum = x.get(at).copied().unwrap_or(0.0) + hiss + arm;
            *v = sum.clamp(-1.0, 1.0) as f32;
        }
        self.read += 1;
    }
}

impl Microphones for Court {
    fn channels(&self) -> usize {
        self.sound.len()
    }

    fn rate_hz(&self) -> f64 {
        self.room.rate_hz()
    }

    fn read(&mut self, interleaved: &mut [f32]) -> Result<f64, FakeError> {
        let t_s = self.now_s();
        let channels = self.channels();
        if interleaved.len() < channels {
            return Err(FakeError(ErrorKind::OutOfRange));
        }
        for frame in interleaved.chunks_exact_mut(channels) {
            self.instant(frame);
        }
        Ok(t_s)
    }
}

impl Arm for Court {
    fn move_to(&mut self, tool_in_base: Pose, deadline_s: f64) -> Result<(), FakeError> {
        let turned = tool_in_base.rotation_xyzw.iter().map(|q| q * q).sum::<f64>();
        let known = tool_in_base.position_m.iter().chain([&deadline_s]).all(|v| v.is_finite());
        let unit = (turned.sqrt() - 1.0).abs() < 1e-6;
        if !(known && unit && self.arm.reaches(tool_in_base.position_m) && deadline_s > 0.0) {
            return Err(FakeError(ErrorKind::OutOfRange));
        }
        if self.arm.command(self.now_s(), tool_in_base.position_m, deadline_s) {
            Ok(())
        } else {
            Err(FakeError(ErrorKind::Timeout))
        }
    }

    fn pose(&mut self) -> Result<Stamped<Pose>, FakeError> {
        let t_s = self.now_s();
        let value = Pose { position_m: self.arm.at(t_s).0, rotation_xyzw: [0.0, 0.0, 0.0, 1.0] };
        Ok(Stamped { t_s, value })
    }

    fn settled(&mut self) -> Result<bool, FakeError> {
        Ok(self.arm.is_still(self.now_s()))
    }
}

impl Toss {
    /// A throw towards the plane with a hand's chance: from a mean, Gaussian in each coordinate.
    pub fn draw<R: Rng + ?Sized>(
        mean: &Self,
        place_sigma_m: f64,
        velocity_sigma_m_s: f64,
        rng: &mut R,
    ) -> Self {
        let mut about =
            |mean: [f64; 3], sigma: f64| mean.map(|m| m + sigma * rng.sample::<f64, _>(StandardNormal));
        Self {
            place_m: about(mean.place_m, place_sigma_m),
            velocity_m_s: about(mean.velocity_m_s, velocity_sigma_m_s),
        }
    }
}
