#![doc = include_str!("../README.md")]

#[cfg(feature = "fake")]
pub mod fake;
pub mod field;
pub mod flow;
pub mod grasp;
pub mod image;
pub mod load;
pub mod markers;
pub mod modulus;
mod regression;
pub mod shear;
pub mod slip;
pub mod stiffness;
