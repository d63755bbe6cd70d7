#![doc = include_str!("../README.md")]

mod error;
mod given;
mod recorder;
mod source;
mod store;
mod tally;

pub use error::{RecordError, SourceError};
pub use recorder::record;
pub use source::{Contents, Kind, Next, Reading, Source, source};
pub use tally::Tally;
