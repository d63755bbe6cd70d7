use std::f64::consts::PI;

use hw_traits::clock::{Clock, Stamped};
use hw_traits::force_torque::{ForceTorque, Wrench};
use hw_traits::rotary::Rotary;
use hw_traits::{ErrorKind, ErrorType};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::cavity::Cavity;
use super::film::Film;
use super::joint::{Joint, LIMITS_RAD};
use super::modes::{Modes, Surface, Swinging};
use super::sensor::{Noise, Sensor, tared};
use super::slosh::Slosh;

/// Points of the table of where the liquid lies while the wrist turns; at rest it is summed at the very angle.
const TABLE: usize = 90;
/// Steps in which the motion is followed, s.
const STEP_S: f64 = 2e-3;
/// A liquid more viscous than this (m^2/s) drains down the wall, a thinner one sloshes.
const THICK_M2_S: f64 = 1.2e-3;
/// A film begins on the side, within this angle of a right one, rad.
const ON_ITS_SIDE_RAD: f64 = 0.02;

/// What the wrist holds.
#[derive(Debug)]
pub struct Load {
    /// The cavity.
    pub cavity: Box<dyn Cavity + Send>,
    /// Radius (m) of the cylinder whose modes and film the liquid has.
    pub radius_m: f64,
    /// Length of that cylinder, m.
    pub length_m: f64,
    /// Mass of the liquid, kg.
    pub liquid_mass_kg: f64,
    /// Volume of the liquid, m^3.
    pub volume_m3: f64,
    /// Kinematic viscosity of the liquid, m^2/s.
    pub viscosity_m2_s: f64,
    /// Mass of the empty container, kg.
    pub container_mass_kg: f64,
    /// Mass of the gripper, kg.
    pub gripper_mass_kg: f64,
    /// Height of the grasp above the container's outer bottom, m.
    pub grasp_height_m: f64,
    /// Height of the empty container's centre of mass above its outer bottom, m.
    pub shell_center_m: f64,
    /// Relative error of the forces.
    pub force_gain: f64,
    /// Gravity, m/s^2.
    pub gravity_m_s2: f64,
}

/// A wrist that turns, feels and keeps time. Its clock is the sensor's; times are those of the simulation.
///
/// Wrenches are in the sensor's frame, which turns with the wrist: y along the container's axis, z the joint's, the origin at the
/// grasp.
#[derive(Debug)]
pub struct FakeWrist {
    load: Load,
    sensor: Sensor,
    noise: Noise,
    rng: ChaCha8Rng,
    now_s: f64,
    joint: Joint,
    offset: Wrench,
    /// Where the liquid lies across and along the container's axis at the table's angles, m.
    table: Vec<[f64; 2]>,
    /// Where the liquid lies at the angle that was asked last.
    last: Option<(f64, [f64; 2])>,
    surface: Option<Surface>,
    slosh: Swinging,
    film: Option<Film>,
}

impl FakeWrist {
    /// A wrist at rest, upright; all its noise comes from the seed.
    ///
    /// # Errors
    /// [`ErrorKind::OutOfRange`] for a load of which a number is none or negative, or whose liquid does not fit.
    pub fn new(load: Load, sensor: Sensor, seed: u64) -> Result<Self, ErrorKind> {
        let numbers = [
            load.liquid_mass_kg,
            load.volume_m3,
            load.viscosity_m2_s,
            load.container_mass_kg,
            load.gripper_mass_kg,
            load.gravity_m_s2,
        ];
        let fine = numbers.iter().all(|n| *n >= 0.0 && n.is_finite())
            && load.radius_m > 0.0
            && load.length_m > 0.0
            && load.force_gain.is_finite()
            && load.volume_m3 <= load.cavity.capacity_m3() * (1.0 + 1e-9);
        if !fine {
            return Err(ErrorKind::OutOfRange);
        }
        let (slosh, table) = (slosh(&load, None), table(&load));
        Ok(Self {
            load,
            sensor,
            noise: Noise::new(),
            rng: ChaCha8Rng::seed_from_u64(seed),
            now_s: 0.0,
            joint: Joint::new(),
            offset: Wrench::default(),
            table,
            last: None,
            surface: None,
            slosh,
            film: None,
        })
    }

