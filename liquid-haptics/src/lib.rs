#![doc = include_str!("../README.md")]
pub mod container;
pub mod pour;
mod root;
pub mod slosh;
pub mod viscosity;
pub mod volume;
pub mod wrench;
