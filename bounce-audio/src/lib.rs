#![doc = include_str!("../README.md")]
pub mod flight;
pub mod impact;
pub mod missed;
