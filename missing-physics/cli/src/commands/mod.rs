//! What the command line calls. Each command returns its text; only `main` prints.

mod diagnose;
mod error;
mod list;
mod new;
mod predict;
mod provenance;

pub use diagnose::{DiagnoseArguments, diagnose};
pub use error::CommandError;
pub use list::{check, domains};
pub use new::new;
pub use predict::predict;
