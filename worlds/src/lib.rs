#![doc = include_str!("../README.md")]

pub mod bundled;
pub mod concealed;
pub mod noise;
pub mod physics;

/// Standard gravity in m/s^2.
pub const GRAVITY_M_S2: f64 = 9.80665;
