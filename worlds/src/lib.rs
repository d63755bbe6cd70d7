#![doc = include_str!("../README.md")]

pub mod bundled;
pub mod flight;
pub mod noise;
