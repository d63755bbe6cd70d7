#![doc = include_str!("../README.md")]
mod diagnose;
mod domains;
mod error;
mod files;
mod propose;
mod samples;
#[cfg(target_arch = "wasm32")]
pub mod surface;

pub use diagnose::{Answer, Asked, Checked, Named, RunRows, check, diagnose};
pub use domains::{Channel, DomainHere, domains};
pub use error::WebError;
pub use files::Files;
pub use propose::{ColumnThere, Made, Proposed, TableThere, Taken, Wish, propose};
pub use samples::{Sample, samples};
