//! Values and intervals of parameters.

pub(crate) mod estimates;
pub(crate) mod limits;
pub(crate) mod open_noise;
mod over_runs;
pub(crate) mod profile;
mod propagate;
pub(crate) mod reach;
