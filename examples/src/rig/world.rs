use std::f64::consts::PI;

use hw_traits::clock::{Clock, Stamped};
use hw_traits::force_torque::{ForceTorque, Wrench};
use hw_traits::rotary::Rotary;
use hw_traits::{ErrorKind, ErrorType};
use liquid_haptics::fake::{AXIA80, Cavity, FakeWrist, Load, Round, Sensor};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{
    BEAD_M, BOTTLE_KG, DENSITY_KG_M3, GRASP_M, GRAVITY_M_S2, GRIPPER_KG, LENGTH_M, RADIUS_M, SHELL_M, WALL_M,
};

/// Glycerol at room temperature, m^2/s.
const VISCOSITY_M2_S: f64 = 1.12e-3;
/// Records a second.
const RATE_HZ: f64 = 1000.0;
/// Upright to within so much, rad.
const UPRIGHT_RAD: f64 = 0.02;
/// The fastest turn of the wrist, rad/s.
const FASTEST_RAD_S: f64 = PI;

/// What the world knows and the programme does not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Volume in the bottle at first, m^3.
    pub before_m3: f64,
    /// Volume in the bottle now, m^3.
    pub now_m3: f64,
    /// By how much the bottle slides in the grip, m.
    pub slip_m: f64,
    /// The tilt at which it does so, after the pour, rad.
    pub slip_tilt_rad: f64,
}

/// What the bottle has been through.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    Full,
    Poured,
    /// Upright again, with glycerol on its outside.
    Slippery,
    Slipped,
}

/// An open bottle of glycerol in a gripper at a wrist, with a sensor between them: it pours over its rim where it is tilted far enough, and the next
/// time that it is tilted it slides in the grip.
///
/// Its physics is [`FakeWrist`]'s, which shares no formula with the estimators. It is a rig of its own, in simulated time; emulators of devices
/// ask it what is felt.
#[derive(Debug)]
pub struct World {
    wrist: FakeWrist,
    cavity: Round,
    bead_m: f64,
    stage: Stage,
    truth: Truth,
}

impl World {
    /// A bottle with 105 to 120 mL of glycerol in it; how much, how far it slides and where are drawn from the seed.
    ///
    /// # Errors
    /// None for a bottle that holds so much.
    pub fn new(seed: u64) -> Result<Self, ErrorKind> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let before_m3 = rng.random_range(105e-6..120e-6);
        let truth = Truth {
            before_m3,
            now_m3: before_m3,
            slip_m: rng.random_range(0.003..0.006),
            slip_tilt_rad: rng.random_range(0.25..0.75),
        };
        let load = Load {
            cavity: Box::new(Round::new(RADIUS_M, LENGTH_M, WALL_M, 500)),
            radius_m: RADIUS_M,
            length_m: LENGTH_M,
            liquid_mass_kg: DENSITY_KG_M3 * before_m3,
            volume_m3: before_m3,
            viscosity_m2_s: VISCOSITY_M2_S,
            container_mass_kg: BOTTLE_KG,
            gripper_mass_kg: GRIPPER_KG,
            grasp_height_m: GRASP_M,
            shell_center_m: SHELL_M,
            force_gain: 0.0,
            gravity_m_s2: GRAVITY_M_S2,
        };
        Ok(Self {
            wrist: FakeWrist::new(load, Sensor { rate_hz: RATE_HZ, ..AXIA80 }, seed)?,
            cavity: Round::new(RADIUS_M, LENGTH_M, WALL_M, 20_000),
            bead_m: BEAD_M + rng.random_range(-3e-4..3e-4),
            stage: Stage::Full,
            truth,
        })
    }

    /// What the programme has to find.
    pub fn truth(&self) -> Truth {
        Truth { now_m3: self.wrist.load().volume_m3, ..self.truth }
    }

    /// What a sensor reads a record later, with the wrist on its way to a tilt (rad).
    ///
    /// # Errors
    /// [`ErrorKind::Saturated`].
    pub fn felt(&mut self, tilt_rad: f64) -> Result<Wrench, ErrorKind> {
        self.wrist.turn_to(tilt_rad.clamp(0.0, PI), FASTEST_RAD_S)?;
        self.read().map(|reading| reading.value)
    }

    /// Glycerol leaves over the rim where the wrist stands still; what runs down the outside lets the bottle slide.
    fn happen(&mut self) -> Result<(), ErrorKind> {
        let tilt = self.wrist.angle_rad()?.value;
        match self.stage {
            Stage::Full | Stage::Poured if self.wrist.settled()? => {
                let level = (LENGTH_M + WALL_M) * tilt.cos() - RADIUS_M * tilt.sin() + self.bead_m;
                let stays = self.cavity.below(tilt, level)[0];
                if stays < self.wrist.load().volume_m3 * (1.0 - 1e-6) {
                    self.wrist.spill(stays);
                    self.stage = Stage::Poured;
                }
                if self.stage == Stage::Poured && tilt < UPRIGHT_RAD {
                    self.stage = Stage::Slippery;
                }
            }
            Stage::Slippery if tilt > self.truth.slip_tilt_rad => {
                self.wrist.slip(self.truth.slip_m);
                self.stage = Stage::Slipped;
            }
            _ => {}
        }
        Ok(())
    }
}

impl ErrorType for World {
    type Error = ErrorKind;
}

impl Rotary for World {
    fn limits_rad(&self) -> (f64, f64) {
        self.wrist.limits_rad()
    }

    fn turn_to(&mut self, angle_rad: f64, rate_rad_s: f64) -> Result<(), ErrorKind> {
        self.wrist.turn_to(angle_rad, rate_rad_s)
    }

    fn angle_rad(&mut self) -> Result<Stamped<f64>, ErrorKind> {
        self.wrist.angle_rad()
    }

    fn settled(&mut self) -> Result<bool, ErrorKind> {
        self.wrist.settled()
    }
}

impl ForceTorque for World {
    fn read(&mut self) -> Result<Stamped<Wrench>, ErrorKind> {
        self.happen()?;
        self.wrist.read()
    }

    fn tare(&mut self, readings: usize) -> Result<(), ErrorKind> {
        self.wrist.tare(readings)
    }
}

impl Clock for World {
    fn now_s(&mut self) -> Result<f64, ErrorKind> {
        self.wrist.now_s()
    }

    fn sleep_s(&mut self, duration_s: f64) -> Result<(), ErrorKind> {
        self.happen()?;
        self.wrist.sleep_s(duration_s)
    }
}
