#![doc = include_str!("../README.md")]

pub mod bounce;
pub mod bounces;
pub mod bundled;
pub mod concealed;
pub mod customs;
pub mod dough;
pub mod doughs;
pub mod flight;
pub mod flights;
mod layer;
pub mod noise;
pub mod pendulum;
pub mod press;
pub mod presses;
mod quadrature;
mod runge_kutta;
mod set_up;
mod sizing;
pub mod sound;
pub mod sounds;
pub mod tilt;
pub mod tilts;
pub mod wave;
pub mod waves;

/// Standard gravity in m/s^2.
pub const GRAVITY_M_S2: f64 = 9.80665;
