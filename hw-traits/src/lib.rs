#![doc = include_str!("../README.md")]

mod error;
mod forward;
pub use error::{Error, ErrorKind, ErrorType, Severity};

pub mod arm;
pub mod camera;
pub mod clock;
pub mod conformance;
pub mod force_torque;
pub mod gripper;
pub mod microphones;
pub mod motor;
pub mod picture;
pub mod pneumatics;
pub mod programme;
pub mod replay;
pub mod rotary;
pub mod tape;
