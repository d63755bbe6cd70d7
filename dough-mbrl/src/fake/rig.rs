//! The rig: motion, contact and time.

use hw_traits::arm::{Arm, Pose};
use hw_traits::camera::DepthCamera;
use hw_traits::clock::{Clock, Stamped};
use hw_traits::gripper::Gripper;
use hw_traits::picture::{Intrinsics, Picture};
use hw_traits::{Error, ErrorKind, ErrorType};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::body::{Body, Material};
use super::camera::Eye;
use super::hand::{Elastic, Fingers, knead, press};
use super::kind::{DoughKind, Effects, hardness_pa};

/// Why the fake did not do something.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FakeError {
    /// A pose, a width or a speed outside what it can do.
    #[error("the command is outside the rig's range")]
    OutOfRange,
    /// A deadline that needs more than the arm's speed of 0.5 m/s.
    #[error("the arm cannot be there in time")]
    TooFast,
    /// The fingers stand in the dough.
    #[error("the fingers hit the dough: they stand closer than it is wide")]
    Hit,
}

impl Error for FakeError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::OutOfRange => ErrorKind::OutOfRange,
            Self::TooFast => ErrorKind::Timeout,
            Self::Hit => ErrorKind::Stopped,
        }
    }
}

/// A move under way: where to, and how long it still takes.
#[derive(Debug, Clone, Copy)]
struct Way<T> {
    to: T,
    left_s: f64,
}

/// An arm with a band between the fingers of its gripper, a table with a dough, a camera above it.
#[derive(Debug, Clone)]
pub struct FakeRig {
    body: Body,
    water_g: f64,
    axial_flow: f64,
    band: Elastic,
    effects: Effects,
    eye: Eye,
    rng: ChaCha8Rng,
    now_s: f64,
    fingers: Fingers,
    rotation_xyzw: [f64; 4],
    arm: Option<Way<[f64; 3]>>,
    gripper: Option<Way<f64>>,
    touching: bool,
    /// Lengths and ovals when the band came down, and what of the change is still to come back.
    before: Vec<(f64, [f64; 2])>,
    coming_back: Vec<(f64, [f64; 2])>,
    hit: bool,
    rigid: Option<f64>,
}

/// Fastest motion of the arm, m/s.
const FASTEST_M_S: f64 = 0.5;
/// Lowest level of the tool, m: a camera sees the table's level to a fraction of this.
const LOWEST_M: f64 = -2e-3;
/// The gripper's limits, m.
const THROWS_M: (f64, f64) = (0.01, 0.12);
/// Contact is followed in steps of this size, m.
const STEP_M: f64 = 1.5e-3;
/// Friction of the band on dough.
const FRICTION: f64 = 0.25;
/// Time in which springback comes back, s.
const RECOVERY_S: f64 = 2.0;
/// Elastic modulus over hardness.
const STIFFNESS_RATIO: f64 = 14.0;

impl FakeRig {
    /// A rig with a fresh ball of dough at (0.4, 0); the seed makes its shape and the camera's noise.
    pub fn new(kind: DoughKind, effects: Effects, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let shift = [rng.random_range(-4e-3..4e-3), rng.random_range(-4e-3..4e-3)];
        let body = Body::ball(kind.volume_m3.max(1e-9), [0.4 + shift[0], shift[1]], || {
            rng.random_range(-0.03..0.03)
        });
        Self {
            body,
            water_g: kind.water_g,
            axial_flow: if kind.axial_flow > 0.0 { kind.axial_flow.min(1.0) } else { 1.0 },
            band: Elastic { natural_m: 0.025, modulus_n: 0.85, breadth_m: 0.04 },
            effects,
            eye: Eye::overhead(),
            rng,
            now_s: 0.0,
            fingers: Fingers { at_m: [0.25, 0.0, 0.2], throw_m: 0.1 },
            rotation_xyzw: [1.0, 0.0, 0.0, 0.0],
            arm: None,
            gripper: None,
            touching: false,
            before: Vec::new(),
            coming_back: Vec::new(),
            hit: false,
            rigid: None,
        }
    }

    /// The same rig with a rigid hemisphere of a diameter (m) in the dough's place: what the band's force is measured on.
    #[must_use]
    pub fn with_rigid_probe(mut self, diameter_m: f64) -> Self {
        self.rigid = Some(diameter_m);
        self
    }

    /// Another camera.
    #[must_use]
    pub fn with_eye(mut self, eye: Eye) -> Self {
        self.eye = eye;
        self
    }

