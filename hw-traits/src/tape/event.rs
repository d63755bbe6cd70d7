use crate::ErrorKind;
use crate::arm::Pose;
use crate::clock::Stamped;
use crate::force_torque::Wrench;
use crate::motor::MotorReading;
use crate::picture::{Intrinsics, Picture};

/// One thing that happened at a device.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "tape-file", derive(serde::Serialize, serde::Deserialize))]
pub enum Event {
    /// What a device is; it does not change.
    Fact(Fact),
    /// A command, and why it was refused.
    Command {
        /// What was commanded.
        command: Command,
        /// The kind of the error, for a command that was refused.
        refused: Option<ErrorKind>,
    },
    /// An answer.
    Reading(Reading),
    /// A question that had no answer.
    Failed {
        /// What was asked for.
        stream: Stream,
        /// The kind of the error.
        kind: ErrorKind,
    },
}

/// What a device is.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "tape-file", derive(serde::Serialize, serde::Deserialize))]
pub enum Fact {
    /// Smallest and largest angle of a wrist, rad.
    LimitsRad(f64, f64),
    /// Smallest and largest distance between fingers, m.
    LimitsM(f64, f64),
    /// Number of microphones and samples a second.
    Microphones(usize, f64),
    /// The pinhole of a depth camera.
    Intrinsics(Intrinsics),
    /// Largest torque of a motor, N m.
    LimitNm(f64),
}

/// A command, with the arguments of the trait's method.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "tape-file", derive(serde::Serialize, serde::Deserialize))]
pub enum Command {
    /// [`Arm::move_to`](crate::arm::Arm::move_to).
    MoveTo(Pose, f64),
    /// [`Gripper::open_to`](crate::gripper::Gripper::open_to).
    OpenTo(f64, f64),
    /// [`Rotary::turn_to`](crate::rotary::Rotary::turn_to).
    TurnTo(f64, f64),
    /// [`Valve::open`](crate::pneumatics::Valve::open).
    Open(f64),
    /// [`ForceTorque::tare`](crate::force_torque::ForceTorque::tare).
    Tare(usize),
    /// [`Motor::drive`](crate::motor::Motor::drive).
    Drive(f64),
}

impl Command {
    /// The arguments as numbers.
    pub fn numbers(&self) -> Vec<f64> {
        match self {
            Self::MoveTo(pose, deadline_s) => {
                [&pose.position_m[..], &pose.rotation_xyzw, &[*deadline_s]].concat()
            }
            Self::OpenTo(a, b) | Self::TurnTo(a, b) => vec![*a, *b],
            Self::Open(a) | Self::Drive(a) => vec![*a],
            Self::Tare(readings) => vec![*readings as f64],
        }
    }

    /// Whether another is the same to within a tolerance of each number; what is no number equals what is none.
    pub(super) fn is_like(&self, other: &Self, tolerance: f64) -> bool {
        let like = |(a, b): (&f64, &f64)| a == b || (a - b).abs() <= tolerance || (a.is_nan() && b.is_nan());
        std::mem::discriminant(self) == std::mem::discriminant(other)
            && self.numbers().iter().zip(&other.numbers()).all(like)
    }
}

/// An answer, with its time where the trait gives one.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "tape-file", derive(serde::Serialize, serde::Deserialize))]
pub enum Reading {
    /// Force and torque.
    Wrench(Stamped<Wrench>),
    /// An arm's pose.
    Pose(Stamped<Pose>),
    /// A wrist's angle, rad.
    AngleRad(Stamped<f64>),
    /// A gripper's opening, m.
    WidthM(Stamped<f64>),
    /// A chamber's pressure, Pa.
    PressurePa(Stamped<f64>),
    /// A grey picture.
    Grey(Stamped<Picture<u8>>),
    /// A depth picture, m.
    DepthM(Stamped<Picture<f32>>),
    /// Sound, channel after channel for each instant.
    Samples(Stamped<Vec<f32>>),
    /// A joint's angle and its motor's torque.
    Motor(Stamped<MotorReading>),
    /// Whether a device that moves has settled.
    Settled(bool),
}

/// What can be asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "tape-file", derive(serde::Serialize, serde::Deserialize))]
pub enum Stream {
    /// Force and torque.
    Wrench,
    /// An arm's pose.
    Pose,
    /// A wrist's angle.
    Angle,
    /// A gripper's opening.
    Width,
    /// A chamber's pressure.
    Pressure,
    /// Grey pictures.
    Grey,
    /// Depth pictures.
    Depth,
    /// Sound.
    Sound,
    /// A joint's angle and its motor's torque.
    Motor,
    /// Whether a device that moves has settled.
    Settled,
}

impl Reading {
    /// The stream to which it belongs.
    pub fn stream(&self) -> Stream {
        match self {
            Self::Wrench(_) => Stream::Wrench,
            Self::Pose(_) => Stream::Pose,
            Self::AngleRad(_) => Stream::Angle,
            Self::WidthM(_) => Stream::Width,
            Self::PressurePa(_) => Stream::Pressure,
            Self::Grey(_) => Stream::Grey,
            Self::DepthM(_) => Stream::Depth,
            Self::Samples(_) => Stream::Sound,
            Self::Motor(_) => Stream::Motor,
            Self::Settled(_) => Stream::Settled,
        }
    }

    /// Time on the device's clock, s.
    pub fn time_s(&self) -> Option<f64> {
        match self {
            Self::Wrench(s) => Some(s.t_s),
            Self::Pose(s) => Some(s.t_s),
            Self::AngleRad(s) | Self::WidthM(s) | Self::PressurePa(s) => Some(s.t_s),
            Self::Grey(s) => Some(s.t_s),
            Self::DepthM(s) => Some(s.t_s),
            Self::Samples(s) => Some(s.t_s),
            Self::Motor(s) => Some(s.t_s),
            Self::Settled(_) => None,
        }
    }
}

impl Stream {
    /// Whether each of its readings is returned once; the others are states, of which the last one can be asked for again.
    pub(super) fn comes_once(self) -> bool {
        matches!(self, Self::Wrench | Self::Pressure | Self::Grey | Self::Depth | Self::Sound | Self::Motor)
    }
}
