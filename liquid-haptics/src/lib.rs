#![doc = include_str!("../README.md")]
#[cfg(feature = "classify")]
pub mod classify;
pub mod container;
#[cfg(feature = "fake")]
pub mod fake;
pub mod fusion;
pub mod pour;
mod root;
pub mod signal;
pub mod slosh;
pub mod viscosity;
pub mod volume;
pub mod wrench;
