#![doc = include_str!("../README.md")]

mod given;
mod recorder;
mod source;
mod store;
mod tally;

pub use recorder::{RecordError, record};
pub use source::{Contents, Kind, Next, Reading, Source, SourceError, source};
pub use tally::Tally;
