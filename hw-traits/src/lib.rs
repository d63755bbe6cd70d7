#![doc = include_str!("../README.md")]

mod error;
pub use error::{Error, ErrorKind, ErrorType};

pub mod clock;
pub mod force_torque;
pub mod programme;
pub mod replay;
pub mod rotary;
