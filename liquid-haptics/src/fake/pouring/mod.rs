//! A wrist that pours from an open bottle: the liquid runs, the bead breaks, the lip dribbles, and the sensor drifts and is late.

mod channel;
mod lip;

use std::collections::VecDeque;
use std::f64::consts::PI;

use hw_traits::clock::{Clock, Stamped};
use hw_traits::force_torque::{ForceTorque, Wrench};
use hw_traits::rotary::Rotary;
use hw_traits::{ErrorKind, ErrorType};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::joint::{Joint, LIMITS_RAD};
use super::sensor::{Noise, Sensor, tared};
use channel::Channel;
use lip::{Lip, Shape};

/// Steps of the flow, s.
const STEP_S: f64 = 2.5e-3;
/// Radius of a thread that thins, to a quarter of it, m.
const THREAD_M: f64 = 1.5e-3;
/// Steps of the history, s.
const HISTORY_S: f64 = 0.05;
/// In which the sensor comes to its new temperature, s.
const WARM_S: f64 = 300.0;

/// An open cylindrical bottle, what is in it, and its lip as it truly is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OpenBottle {
    /// Inner radius, m.
    pub radius_m: f64,
    /// Inner length from the bottom to the rim, m.
    pub length_m: f64,
    /// Thickness of the bottom, m.
    pub bottom_m: f64,
    /// Radius of the lip, at most the inner one, m.
    pub lip_radius_m: f64,
    /// Height above the lip at which the bead breaks, m.
    pub hold_m: f64,
    /// Height above the lip at which a stream stops, m.
    pub rest_m: f64,
    /// Flow over the lip, as a share of the ideal weir's.
    pub discharge: f64,
    /// Volume inside to begin with, m^3.
    pub volume_m3: f64,
    /// Density, kg/m^3.
    pub density_kg_m3: f64,
    /// Kinematic viscosity, m^2/s.
    pub viscosity_m2_s: f64,
    /// Surface tension, N/m.
    pub surface_tension_n_m: f64,
    /// Mass of the empty container, kg.
    pub container_mass_kg: f64,
    /// Mass of the gripper, its centre at the grasp, kg.
    pub gripper_mass_kg: f64,
    /// Height of the grasp above the container's outer bottom, m.
    pub grasp_height_m: f64,
    /// Height of the empty container's centre of mass above its outer bottom, m.
    pub shell_center_m: f64,
    /// Gravity, m/s^2.
    pub gravity_m_s2: f64,
}

/// What is not as stated, and what goes wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disturbances {
    /// How late readings of the wrench arrive, s; their times are those of the measurement.
    pub latency_s: f64,
    /// Offset of the forces, N.
    pub offset_n: [f64; 3],
    /// How fast the forces begin to drift with the sensor's temperature, which settles within minutes, N/s.
    pub warming_n_s: [f64; 3],
    /// Relative error of the forces.
    pub force_gain: f64,
    /// The true tilt less the measured one, rad.
    pub angle_offset_rad: f64,
    /// Standard deviation of the wander of the bead's height, m.
    pub bead_wander_m: f64,
    /// From then on the sensor does not answer, s.
    pub lost_after_s: f64,
    /// From then on the sensor reads no number, s.
    pub nan_after_s: f64,
}

impl Default for Disturbances {
    /// None of them.
    fn default() -> Self {
        Self {
            latency_s: 0.0,
            offset_n: [0.0; 3],
            warming_n_s: [0.0; 3],
            force_gain: 0.0,
            angle_offset_rad: 0.0,
            bead_wander_m: 0.0,
            lost_after_s: f64::INFINITY,
            nan_after_s: f64::INFINITY,
        }
    }
}

/// A wrist with an open bottle: turns, feels, keeps time, and knows what has been poured.
///
/// The liquid is finite volumes along the bottle's axis, what leaves a weir summed strip by strip above a bead that breaks, rests and
/// wanders; it hangs from the lip as a thread that takes its time or as drops, and the last of it stays there. The stream pushes back, the
/// load's inertia is felt while the joint speeds up. Not simulated: sloshing, and air that has to get in.
#[derive(Debug)]
pub struct FakePour {
    bottle: OpenBottle,
    disturbances: Disturbances,
    sensor: Sensor,
    noise: Noise,
    rng: ChaCha8Rng,
    now_s: f64,
    joint: Joint,
    acceleration_rad_s2: f64,
    channel: Channel,
    center: [f64; 2],
    lip: Lip,
    flow_m3_s: f64,
    poured_m3: f64,
    waiting_s: f64,
    tare: Wrench,
    queue: VecDeque<(f64, Option<Wrench>)>,
    history: Vec<TruePour>,
}

