#![doc = include_str!("../README.md")]

pub mod calibrated;
pub mod fit;
pub mod indenter;
pub mod law;
mod number;
mod quadrature;
mod root;
pub mod viscoelastic;

pub use number::Number;
