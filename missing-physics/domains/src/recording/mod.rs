//! Recordings, on disk or in memory: `recording.toml` and the tables that it names.
//!
//! Strict on purpose: an unknown key or column is an error, and every error is one line that says which file, row and
//! column, what is wrong and what is expected.

mod error;
mod files;
mod header;
mod source;
mod table;
mod words;

pub use error::{LARGEST_FILE, ReadError};
pub use files::{files_of, program_of, read_bytes, read_text};
pub use header::{Header, PLACEHOLDER, Section};
pub use source::{Memory, NamedFile, Source};
pub use table::{Column, ColumnContents, Table, Values};
#[cfg(feature = "custom")]
pub(crate) use words::brief;
pub(crate) use words::one_line;
pub use words::{quoted, unit_of};