    /// A fresh ball from the same batch, as a person would put it down; the clock goes on.
    pub fn renew(&mut self, kind: DoughKind) {
        let seed = self.rng.random();
        let fresh = Self::new(kind, self.effects, seed);
        (self.body, self.water_g, self.axial_flow) = (fresh.body, kind.water_g, fresh.axial_flow);
        (self.touching, self.before, self.coming_back) = (false, Vec::new(), Vec::new());
    }

    /// The camera's pose in the world, from its calibration.
    pub fn camera_in_world(&self) -> Pose {
        self.eye.pose_in_world
    }

    /// The true volume, m^3, for those who judge.
    pub fn volume_m3(&self) -> f64 {
        self.body.volume_m3()
    }

    /// The true length, width and height, m, for those who judge.
    pub fn truth(&self) -> [f64; 3] {
        let most = |f: fn(&super::body::Slice) -> f64| self.body.slices.iter().map(f).fold(0.0, f64::max);
        [
            self.body.length_m(),
            2.0 * most(super::body::Slice::half_width_m),
            most(super::body::Slice::height_m),
        ]
    }

    /// Force on the probe under the band, N, as a force sensor below it tells it; zero where the band is free.
    pub fn probe_force_n(&self) -> f64 {
        match self.rigid {
            Some(diameter) => self.band.force_n(self.fingers.throw_m, diameter - self.fingers.at_m[2], 0.0),
            None => press(&self.body, &self.band, &self.fingers, &self.material()).map_or(0.0, |p| p.force_n),
        }
    }

    fn material(&self) -> Material {
        let hardness_pa = hardness_pa(self.water_g);
        Material { hardness_pa, elastic_pa: STIFFNESS_RATIO * hardness_pa, axial_flow: self.axial_flow }
    }

    fn advance(&mut self, duration_s: f64) {
        let speed = self.arm.map_or(0.0, |way| distance(self.fingers.at_m, way.to) / way.left_s.max(1e-9));
        let steps = ((speed * duration_s / STEP_M).ceil() as usize).clamp(1, 10_000);
        let dt = duration_s / steps as f64;
        for _ in 0..steps {
            self.step(dt);
        }
        self.now_s += duration_s;
    }

    fn step(&mut self, dt: f64) {
        self.water_g *= (-self.effects.drying_per_s * dt).exp();
        if let Some(way) = self.gripper {
            let part = (dt / way.left_s).min(1.0);
            self.fingers.throw_m += part * (way.to - self.fingers.throw_m);
            let left_s = way.left_s - dt;
            self.gripper = (left_s > 1e-9).then_some(Way { left_s, ..way });
        }
        let before = self.fingers.at_m;
        if let Some(way) = self.arm {
            let part = (dt / way.left_s).min(1.0);
            for k in 0..3 {
                self.fingers.at_m[k] += part * (way.to[k] - self.fingers.at_m[k]);
            }
            let left_s = way.left_s - dt;
            self.arm = (left_s > 1e-9).then_some(Way { left_s, ..way });
        }
        self.contact(self.fingers.at_m[0] - before[0], dt);
    }

    fn contact(&mut self, dx: f64, dt: f64) {
        let material = self.material();
        let pressed =
            if self.rigid.is_some() { None } else { press(&self.body, &self.band, &self.fingers, &material) };
        let Some(pressed) = pressed else {
            if self.touching {
                self.lift();
            }
            self.recover(dt);
            return;
        };
        if !self.touching {
            self.touching = true;
            self.before = self.body.slices.iter().map(|s| (s.length_m, s.oval_m)).collect();
            self.coming_back.clear();
        }
        let wide = self.body.slices.iter().map(|s| 2.0 * s.half_width_m()).fold(0.0, f64::max);
        if self.fingers.throw_m < 0.85 * wide && self.fingers.at_m[2] < 0.8 * pressed.height_m {
            self.hit = true;
            self.arm = None;
            return;
        }
        if pressed.force_n < self.effects.slip_n {
            return;
        }
        // Beyond what friction drives, part of the way is slid and not rolled.
        let over = pressed.needs / FRICTION;
        let rolled = if over > 1.0 { over.powi(-2) } else { 1.0 };
        let way = 0.5 * dx * rolled;
        self.body.at_m[0] += way;
        let angle = way.abs() / (0.5 * pressed.height_m);
        knead(&mut self.body, &self.band, self.fingers.at_m[1], &pressed, angle, &material);
    }