/// What truly was at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TruePour {
    /// Time, s.
    pub t_s: f64,
    /// Tilt, rad.
    pub tilt_rad: f64,
    /// Volume flow over the lip, m^3/s.
    pub flow_m3_s: f64,
    /// Volume that has fallen off the lip, m^3.
    pub poured_m3: f64,
    /// Volume that hangs from the lip, m^3.
    pub hung_m3: f64,
}

impl FakePour {
    /// A wrist at rest, upright; all its noise comes from the seed, and so do what stays on the lip (0.02 to 0.08 mL) and how thick a thread hangs
    /// from it (1.5 mm, to a quarter).
    ///
    /// # Errors
    /// [`ErrorKind::OutOfRange`] for a bottle of which a number is none or negative, or whose liquid does not fit.
    pub fn new(
        bottle: OpenBottle,
        disturbances: Disturbances,
        sensor: Sensor,
        seed: u64,
    ) -> Result<Self, ErrorKind> {
        let above_zero = [
            bottle.radius_m,
            bottle.length_m,
            bottle.lip_radius_m,
            bottle.discharge,
            bottle.density_kg_m3,
            bottle.viscosity_m2_s,
            bottle.surface_tension_n_m,
            bottle.gravity_m_s2,
        ];
        let capacity = PI * bottle.radius_m.powi(2) * bottle.length_m;
        let fine = above_zero.iter().all(|n| *n > 0.0 && n.is_finite())
            && bottle.lip_radius_m <= bottle.radius_m
            && (0.0..=bottle.hold_m).contains(&bottle.rest_m)
            && (0.0..=capacity).contains(&bottle.volume_m3)
            && (0.0..1.0).contains(&disturbances.latency_s);
        if !fine {
            return Err(ErrorKind::OutOfRange);
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let [hangs, thins]: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(&mut rng));
        let shape = Shape {
            radius: bottle.lip_radius_m,
            hold: bottle.hold_m,
            rest: bottle.rest_m,
            wander: disturbances.bead_wander_m,
            discharge: bottle.discharge,
            hanging: 5e-8 + 1e-8 * hangs.clamp(-3.0, 3.0),
            drop: 5e-8,
            thread: THREAD_M * (0.25 * thins).exp(),
            viscosity: bottle.viscosity_m2_s,
            slowness: bottle.viscosity_m2_s * bottle.density_kg_m3 / bottle.surface_tension_n_m,
            gravity: bottle.gravity_m_s2,
        };
        let channel = Channel::new(
            bottle.radius_m,
            bottle.length_m,
            bottle.volume_m3,
            bottle.viscosity_m2_s,
            bottle.gravity_m_s2,
        );
        Ok(Self {
            bottle,
            disturbances,
            sensor,
            noise: Noise::new(),
            rng,
            now_s: 0.0,
            joint: Joint::new(),
            acceleration_rad_s2: 0.0,
            center: channel.center(),
            channel,
            lip: Lip::new(shape),
            flow_m3_s: 0.0,
            poured_m3: 0.0,
            waiting_s: 0.0,
            tare: Wrench::default(),
            queue: VecDeque::new(),
            history: Vec::new(),
        })
    }

    /// Volume that has fallen off the lip, m^3; what hangs from it has not.
    pub fn poured_m3(&self) -> f64 {
        self.poured_m3
    }

    /// Volume that flows over the lip, m^3/s.
    pub fn flow_m3_s(&self) -> f64 {
        self.flow_m3_s
    }

    /// What truly was, every 50 ms.
    pub fn history(&self) -> &[TruePour] {
        &self.history
    }

    /// Volume in the bottle, m^3.
    pub fn inside_m3(&self) -> f64 {
        self.channel.volume()
    }

    fn advance(&mut self, duration_s: f64) {
        let end = self.now_s + duration_s;
        while self.now_s < end {
            let h = STEP_S.min(end - self.now_s);
            if !(h > 0.0) || self.now_s + h == self.now_s {
                break;
            }
            if self.joint.settled() {
                self.acceleration_rad_s2 = 0.0;
            } else {
                let before = self.joint.speed_rad_s;
                self.joint.turn(h);
                self.acceleration_rad_s2 = (self.joint.speed_rad_s - before) / h;
            }
            self.waiting_s += h;
            if self.waiting_s >= STEP_S * (1.0 - 1e-9) {
                let step = std::mem::take(&mut self.waiting_s);
                self.run(step);
            }
            self.now_s += h;
        }
        self.now_s = end;
    }

    /// One step of the flow.
    fn run(&mut self, h: f64) {
        let tilt = self.tilt();
        let (sin, cos) = tilt.sin_cos();
        let lowest = self.bottle.length_m * cos - self.bottle.lip_radius_m * sin;
        let above = self.channel.at_mouth(tilt) - lowest;
        let flow = self.lip.flow(h, above, sin, &mut self.rng);
        let passed = self.channel.advance(h, tilt, flow);
        self.flow_m3_s = passed / h;
        self.poured_m3 += self.lip.release(h, passed);
        self.center = self.channel.center();
        if self.history.last().is_none_or(|last| self.now_s - last.t_s >= HISTORY_S) {
            self.history.push(TruePour {
                t_s: self.now_s,
                tilt_rad: tilt,
                flow_m3_s: self.flow_m3_s,
                poured_m3: self.poured_m3,
                hung_m3: self.lip.hung(),
            });
        }
    }

