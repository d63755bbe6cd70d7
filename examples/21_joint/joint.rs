//! A simulated joint: an arm that hangs from a motor with an encoder, by steps of its own that are 500 times finer than its cycle.

use std::collections::VecDeque;
use std::fmt;

use hw_traits::clock::{Clock, Stamped};
use hw_traits::motor::{Motor, MotorReading};
use hw_traits::{ErrorKind, ErrorType};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, Normal};

/// The drive's cycle, s, and the steps of the simulation in it.
pub(super) const CYCLE_S: f64 = 0.005;
const STEPS: usize = 500;
/// The motor's largest torque, N m.
pub(super) const LIMIT_NM: f64 = 1.5;
/// Time constant of the current's control, s.
pub(super) const CURRENT_S: f64 = 0.004;
/// Steps of the encoder in a turn, the jitter of its readings, rad, and of the current's, N m; one sigma.
const STEPS_A_TURN: f64 = 4096.0;
const JITTER_RAD: f64 = 3e-3;
pub(super) const SIGMA_NM: f64 = 0.01;

/// What the joint is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Truth {
    /// Moment of inertia, kg m^2, and the torque of the weight of a level arm, N m.
    inertia_kg_m2: f64,
    weight_nm: f64,
    /// Viscous friction, N m s.
    viscous_nm_s: f64,
    /// Hidden: dry friction at rest, N m, the speed at which it has faded to a third, rad/s, and how late commands act, s.
    friction_nm: f64,
    fades_rad_s: f64,
    delay_s: f64,
}

impl Truth {
    /// One that is hidden from whoever diagnoses.
    pub(super) fn draw(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        Self {
            inertia_kg_m2: rng.random_range(0.018..0.022),
            weight_nm: rng.random_range(0.4..0.6),
            viscous_nm_s: rng.random_range(0.02..0.04),
            friction_nm: rng.random_range(0.01..0.02),
            fades_rad_s: rng.random_range(0.5..1.5),
            delay_s: rng.random_range(0.006..0.016),
        }
    }

    /// The most by which dry friction slows down at a speed, rad/s^2.
    pub(super) fn rubs(&self, rate_rad_s: f64) -> f64 {
        self.friction_nm / self.inertia_kg_m2 * (-(rate_rad_s / self.fades_rad_s).powi(2)).exp()
    }

    /// The hidden parameters by their names in the domain.
    pub(super) fn hidden(&self) -> [(&'static str, &'static str, f64); 3] {
        [
            ("stribeck-friction", "level", self.friction_nm / self.inertia_kg_m2),
            ("stribeck-friction", "speed", self.fades_rad_s),
            ("input-delay", "delay_s", self.delay_s),
        ]
    }
}

/// What is hidden.
impl fmt::Display for Truth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (friction_nm, fades_rad_s, delay_ms) = (self.friction_nm, self.fades_rad_s, 1e3 * self.delay_s);
        write!(
            f,
            "dry friction of {friction_nm:.4} N m at rest that fades over {fades_rad_s:.2} rad/s, commands late by {delay_ms:.1} ms"
        )
    }
}

/// The joint; its time passes while somebody waits.
pub(super) struct Joint {
    truth: Truth,
    cycles: u64,
    angle_rad: f64,
    rate_rad_s: f64,
    motor_nm: f64,
    /// Commands under way, with the step from which on they act, and the one that acts.
    coming: VecDeque<(u64, f64)>,
    acting_nm: f64,
    jitter: Normal<f64>,
    current: Normal<f64>,
    rng: ChaCha8Rng,
}

impl Joint {
    /// The arm hangs and stands still.
    pub(super) fn new(truth: Truth, seed: u64) -> Result<Self, rand_distr::NormalError> {
        Ok(Self {
            truth,
            cycles: 0,
            angle_rad: 0.0,
            rate_rad_s: 0.0,
            motor_nm: 0.0,
            coming: VecDeque::new(),
            acting_nm: 0.0,
            jitter: Normal::new(0.0, JITTER_RAD)?,
            current: Normal::new(0.0, SIGMA_NM)?,
            rng: ChaCha8Rng::seed_from_u64(seed ^ 0x006a_6f69_6e74),
        })
    }

