#![doc = include_str!("../README.md")]

pub mod dead_man;
mod error;
pub use error::DriverError;

#[cfg(feature = "ati")]
pub mod ati;
#[cfg(feature = "dcon")]
pub mod dcon;
#[cfg(feature = "depth-folder")]
pub mod depth_folder;
#[cfg(feature = "dynamixel")]
pub mod dynamixel;
#[cfg(feature = "emulator")]
pub mod emulator;
#[cfg(any(feature = "dcon", feature = "dynamixel", feature = "robotiq"))]
pub mod line;
#[cfg(feature = "robotiq")]
pub mod robotiq;
#[cfg(feature = "cpal")]
pub mod sound_card;
#[cfg(feature = "ur")]
pub mod ur;
#[cfg(feature = "wav")]
pub mod wav;
