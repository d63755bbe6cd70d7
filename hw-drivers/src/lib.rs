#![doc = include_str!("../README.md")]

pub mod dead_man;
mod error;
pub use error::DriverError;

#[cfg(feature = "ati")]
pub mod ati;
#[cfg(feature = "emulator")]
pub mod emulator;
#[cfg(any(feature = "dcon", feature = "dynamixel", feature = "robotiq"))]
pub mod line;
#[cfg(feature = "robotiq")]
pub mod robotiq;
#[cfg(feature = "ur")]
pub mod ur;
