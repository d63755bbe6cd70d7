#![doc = include_str!("../README.md")]
pub mod data;
pub mod diagnosis;
pub mod engine;
pub mod fit;
mod linalg;
pub mod model;
pub mod noise;
pub mod observer;
mod problem;