    fn tilt(&self) -> f64 {
        self.joint.angle_rad + self.disturbances.angle_offset_rad
    }

    /// Force and torque in the sensor's frame, without its noise.
    fn wrench_in_body(&self) -> Wrench {
        let bottle = &self.bottle;
        let tilt = self.tilt();
        let (sin, cos) = tilt.sin_cos();
        let liquid = bottle.density_kg_m3 * self.channel.volume();
        let hung = bottle.density_kg_m3 * self.lip.hung();
        // Lever arms across and along the container's axis, and the mass at each.
        let bodies = [
            (liquid, [self.center[0], self.center[1] + bottle.bottom_m - bottle.grasp_height_m]),
            (bottle.container_mass_kg, [0.0, bottle.shell_center_m - bottle.grasp_height_m]),
            (hung, [bottle.lip_radius_m, bottle.length_m + bottle.bottom_m - bottle.grasp_height_m]),
            (bottle.gripper_mass_kg, [0.0; 2]),
        ];
        let (mut force, mut torque) = ([0.0; 2], 0.0);
        let (speed, acceleration) = (self.joint.speed_rad_s, self.acceleration_rad_s2);
        for (mass, [across, along]) in bodies {
            let [x, y] = [across * cos + along * sin, along * cos - across * sin];
            // Clockwise turns: the acceleration of a body that goes with the wrist.
            let moves = [acceleration * y - speed * speed * x, -acceleration * x - speed * speed * y];
            let pull = [-mass * moves[0], -mass * (bottle.gravity_m_s2 + moves[1])];
            force = [force[0] + pull[0], force[1] + pull[1]];
            torque += x * pull[1] - y * pull[0];
        }
        // The stream leaves sideways and down, and pushes back.
        let speed = (bottle.gravity_m_s2 * 3e-3).sqrt();
        let push = bottle.density_kg_m3 * self.flow_m3_s * speed;
        force = [force[0] - 0.95 * push, force[1] + 0.3 * push];
        let gain = 1.0 + self.disturbances.force_gain;
        let warmed = WARM_S * (1.0 - (-self.now_s / WARM_S).exp());
        let [x, y] = force.map(|f| f * gain);
        let mut body = [x * cos - y * sin, x * sin + y * cos, 0.0];
        for (axis, value) in body.iter_mut().enumerate() {
            *value += self.disturbances.offset_n[axis] + self.disturbances.warming_n_s[axis] * warmed;
        }
        Wrench { force_n: body, torque_nm: [0.0, 0.0, torque] }
    }
}

impl ErrorType for FakePour {
    type Error = ErrorKind;
}

impl Rotary for FakePour {
    fn limits_rad(&self) -> (f64, f64) {
        LIMITS_RAD
    }

    fn turn_to(&mut self, angle_rad: f64, rate_rad_s: f64) -> Result<(), ErrorKind> {
        Joint::allows(angle_rad, rate_rad_s)?;
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

impl ForceTorque for FakePour {
    fn read(&mut self) -> Result<Stamped<Wrench>, ErrorKind> {
        // What waited while nobody asked is no reading of now.
        if self.queue.back().is_some_and(|(t, _)| *t + 1.5 / self.sensor.rate_hz < self.now_s) {
            self.queue.clear();
        }
        loop {
            self.advance(1.0 / self.sensor.rate_hz);
            if self.now_s >= self.disturbances.lost_after_s {
                return Err(ErrorKind::Link);
            }
            let body = self.wrench_in_body();
            let read = self.noise.read(&self.sensor, &body, &mut self.rng);
            self.queue.push_back((self.now_s, read));
            if self.queue.front().is_some_and(|(t, _)| t + self.disturbances.latency_s <= self.now_s)
                && let Some((t_s, read)) = self.queue.pop_front()
            {
                let value = read.ok_or(ErrorKind::Saturated)?.plus(&self.tare);
                let value = if t_s >= self.disturbances.nan_after_s { value.scaled(f64::NAN) } else { value };
                return Ok(Stamped { t_s, value });
            }
        }
    }

    fn tare(&mut self, readings: usize) -> Result<(), ErrorKind> {
        let before = std::mem::take(&mut self.tare);
        let tared = tared(self, readings);
        self.tare = *tared.as_ref().unwrap_or(&before);
        tared.map(drop)
    }

    fn skip(&mut self) -> Result<(), ErrorKind> {
        self.queue.clear();
        Ok(())
    }
}

impl Clock for FakePour {
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
