#![doc = include_str!("../README.md")]

pub mod bounce;
pub mod bounces;
pub mod bundled;
pub mod concealed;
pub mod flight;
pub mod flights;
pub mod noise;
pub mod pendulum;
mod quadrature;
mod sizing;
pub mod wave;
pub mod waves;