    /// Where the arm is, which no sensor says, rad.
    pub(super) fn place_rad(&self) -> f64 {
        self.angle_rad
    }

    /// Acceleration without dry friction, rad/s^2.
    fn free(&self, angle_rad: f64, rate_rad_s: f64, motor_nm: f64) -> f64 {
        let t = &self.truth;
        (motor_nm - t.weight_nm * angle_rad.sin() - t.viscous_nm_s * rate_rad_s) / t.inertia_kg_m2
    }

    /// One step by the midpoint's rule: an arm that stands does so until more pulls at it than friction holds, and one whose speed would
    /// change its sign in the step stands first.
    fn step(&mut self, h: f64) {
        let decay = (-h / CURRENT_S).exp();
        let half_nm = self.acting_nm + (self.motor_nm - self.acting_nm) * decay.sqrt();
        let end_nm = self.acting_nm + (self.motor_nm - self.acting_nm) * decay;
        let pull = self.free(self.angle_rad, self.rate_rad_s, self.motor_nm);
        let begun = self.rate_rad_s;
        let sign = if begun == 0.0 { pull.signum() } else { begun.signum() };
        if begun != 0.0 || pull.abs() > self.truth.rubs(0.0) {
            let mid_rate = begun + 0.5 * h * (pull - sign * self.truth.rubs(begun));
            let mid_angle = self.angle_rad + 0.5 * h * begun;
            let end =
                begun + h * (self.free(mid_angle, mid_rate, half_nm) - sign * self.truth.rubs(mid_rate));
            if end * sign > 0.0 {
                self.angle_rad += h * mid_rate;
                self.rate_rad_s = end;
            } else {
                self.angle_rad += 0.5 * h * begun;
                self.rate_rad_s = 0.0;
            }
        }
        self.motor_nm = end_nm;
    }

    fn cycle(&mut self) {
        let h = CYCLE_S / STEPS as f64;
        for k in 0..STEPS as u64 {
            let now = self.cycles * STEPS as u64 + k;
            while let Some((_, torque_nm)) = self.coming.pop_front_if(|c| c.0 <= now) {
                self.acting_nm = torque_nm;
            }
            self.step(h);
        }
        self.cycles += 1;
    }
}

impl ErrorType for Joint {
    type Error = ErrorKind;
}

impl Clock for Joint {
    fn now_s(&mut self) -> Result<f64, ErrorKind> {
        Ok(self.cycles as f64 * CYCLE_S)
    }

    /// In whole cycles.
    fn sleep_s(&mut self, duration_s: f64) -> Result<(), ErrorKind> {
        if duration_s > 0.0 {
            (0..(duration_s / CYCLE_S).ceil() as usize).for_each(|_| self.cycle());
        }
        Ok(())
    }
}

impl Motor for Joint {
    fn limit_nm(&self) -> f64 {
        LIMIT_NM
    }

    fn drive(&mut self, torque_nm: f64) -> Result<(), ErrorKind> {
        if torque_nm.is_nan() || torque_nm.abs() > LIMIT_NM {
            return Err(ErrorKind::OutOfRange);
        }
        let late = (self.truth.delay_s / CYCLE_S * STEPS as f64).round() as u64;
        self.coming.push_back((self.cycles * STEPS as u64 + late, torque_nm));
        Ok(())
    }

    fn read(&mut self) -> Result<Stamped<MotorReading>, ErrorKind> {
        self.cycle();
        let step = std::f64::consts::TAU / STEPS_A_TURN;
        let angle_rad = ((self.angle_rad + self.jitter.sample(&mut self.rng)) / step).round() * step;
        let torque_nm = self.motor_nm + self.current.sample(&mut self.rng);
        Ok(Stamped { t_s: self.cycles as f64 * CYCLE_S, value: MotorReading { angle_rad, torque_nm } })
    }
}
