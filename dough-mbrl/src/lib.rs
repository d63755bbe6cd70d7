#![doc = include_str!("../README.md")]

pub mod band;
pub mod cem;
pub mod dough;
pub mod dynamics;
#[cfg(feature = "fake")]
pub mod fake;
pub mod features;
pub mod filter;
pub mod goal;
mod learning;
pub mod matching;
pub mod mpc;
pub mod network;
pub mod objective;
pub mod policy;
pub mod powell;
pub mod predictor;
pub mod process;
pub mod repair;
pub mod ridge;
pub mod roll;
pub mod rollout;
pub mod sensitivity;
pub mod stiffness;
mod surface;
pub mod tie;
