#![doc = include_str!("../README.md")]

pub mod band;
pub mod dough;
pub mod dynamics;
#[cfg(feature = "fake")]
pub mod fake;
pub mod features;
pub mod filter;
pub mod gaussian_process;
pub mod goal;
pub mod handling;
mod learning;
mod line_search;
pub mod matching;
pub mod mpc;
pub mod network;
pub mod nuisance;
pub mod planner;
pub mod policy;
pub mod powell;
pub mod predictor;
mod process_noise;
pub mod repair;
pub mod ridge;
pub mod roll;
pub mod rollout;
pub mod sensitivity;
pub mod stiffness;
mod surface;
pub mod whitener;
