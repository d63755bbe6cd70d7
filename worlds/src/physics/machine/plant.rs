//! Kinds of machines, with their equations of motion.

use super::State;

/// A machine with the constants of its equations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Plant {
    /// A pendulum: gravity over length (1/s^2), damping (1/s).
    Pendulum([f64; 2]),
    /// A servo that follows the command of an angle: stiffness (1/s^2) and damping (1/s) of its loop.
    Servo([f64; 2]),
    /// A cart that a motor pulls: force over mass for a unit of command, drag (1/s).
    Cart([f64; 2]),
    /// A ship that rolls: restoring moment over inertia (1/s^2), damping (1/s).
    Hull([f64; 2]),
    /// The axis of a drone under the command of a rate: gain, time constant (s).
    Axis([f64; 2]),
    /// A tank that runs out: one over its area (1/m^2), which is known, and the outlet's constant (m^0.5/s).
    Tank([f64; 2]),
    /// A load that hangs from a trolley: acceleration of the trolley for a unit of command, its drag (1/s), gravity over length (1/s^2),
    /// which is known as the length (m) is.
    Crane([f64; 4]),
    /// A motor and a link on a springy shaft: acceleration for a unit of command, damping of the motor (1/s), the shaft's stiffness over
    /// the motor's inertia (1/s^2) and over the link's (1/s^2), damping of the link (1/s).
    Shaft([f64; 5]),
}

/// Where forces may act.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Joint {
    /// Its number among the machine's joints.
    pub number: usize,
    /// Its name.
    pub name: &'static str,
    /// Which state its position is.
    pub position: usize,
    /// Which state its velocity is.
    pub velocity: usize,
    /// Whether the input drives it.
    pub driven: bool,
    /// Whether it rotates.
    pub turns: bool,
}

const fn joint(number: usize, name: &'static str, driven: bool, turns: bool) -> Joint {
    Joint { number, name, position: 2 * number, velocity: 2 * number + 1, driven, turns }
}

const HINGE: [Joint; 1] = [joint(0, "hinge", false, true)];
const SERVO: [Joint; 1] = [joint(0, "servo", true, true)];
const CART: [Joint; 1] = [joint(0, "cart", true, false)];
const HULL: [Joint; 1] = [joint(0, "hull", false, false)];
const AXIS: [Joint; 1] = [joint(0, "axis", true, false)];
const CRANE: [Joint; 2] = [joint(0, "trolley", true, false), joint(1, "rope", false, false)];
const SHAFT: [Joint; 2] = [joint(0, "motor", true, true), joint(1, "link", false, true)];

impl Plant {
    /// Its joints.
    pub const fn joints(&self) -> &'static [Joint] {
        match self {
            Self::Pendulum(_) => &HINGE,
            Self::Servo(_) => &SERVO,
            Self::Cart(_) => &CART,
            Self::Hull(_) => &HULL,
            Self::Axis(_) => &AXIS,
            Self::Tank(_) => &[],
            Self::Crane(_) => &CRANE,
            Self::Shaft(_) => &SHAFT,
        }
    }

    /// The state that holds an amount.
    pub const fn level(&self) -> Option<usize> {
        if matches!(self, Self::Tank(_)) { Some(0) } else { None }
    }

    /// Whether the input is the command of a position.
    pub const fn follows(&self) -> bool {
        matches!(self, Self::Servo(_))
    }

    /// Number of states.
    pub const fn states(&self) -> usize {
        match self {
            Self::Tank(_) => 1,
            Self::Crane(_) | Self::Shaft(_) => 4,
            _ => 2,
        }
    }

    /// Columns that are measured, each with the state that it is.
    pub const fn outputs(&self) -> &'static [(&'static str, usize)] {
        match self {
            Self::Pendulum(_) => &[("encoder_rad", 0)],
            Self::Servo(_) => &[("horn_rad", 0)],
            Self::Cart(_) => &[("track_m", 0), ("tacho_m_s", 1)],
            Self::Hull(_) => &[("inclinometer_rad", 0)],
            Self::Axis(_) => &[("gyro_rad_s", 1)],
            Self::Tank(_) => &[("gauge_m", 0)],
            Self::Crane(_) => &[("rail_m", 0), ("camera_rad", 2)],
            Self::Shaft(_) => &[("motor_encoder_rad", 0), ("link_encoder_rad", 2)],
        }
    }

    /// What an output should read.
    pub(super) fn output(&self, output: usize, x: &State) -> f64 {
        x[self.outputs()[output].1]
    }

    /// Rates of change of the states under an input.
    pub(super) fn rates(&self, x: &State, u: f64) -> [f64; 4] {
        match *self {
            Self::Pendulum([g_per_l, damping]) => [x[1], -g_per_l * x[0].sin() - damping * x[1], 0.0, 0.0],
            Self::Servo([stiffness, damping]) => [x[1], stiffness * (u - x[0]) - damping * x[1], 0.0, 0.0],
            Self::Cart([gain, drag]) => [x[1], gain * u - drag * x[1], 0.0, 0.0],
            Self::Hull([restoring, damping]) => [x[1], -restoring * x[0] - damping * x[1], 0.0, 0.0],
            Self::Axis([gain, tau]) => [x[1], (gain * u - x[1]) / tau, 0.0, 0.0],
            Self::Tank([per_area, outlet]) => [u * per_area - outlet * x[0].max(0.0).sqrt(), 0.0, 0.0, 0.0],
            Self::Crane([gain, drag, g_per_l, length]) => {
                let pull = gain * u - drag * x[1];
                [x[1], pull, x[3], -g_per_l * x[2].sin() - pull * x[2].cos() / length]
            }
            Self::Shaft([gain, damping, motor, link, link_damping]) => {
                let twist = x[0] - x[2];
                [x[1], gain * u - damping * x[1] - motor * twist, x[3], link * twist - link_damping * x[3]]
            }
        }
    }

    /// What a unit of a joint's force does to the states' rates: what the drive does, where it drives the joint.
    pub(super) fn direction(&self, joint: usize, x: &State) -> [f64; 4] {
        match (self, joint) {
            (Self::Crane([_, _, _, length]), 0) => [0.0, 1.0, 0.0, -x[2].cos() / length],
            (_, 0) => [0.0, 1.0, 0.0, 0.0],
            _ => [0.0, 0.0, 0.0, 1.0],
        }
    }
}
