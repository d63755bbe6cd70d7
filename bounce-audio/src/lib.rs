#![doc = include_str!("../README.md")]
pub mod flight;
pub mod hear;
pub mod impact;
pub mod localise;
pub mod missed;
pub mod onset;
pub mod wav;
