#![doc = include_str!("../README.md")]
pub mod data;
pub mod diagnosis;
pub mod engine;
pub mod fit;
pub mod model;
pub mod observer;