    /// The band leaves the dough: some of it sticks, some of the change will come back.
    fn lift(&mut self) {
        self.touching = false;
        self.band.modulus_n *= (-self.effects.softening).exp();
        let sticks = self.effects.sticking;
        let part = self.effects.springback;
        self.coming_back = self
            .body
            .slices
            .iter()
            .zip(&self.before)
            .map(|(s, (length, oval))| {
                let back = |now: f64, then: f64| part * (then - now);
                (back(s.length_m, *length), [back(s.oval_m[0], oval[0]), back(s.oval_m[1], oval[1])])
            })
            .collect();
        if sticks > 0.0 {
            for slice in &mut self.body.slices {
                // Each dimension gets smaller alike.
                let scale = (1.0 - sticks).cbrt();
                slice.volume_m3 *= 1.0 - sticks;
                slice.length_m *= scale;
                slice.oval_m = slice.oval_m.map(|v| v * scale);
            }
        }
    }

    fn recover(&mut self, dt: f64) {
        let part = 1.0 - (-dt / RECOVERY_S).exp();
        for (slice, (length, oval)) in self.body.slices.iter_mut().zip(&mut self.coming_back) {
            slice.length_m += part * *length;
            *length *= 1.0 - part;
            for (now, back) in slice.oval_m.iter_mut().zip(oval) {
                *now += part * *back;
                *back *= 1.0 - part;
            }
        }
    }

    fn stamped<T>(&self, value: T) -> Stamped<T> {
        Stamped { t_s: self.now_s, value }
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

impl ErrorType for FakeRig {
    type Error = FakeError;
}

impl Arm for FakeRig {
    fn move_to(&mut self, tool_in_base: Pose, deadline_s: f64) -> Result<(), FakeError> {
        let p = tool_in_base.position_m;
        let size = tool_in_base.rotation_xyzw.iter().map(|v| v * v).sum::<f64>().sqrt();
        let inside = p.iter().all(|v| v.abs() < 1.0) && p[2] >= LOWEST_M;
        if !(inside && (size - 1.0).abs() < 1e-6 && deadline_s > 0.0 && deadline_s.is_finite()) {
            return Err(FakeError::OutOfRange);
        }
        if distance(self.fingers.at_m, p) > FASTEST_M_S * deadline_s {
            return Err(FakeError::TooFast);
        }
        self.rotation_xyzw = tool_in_base.rotation_xyzw;
        self.arm = Some(Way { to: p, left_s: deadline_s });
        Ok(())
    }

    fn pose(&mut self) -> Result<Stamped<Pose>, FakeError> {
        Ok(self.stamped(Pose { position_m: self.fingers.at_m, rotation_xyzw: self.rotation_xyzw }))
    }

    fn settled(&mut self) -> Result<bool, FakeError> {
        if std::mem::take(&mut self.hit) {
            return Err(FakeError::Hit);
        }
        Ok(self.arm.is_none())
    }
}

impl Gripper for FakeRig {
    fn limits_m(&self) -> (f64, f64) {
        THROWS_M
    }

    fn open_to(&mut self, width_m: f64, speed_m_s: f64) -> Result<(), FakeError> {
        let inside = (THROWS_M.0..=THROWS_M.1).contains(&width_m) && speed_m_s > 0.0 && speed_m_s.is_finite();
        if !inside {
            return Err(FakeError::OutOfRange);
        }
        let left_s = (width_m - self.fingers.throw_m).abs() / speed_m_s;
        self.gripper = (left_s > 1e-9).then_some(Way { to: width_m, left_s });
        Ok(())
    }

    fn width_m(&mut self) -> Result<Stamped<f64>, FakeError> {
        Ok(self.stamped(self.fingers.throw_m))
    }

    fn settled(&mut self) -> Result<bool, FakeError> {
        Ok(self.gripper.is_none())
    }
}

impl DepthCamera for FakeRig {
    fn intrinsics(&self) -> Intrinsics {
        self.eye.intrinsics
    }

    fn depth_m(&mut self) -> Result<Stamped<Picture<f32>>, FakeError> {
        self.advance(1.0 / 30.0);
        // A camera without pixels takes no pictures.
        let picture = self.eye.picture(&self.body, &mut self.rng).map_err(|_| FakeError::OutOfRange)?;
        Ok(self.stamped(picture))
    }
}

impl Clock for FakeRig {
    fn now_s(&mut self) -> Result<f64, FakeError> {
        Ok(self.now_s)
    }

    fn sleep_s(&mut self, duration_s: f64) -> Result<(), FakeError> {
        if duration_s > 0.0 && duration_s.is_finite() {
            self.advance(duration_s);
        }
        Ok(())
    }
}
