//! Devices that are not there: emulators of the protocols on loopback, for tests, for a first look, and for teaching.
//!
//! They are written from the makers' documents and share no code with the drivers. What goes wrong on a line can be made to go
//! wrong: see each emulator's faults.

mod ati;
mod dcon;
mod dynamixel;
mod life;
mod robotiq;
mod session;
mod ur;

pub use ati::{AtiEmulator, AtiFaults, AtiPages};
pub use dcon::{DconEmulator, DconFaults};
pub use dynamixel::{DynamixelEmulator, DynamixelFaults};
pub use robotiq::{RobotiqEmulator, RobotiqFaults, RobotiqProtocol};
pub use ur::{UrEmulator, UrFaults, UrWorld};
