//! Planners of rolls, and what they minimise.

pub mod cem;
mod objective;
pub mod powell;

pub use self::objective::{MOST_HORIZON, Objective, Planner, Task};
