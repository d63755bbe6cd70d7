#![doc = include_str!("../README.md")]

mod recorder;
mod source;
mod tally;

pub use recorder::{RecordError, record};
pub use source::{Next, Source, SourceError, source};
pub use tally::Tally;
