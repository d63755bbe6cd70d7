#![doc = include_str!("../README.md")]

pub mod dead_man;
mod error;
pub use error::DriverError;

#[cfg(feature = "ati")]
pub mod ati;
#[cfg(feature = "emulator")]
pub mod emulator;
#[cfg(feature = "ur")]
pub mod ur;
