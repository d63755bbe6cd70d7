//! A joint that speeds up, goes on and slows down.

use std::f64::consts::PI;

use hw_traits::ErrorKind;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// How fast the wrist speeds up and slows down, rad/s^2.
const ACCELERATION_RAD_S2: f64 = 40.0;
/// Fastest turn, rad/s (UR5, wrist joints).
pub(super) const FASTEST_RAD_S: f64 = PI;

/// Smallest and largest angle, rad.
pub(super) const LIMITS_RAD: (f64, f64) = (0.0, PI);
/// Standard deviation of the measured angle, rad.
const ANGLE_NOISE_RAD: f64 = 1e-4;

/// Where a joint is, how fast it turns, and the angle and rate it was last sent to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Joint {
    pub(super) angle_rad: f64,
    pub(super) speed_rad_s: f64,
    pub(super) goal: (f64, f64),
}

impl Joint {
    /// At rest, upright.
    pub(super) fn new() -> Self {
        Self { angle_rad: 0.0, speed_rad_s: 0.0, goal: (0.0, FASTEST_RAD_S) }
    }

    /// Whether it stands at its goal.
    pub(super) fn settled(&self) -> bool {
        self.angle_rad == self.goal.0 && self.speed_rad_s == 0.0
    }

    /// Whether it can be sent to an angle at a rate.
    pub(super) fn allows(angle_rad: f64, rate_rad_s: f64) -> Result<(), ErrorKind> {
        let (low, high) = LIMITS_RAD;
        let within = (low..=high).contains(&angle_rad) && rate_rad_s > 0.0;
        within.then_some(()).ok_or(ErrorKind::OutOfRange)
    }

    /// The angle as it is measured, rad.
    pub(super) fn measured_rad(&self, rng: &mut ChaCha8Rng) -> f64 {
        let noise: f64 = StandardNormal.sample(rng);
        self.angle_rad + ANGLE_NOISE_RAD * noise
    }

    /// One step of the motion towards the goal, at most `h` long (s): speed up, go on, or slow down in time.
    pub(super) fn turn(&mut self, h: f64) {
        let (goal, rate) = self.goal;
        let way = goal - self.angle_rad;
        let towards = way.signum();
        let braking = (2.0 * ACCELERATION_RAD_S2 * way.abs()).sqrt();
        let wanted = towards * rate.min(FASTEST_RAD_S).min(braking);
        let change = ACCELERATION_RAD_S2 * h;
        self.speed_rad_s += (wanted - self.speed_rad_s).clamp(-change, change);
        let step = self.speed_rad_s * h;
        if step.abs() >= way.abs() {
            (self.angle_rad, self.speed_rad_s) = (goal, 0.0);
        } else {
            self.angle_rad += step;
        }
    }
}
