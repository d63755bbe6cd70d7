#![doc = include_str!("../README.md")]
mod arguments;
mod error;
mod files;
mod key;
mod page;
mod place;
mod proof;
mod score;
mod table;
mod world;

pub use arguments::ProveArguments;
pub use error::ProveError;
pub use proof::{provable, prove, prove_world, seal_worlds};
pub use score::{DomainScore, Part, Score};
