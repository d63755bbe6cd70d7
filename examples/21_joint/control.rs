//! A controller that leads the joint along a curve by a model of it.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use hw_traits::clock::Clock;
use hw_traits::motor::Motor;
use missing_physics::diagnosis::Diagnosis;

use super::Outcome;
use super::ask::{REST_S, parameter};
use super::joint::{CURRENT_S, CYCLE_S};

/// What is to be followed: swings of so many rad, so many a second; how many, and how many of them count.
const SWING_RAD: f64 = 0.4;
const SWINGS_HZ: f64 = 0.25;
const SWINGS: f64 = 5.0;
const BEFORE: f64 = 1.0;
/// How fast a deviation fades, rad/s: a soft joint.
const STIFF_RAD_S: f64 = 8.0;
/// Time constant of the filter of speeds, s.
const FILTER_S: f64 = 0.015;
/// The controller's model is followed in steps of this time, s.
const STEP_S: f64 = 1e-3;

/// What a controller takes the joint for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Plant {
    gain: f64,
    weight_per_s2: f64,
    damping_per_s: f64,
    /// Stribeck's friction: its level, rad/s^2, and its speed, rad/s.
    friction: Option<[f64; 2]>,
    delay_s: f64,
}

impl Plant {
    /// The simulation as it was, fitted.
    pub(super) fn baseline(diagnosis: &Diagnosis) -> Option<Self> {
        let find = |name: &str| diagnosis.baseline_parameters.iter().find(|p| p.name == name);
        Self::of(|name| find(name).map(|p| p.value))
    }

    /// The repaired one, as far as it has been repaired.
    pub(super) fn repaired(diagnosis: &Diagnosis) -> Option<Self> {
        let find = |name: &str| diagnosis.repaired.parameters.iter().find(|p| p.name == name);
        let baseline = Self::of(|name| find(name).map(|p| p.value))?;
        let value = |id: &str, name: &str| parameter(diagnosis, id, name).map(|p| p.value);
        let friction = value("stribeck-friction", "level").zip(value("stribeck-friction", "speed"));
        let delay_s = value("input-delay", "delay_s").unwrap_or(0.0);
        Some(Self { friction: friction.map(<[f64; 2]>::from), delay_s, ..baseline })
    }

    fn of(find: impl Fn(&str) -> Option<f64>) -> Option<Self> {
        let (gain, weight_per_s2) = (find("gain")?, find("weight_per_s2")?);
        Some(Self {
            gain,
            weight_per_s2,
            damping_per_s: find("damping_per_s")?,
            friction: None,
            delay_s: 0.0,
        })
    }

    /// The same that acts at once.
    pub(super) fn prompt(self) -> Self {
        Self { delay_s: 0.0, ..self }
    }

    /// Friction at a speed, rad/s^2.
    pub(super) fn friction(&self, rate_rad_s: f64) -> f64 {
        let of = |[level, speed]: [f64; 2]| level * (-(rate_rad_s / speed).powi(2)).exp();
        self.friction.map_or(0.0, of)
    }

    /// The torque of a motion, N m.
    fn torque_nm(&self, [angle, rate, acceleration]: [f64; 3]) -> f64 {
        let rubs = if rate == 0.0 { 0.0 } else { rate.signum() * self.friction(rate) };
        (acceleration + self.weight_per_s2 * angle.sin() + self.damping_per_s * rate + rubs) / self.gain
    }

    /// Where the joint is a step later under a torque.
    fn later(&self, [angle, rate]: [f64; 2], torque_nm: f64) -> [f64; 2] {
        let smooth = self.gain * torque_nm - self.weight_per_s2 * angle.sin() - self.damping_per_s * rate;
        let free = rate + STEP_S * smooth;
        let rubs = STEP_S * self.friction(rate);
        let end = if free.abs() > rubs { free - rubs * free.signum() } else { 0.0 };
        [angle + 0.5 * STEP_S * (rate + end), end]
    }
}

/// Angle, speed and acceleration that are wanted.
fn wanted(t_s: f64) -> [f64; 3] {
    let pulse = TAU * SWINGS_HZ;
    let (sin, cos) = (pulse * t_s).sin_cos();
    [SWING_RAD * (1.0 - cos), SWING_RAD * pulse * sin, SWING_RAD * pulse * pulse * cos]
}

/// How a joint follows the curve.
pub(super) struct Followed {
    /// Times, s, with how far the joint is from where it should be, rad.
    pub(super) errors: Vec<[f64; 2]>,
    /// Root mean square of the errors after the first swing, rad.
    pub(super) rms_rad: f64,
}

/// Leads the joint from rest along the curve; `place` says where it is.
pub(super) fn follow<J: Motor + Clock>(
    joint: &mut J,
    plant: &Plant,
    place: impl Fn(&J) -> f64,
) -> Outcome<Followed> {
    let as_text = |e: J::Error| format!("{e:?}");
    joint.drive(0.0).map_err(as_text)?;
    joint.sleep_s(REST_S).map_err(as_text)?;
    let limit_nm = joint.limit_nm();
    let (stiff, damps) = (STIFF_RAD_S.powi(2) / plant.gain, 1.4 * STIFF_RAD_S / plant.gain);
    // What is commanded now acts half a cycle later on average, and then through the current's control and the delay.
    let late_s = plant.delay_s + CURRENT_S + 0.5 * CYCLE_S;
    let mut before = joint.read().map_err(as_text)?;
    let (begun_s, mut rate) = (before.t_s, 0.0);
    let mut commands: VecDeque<f64> = VecDeque::new();
    let mut errors = Vec::new();
    while before.t_s - begun_s < SWINGS / SWINGS_HZ {
        let t_s = before.t_s - begun_s;
        // From where the joint is to where it is when this command acts.
        let mut then = [before.value.angle_rad, rate];
        for k in 0..(late_s / STEP_S).round() as usize {
            let ago_s = late_s - k as f64 * STEP_S;
            let cycles = (ago_s / CYCLE_S).ceil() as usize;
            let torque_nm = commands.iter().rev().nth(cycles.saturating_sub(1)).copied().unwrap_or(0.0);
            then = plant.later(then, torque_nm);
        }
        let aim = wanted(t_s + late_s);
        let torque_nm = plant.torque_nm(aim) + stiff * (aim[0] - then[0]) + damps * (aim[1] - then[1]);
        let torque_nm = torque_nm.clamp(-limit_nm, limit_nm);
        joint.drive(torque_nm).map_err(as_text)?;
        commands.push_back(torque_nm);
        let now = joint.read().map_err(as_text)?;
        let slope = (now.value.angle_rad - before.value.angle_rad) / (now.t_s - before.t_s);
        rate += (slope - rate) * CYCLE_S / (FILTER_S + CYCLE_S);
        before = now;
        errors.push([now.t_s - begun_s, place(joint) - wanted(now.t_s - begun_s)[0]]);
    }
    joint.drive(0.0).map_err(as_text)?;
    let counts: Vec<f64> = errors.iter().filter(|e| e[0] > BEFORE / SWINGS_HZ).map(|e| e[1] * e[1]).collect();
    let rms_rad = (counts.iter().sum::<f64>() / counts.len() as f64).sqrt();
    Ok(Followed { errors, rms_rad })
}
