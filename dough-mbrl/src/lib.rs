#![doc = include_str!("../README.md")]

pub mod band;
pub mod dynamics;
pub mod features;
pub mod filter;
