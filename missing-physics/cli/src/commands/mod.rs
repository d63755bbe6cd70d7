//! What the command line calls. Each command returns its text; only `main` prints.

mod diagnose;
mod list;
mod new;
mod predict;

pub use diagnose::{DiagnoseArguments, diagnose};
pub use list::{check, domains};
pub use new::new;
pub use predict::predict;

/// Why a command failed; its text is one line.
#[derive(Debug, thiserror::Error)]
pub enum CommandError {
    /// The recording cannot be read.
    #[error(transparent)]
    Read(#[from] missing_physics_domains::recording::ReadError),
    /// The recording cannot be diagnosed.
    #[error(transparent)]
    Diagnose(#[from] missing_physics::engine::DiagnoseError),
    /// The repaired model cannot be read, or does not fit the recording.
    #[error(transparent)]
    Repair(#[from] missing_physics_domains::repair::RepairError),
    /// The proof cannot go on.
    #[error(transparent)]
    Prove(#[from] missing_physics_prove::ProveError),
    /// Something else, in words.
    #[error("{0}")]
    Other(String),
}

/// Writes a file whole or not at all.
fn write_whole(path: &std::path::Path, contents: impl AsRef<[u8]>) -> Result<(), CommandError> {
    missing_physics_report::write_whole(path, contents)
        .map_err(|e| CommandError::Other(format!("{}: {e}", path.display())))
}