    /// The same wrist where a thin liquid sloshes in three modes with a real surface, from rest.
    #[must_use]
    pub fn with_surface(mut self, surface: Surface) -> Self {
        self.surface = Some(surface);
        self.slosh = slosh(&self.load, self.surface.as_ref());
        self
    }

    /// The container slides in the grip: from now on it is held `by_m` further from its bottom.
    pub fn slip(&mut self, by_m: f64) {
        self.load.grasp_height_m += by_m;
    }

    /// Liquid leaves: `stays_m3` of it (0 up to what there was) stay, and lie level at once.
    pub fn spill(&mut self, stays_m3: f64) {
        let share = (stays_m3 / self.load.volume_m3).clamp(0.0, 1.0);
        if !(share < 1.0) {
            return;
        }
        let load = &mut self.load;
        load.liquid_mass_kg *= share;
        load.volume_m3 *= share;
        (self.table, self.slosh) = (table(load), slosh(load, self.surface.as_ref()));
        (self.last, self.film) = (None, None);
    }

    /// What it holds.
    pub fn load(&self) -> &Load {
        &self.load
    }

    fn thick(&self) -> bool {
        self.load.viscosity_m2_s > THICK_M2_S
    }

    /// Horizontal place of the liquid's centre of mass at rest, m, from the table.
    fn about(&self, tilt: f64) -> f64 {
        let place = (tilt / PI * TABLE as f64).clamp(0.0, TABLE as f64 - 1e-9);
        let (k, u) = (place as usize, place.fract());
        let ([a, b], [c, d]) = (self.table[k], self.table[k + 1]);
        self.across([a + u * (c - a), b + u * (d - b)], tilt)
    }

    fn across(&self, [x, z]: [f64; 2], tilt: f64) -> f64 {
        let (sin, cos) = tilt.sin_cos();
        x * cos + (z - self.load.grasp_height_m) * sin
    }

    fn advance(&mut self, duration_s: f64) {
        let end = self.now_s + duration_s;
        while self.now_s < end {
            let h = STEP_S.min(end - self.now_s);
            if !(h > 0.0) || self.now_s + h == self.now_s {
                break;
            }
            let before = (self.about(self.joint.angle_rad), self.joint.speed_rad_s, self.joint.angle_rad);
            if self.joint.settled() {
                self.slosh.advance(h, 0.0);
            } else {
                self.joint.turn(h);
                // What the level liquid's centre is accelerated by, from the change of its speed.
                let slope = |wrist: &Self, at: f64| (wrist.about(at + 0.01) - wrist.about(at - 0.01)) / 0.02;
                let speed = slope(self, self.joint.angle_rad) * self.joint.speed_rad_s;
                let acceleration = (speed - slope(self, before.2) * before.1) / h;
                self.slosh.advance(h, acceleration);
            }
            if let Some(film) = &mut self.film {
                film.advance(h, self.joint.angle_rad);
            }
            self.now_s += h;
        }
        self.now_s = end;
    }

    /// Force and torque of the load, in the world's frame.
    fn wrench_in_world(&mut self) -> Wrench {
        let tilt = self.joint.angle_rad;
        let place = match self.last {
            Some((at, place)) if at == tilt => place,
            _ => lies(&self.load, tilt),
        };
        self.last = Some((tilt, place));
        let load = &self.load;
        let place = match &self.film {
            Some(film) => [film.sideways(), place[1]],
            None => place,
        };
        let (sin, cos) = tilt.sin_cos();
        let shell = (load.shell_center_m - load.grasp_height_m) * sin;
        let [swung, push] = if self.thick() { [0.0; 2] } else { self.slosh.felt() };
        // The swinging mass pushes at the height of the liquid's centre.
        let height = (place[1] - load.grasp_height_m) * cos - place[0] * sin;
        let moment = load.container_mass_kg * shell + load.liquid_mass_kg * self.across(place, tilt) + swung;
        let weight =
            (load.container_mass_kg + load.gripper_mass_kg + load.liquid_mass_kg) * load.gravity_m_s2;
        let gain = 1.0 + load.force_gain;
        Wrench {
            force_n: [push * gain, -weight * gain, 0.0],
            torque_nm: [0.0, 0.0, -load.gravity_m_s2 * moment - height * push],
        }
    }
}

