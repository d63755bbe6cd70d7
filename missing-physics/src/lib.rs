#![doc = include_str!("../README.md")]
mod adequacy;
mod bank;
mod compare;
pub mod data;
pub mod diagnosis;
pub mod engine;
mod estimate;
mod experiment;
pub mod fit;
mod law;
pub mod likelihood;
mod linalg;
mod locate;
pub mod model;
pub mod noise;
pub mod observer;
mod problem;
pub mod synthetic;
