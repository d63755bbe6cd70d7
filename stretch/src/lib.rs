#![doc = include_str!("../README.md")]

pub mod calibration;
pub mod cloud;
pub mod contact;
pub mod curvature;
#[cfg(feature = "fake")]
pub mod fake;
pub mod force;
pub mod measured;
pub mod membrane;
pub mod modulus;
pub mod palpate;
pub mod reconstruct;
pub mod segment;
pub mod shape;
