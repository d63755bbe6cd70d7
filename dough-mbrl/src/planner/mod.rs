//! Planners of rolls, and what they minimise.

pub mod cem;
mod chance;
mod objective;
pub mod powell;

pub use self::chance::{Chance, GrowthError, LEAST_ROLLS, VarianceGrowth, changes_m};
pub use self::objective::{MOST_HORIZON, Objective, Planner, Task};
