//! A bottle at the wrist: one programme that runs on a simulated rig, on drivers and their emulators, on hardware, and on its own tape.

mod devices;
mod story;
mod world;

use std::error::Error;

pub use devices::{Addresses, Devices, Loopback};
pub use story::{Diagnosed, Plan, Story, recording, story};
pub use world::{Truth, World};

/// What goes wrong is said, whatever it is.
pub type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

/// The bottle's inner radius, m.
pub const RADIUS_M: f64 = 0.020;
/// Inner length, m.
pub const LENGTH_M: f64 = 0.170;
/// Thickness of bottom and wall, m.
pub const WALL_M: f64 = 0.001;
/// Glycerol.
pub const DENSITY_KG_M3: f64 = 1260.0;
/// The bead that it forms on the rim, m: two capillary lengths times sin 45 degrees, at 0.063 N/m.
pub const BEAD_M: f64 = 0.0032;
/// Mass of the empty bottle, kg.
pub const BOTTLE_KG: f64 = 0.085;
/// Mass of the gripper, kg.
pub const GRIPPER_KG: f64 = 0.9;
/// Height of the grasp above the outer bottom, m.
pub const GRASP_M: f64 = 0.129;
/// Height of the empty bottle's centre of mass above its outer bottom, m.
pub const SHELL_M: f64 = 0.086;
/// Gravity, m/s^2.
pub const GRAVITY_M_S2: f64 = 9.80665;
