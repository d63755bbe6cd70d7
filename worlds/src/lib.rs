#![doc = include_str!("../README.md")]

pub mod bounce;
pub mod bundled;
pub mod flight;
pub mod noise;
pub mod pendulum;
