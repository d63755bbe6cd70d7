#![doc = include_str!("../README.md")]
pub mod friction;
pub mod hysteresis;
pub mod integrate;
mod number;
pub mod sensor;
pub mod signal;
pub mod spring;

pub use number::{Dual, Number};