/// Where the liquid's centre of mass lies across and along the axis at rest, m.
fn lies(load: &Load, tilt: f64) -> [f64; 2] {
    if load.volume_m3 > 0.0 { load.cavity.center(tilt, load.volume_m3) } else { [0.0; 2] }
}

fn table(load: &Load) -> Vec<[f64; 2]> {
    (0..=TABLE).map(|k| lies(load, PI * k as f64 / TABLE as f64)).collect()
}

fn slosh(load: &Load, surface: Option<&Surface>) -> Swinging {
    let level = load.volume_m3 / (PI * load.radius_m * load.radius_m);
    let (mass, viscosity, gravity) = (load.liquid_mass_kg, load.viscosity_m2_s, load.gravity_m_s2);
    match surface {
        None => Swinging::One(Slosh::new(load.radius_m, level, mass, viscosity, gravity)),
        Some(surface) => {
            let density = if load.volume_m3 > 0.0 { mass / load.volume_m3 } else { 0.0 };
            Swinging::Three(Modes::new([load.radius_m, level], [mass, density], viscosity, gravity, surface))
        }
    }
}

impl ErrorType for FakeWrist {
    type Error = ErrorKind;
}

impl Rotary for FakeWrist {
    fn limits_rad(&self) -> (f64, f64) {
        LIMITS_RAD
    }

    fn turn_to(&mut self, angle_rad: f64, rate_rad_s: f64) -> Result<(), ErrorKind> {
        Joint::allows(angle_rad, rate_rad_s)?;
        let load = &self.load;
        let on_side =
            (self.joint.angle_rad - 0.5 * PI).abs() < ON_ITS_SIDE_RAD && self.joint.speed_rad_s == 0.0;
        if self.thick() && load.volume_m3 > 0.0 && on_side && angle_rad == 0.0 {
            let (radius, length) = (load.radius_m, load.length_m);
            self.film =
                Some(Film::new(radius, length, load.volume_m3, load.viscosity_m2_s, load.gravity_m_s2));
        } else if angle_rad != self.joint.angle_rad {
            self.film = None;
        }
        self.joint.goal = (angle_rad, rate_rad_s);
        Ok(())
    }

    fn angle_rad(&mut self) -> Result<Stamped<f64>, ErrorKind> {
        Ok(Stamped { t_s: self.now_s, value: self.joint.measured_rad(&mut self.rng) })
    }

    fn settled(&mut self) -> Result<bool, ErrorKind> {
        Ok(self.joint.settled())
    }
}

impl ForceTorque for FakeWrist {
    fn read(&mut self) -> Result<Stamped<Wrench>, ErrorKind> {
        self.advance(1.0 / self.sensor.rate_hz);
        let world = self.wrench_in_world();
        let (sin, cos) = self.joint.angle_rad.sin_cos();
        let [fx, fy, fz] = world.force_n;
        let body = Wrench { force_n: [fx * cos - fy * sin, fx * sin + fy * cos, fz], ..world };
        let read = self.noise.read(&self.sensor, &body, &mut self.rng).ok_or(ErrorKind::Saturated)?;
        Ok(Stamped { t_s: self.now_s, value: read.plus(&self.offset) })
    }

    fn tare(&mut self, readings: usize) -> Result<(), ErrorKind> {
        let before = std::mem::take(&mut self.offset);
        let tared = tared(self, readings);
        self.offset = *tared.as_ref().unwrap_or(&before);
        tared.map(drop)
    }
}

impl Clock for FakeWrist {
    fn now_s(&mut self) -> Result<f64, ErrorKind> {
        Ok(self.now_s)
    }

    fn sleep_s(&mut self, duration_s: f64) -> Result<(), ErrorKind> {
        if duration_s > 0.0 && duration_s.is_finite() {
            self.advance(duration_s);
        }
        Ok(())
    }
}
