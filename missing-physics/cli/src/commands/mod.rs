//! What the command line calls. Each command returns what it says; only `main` prints.

mod diagnose;
mod error;
mod import;
mod list;
mod many;
mod memory;
mod new;
mod output;
mod predict;
mod provenance;
mod watch;

pub use diagnose::{DiagnoseArguments, diagnose};
pub use error::CommandError;
pub use import::import;
pub use list::{check, domains};
pub use many::{diagnose_many, into_folders};
pub use memory::most_memory;
pub use new::new;
pub use output::Said;
pub use predict::predict;
pub use watch::{WatchArguments, watch};
