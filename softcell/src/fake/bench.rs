//! The box of [Matl 2021], figure 5.8: the tip holds it against a wall while beads are poured in.

use hw_traits::camera::Camera;
use hw_traits::clock::{Clock, Stamped};
use hw_traits::picture::{NotRows, Picture};
use hw_traits::pneumatics::{Pressure, Valve};
use hw_traits::{Error, ErrorKind, ErrorType};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use super::air::Air;
use super::dome::Dome;
use super::render::Eye;
use super::touch::Touch;

/// What the rig refuses.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FakeError {
    /// A command outside -1 to 1.
    #[error("the valve was told to open by {0}; expected -1 to 1")]
    Valve(f64),
    /// More pressure than the sensor reads.
    #[error("{0} Pa is beyond the pressure sensor")]
    Saturated(f64),
    /// The camera has no pixels.
    #[error(transparent)]
    Picture(#[from] NotRows),
}

impl Error for FakeError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Valve(_) => ErrorKind::OutOfRange,
            Self::Saturated(_) => ErrorKind::Saturated,
            Self::Picture(_) => ErrorKind::Other,
        }
    }
}

/// Tip, box, wall and beads; time passes with each picture.
#[derive(Debug, Clone)]
pub struct Bench {
    /// The tip.
    pub dome: Dome,
    /// Its air.
    pub air: Air,
    /// Its camera.
    pub eye: Eye,
    /// What touches it; shear is the box's doing where there is one.
    pub touch: Touch,
    /// Whether a box is held; without one the touch stays as it is set.
    pub holds_box: bool,
    /// Indentation without pressure, m.
    pub indentation_m: f64,
    /// Friction between box and wall.
    pub wall_friction: f64,
    /// Mass of box and beads, kg.
    pub mass_kg: f64,
    /// Beads that are poured in, kg/s.
    pub pour_kg_s: f64,
    /// Drag of the sliding box, N s/m.
    pub drag_n_s_m: f64,
    /// Standard deviation of the pressure reading, Pa.
    pub pressure_noise_pa: f64,
    /// Pictures a second.
    pub rate_hz: f64,
    t_s: f64,
    last_pressure_s: f64,
    rng: ChaCha8Rng,
}

/// Gravity, m/s^2.
const GRAVITY: f64 = 9.80665;
/// Range of the pressure sensor, Pa.
const FULL_SCALE_PA: f64 = 1.3e6;

impl Bench {
    /// The box of [Matl 2021] of 31.6 g, pressed in by 8.12 mm, not poured into.
    pub fn matl_2021(seed: u64) -> Self {
        Self {
            dome: Dome::matl_2021(),
            air: Air::matl_2021(),
            eye: Eye::matl_2021(),
            touch: Touch { friction: 1.2, ..Touch::none() },
            holds_box: true,
            indentation_m: 8.12e-3,
            wall_friction: 0.45,
            mass_kg: 31.6e-3,
            pour_kg_s: 0.0,
            drag_n_s_m: 40.0,
            pressure_noise_pa: 10.0,
            rate_hz: 30.0,
            t_s: 0.0,
            last_pressure_s: f64::NEG_INFINITY,
            rng: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// Time that has passed, s.
    pub fn t_s(&self) -> f64 {
        self.t_s
    }

    /// Indentation now: the tip grows between base and box, m.
    pub fn indentation_now_m(&self) -> f64 {
        self.indentation_m + self.dome.growth_m_pa * self.air.pressure_pa
    }

    /// Normal force now, N.
    pub fn normal_n(&self) -> f64 {
        self.dome.force_n(self.air.pressure_pa, f64::INFINITY, self.indentation_now_m())
    }

    /// Load that the skin carries at a shear of the box, N (Mindlin: ever less for more).
    pub fn carried_n(&self, shear_m: f64) -> f64 {
        let contact = self.touch.contact_m(self.dome.radius_at_m(self.air.pressure_pa));
        let part = (shear_m.abs() / self.touch.slides_m(contact)).min(1.0);
        self.touch.friction * self.normal_n() * (1.0 - (1.0 - part).powf(1.5)) * shear_m.signum()
    }

    /// Lets time pass.
    pub fn pass(&mut self, duration_s: f64) {
        let steps = (duration_s / 1e-3).ceil().max(1.0) as usize;
        let dt = duration_s / steps as f64;
        for _ in 0..steps {
            self.air.pass(dt);
            self.t_s += dt;
            if self.holds_box {
                self.slide(dt);
            }
        }
    }

    /// The box slides down the wall while its weight is more than wall and skin hold.
    fn slide(&mut self, dt: f64) {
        self.mass_kg += self.pour_kg_s * dt;
        self.touch.indentation_m = self.indentation_now_m();
        let down = self.touch.shear_m[1];
        let excess = self.mass_kg * GRAVITY - self.carried_n(down) - self.wall_friction * self.normal_n();
        if excess > 0.0 {
            self.touch.shear_m[1] += excess / self.drag_n_s_m * dt;
        }
    }

    /// Where the markers truly are in the picture.
    pub fn markers_px(&self) -> Vec<[f64; 2]> {
        self.points().iter().filter_map(|p| self.eye.pixel(*p)).collect()
    }

    fn points(&self) -> Vec<[f64; 3]> {
        let at = |m: &[f64; 2]| self.touch.point(&self.dome, self.air.pressure_pa, *m);
        self.dome.markers.iter().map(at).collect()
    }
}

impl ErrorType for Bench {
    type Error = FakeError;
}

impl Camera for Bench {
    fn picture(&mut self) -> Result<Stamped<Picture<u8>>, FakeError> {
        self.pass(1.0 / self.rate_hz);
        let value = self.eye.picture(&self.points(), &mut self.rng)?;
        Ok(Stamped { t_s: self.t_s, value })
    }
}

impl Pressure for Bench {
    fn pressure_pa(&mut self) -> Result<Stamped<f64>, FakeError> {
        if self.t_s <= self.last_pressure_s {
            self.pass(1e-3);
        }
        self.last_pressure_s = self.t_s;
        let noise: f64 = StandardNormal.sample(&mut self.rng);
        let value = self.air.pressure_pa + self.pressure_noise_pa * noise;
        if value > FULL_SCALE_PA {
            return Err(FakeError::Saturated(value));
        }
        Ok(Stamped { t_s: self.t_s, value: value.round() })
    }
}

impl Valve for Bench {
    fn open(&mut self, fraction: f64) -> Result<(), FakeError> {
        if !(-1.0..=1.0).contains(&fraction) {
            return Err(FakeError::Valve(fraction));
        }
        self.air.command = fraction;
        Ok(())
    }
}

impl Clock for Bench {
    fn now_s(&mut self) -> Result<f64, FakeError> {
        Ok(self.t_s)
    }

    fn sleep_s(&mut self, duration_s: f64) -> Result<(), FakeError> {
        if duration_s > 0.0 {
            self.pass(duration_s);
        }
        Ok(())
    }
}
