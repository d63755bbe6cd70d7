//! Measurement noise: its law along a run, the shapes among which the data choose, what is known of it before any fit, and what a fit
//! shows of it.

pub(crate) mod estimate;
pub(crate) mod family;
pub(crate) mod process;
pub(crate) mod rough;
pub(crate) mod rule;

pub use process::{Shape, Whitener, rough_sigma};
