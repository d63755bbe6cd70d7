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
    Read(#[from] crate::recording::ReadError),
    /// The recording cannot be diagnosed.
    #[error(transparent)]
    Diagnose(#[from] missing_physics::engine::DiagnoseError),
    /// The repaired model cannot be read, or does not fit the recording.
    #[error(transparent)]
    Repair(#[from] crate::repair::RepairError),
    /// Something else, in words.
    #[error("{0}")]
    Other(String),
}

/// Writes a file whole or not at all.
pub(crate) fn write_whole(path: &std::path::Path, contents: impl AsRef<[u8]>) -> Result<(), CommandError> {
    let fail = |e: std::io::Error| CommandError::Other(format!("{}: {e}", path.display()));
    let Some(name) = path.file_name() else {
        return Err(CommandError::Other(format!("{}: not the name of a file", path.display())));
    };
    let mut hidden = std::ffi::OsString::from(".");
    hidden.push(name);
    hidden.push(format!(".{}.part", std::process::id()));
    let part = path.with_file_name(hidden);
    std::fs::write(&part, contents).map_err(fail)?;
    std::fs::rename(&part, path).map_err(|e| {
        // The half that was written is of no use to anybody; that it cannot be removed changes nothing.
        let _ = std::fs::remove_file(&part);
        fail(e)
    })
}
