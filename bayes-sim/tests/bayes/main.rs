//! All tests of the crate: one program, linked once.

mod c2st;
mod calibration;
mod campaign;
mod common;
mod features;
mod mixtures;
mod posteriors;
mod priors;
mod truncation;
