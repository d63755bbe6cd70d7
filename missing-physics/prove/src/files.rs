//! The files of a proof: there whole, or not at all.

use std::path::Path;

use missing_physics_domains::recording::read_text;
use serde::{Deserialize, Serialize};

use crate::error::ProveError;

/// Makes a folder, with those above it.
pub(crate) fn make_folder(path: &Path) -> Result<(), ProveError> {
    std::fs::create_dir_all(path).map_err(|error| ProveError::Write { path: path.into(), error })
}

/// Writes a file whole or not at all.
pub(crate) fn write_whole(path: &Path, contents: impl AsRef<[u8]>) -> Result<(), ProveError> {
    missing_physics_report::write_whole(path, contents)
        .map_err(|error| ProveError::Write { path: path.into(), error })
}

/// Writes a value as JSON.
pub(crate) fn write_json(path: &Path, value: &impl Serialize) -> Result<(), ProveError> {
    // Numbers, texts and lists always serialise.
    let text = serde_json::to_string_pretty(value).unwrap_or_default();
    write_whole(path, text + "\n")
}

/// The value in a file of JSON; `None` where the file is not there or not whole.
pub(crate) fn read_json<T: for<'d> Deserialize<'d>>(path: &Path) -> Option<T> {
    serde_json::from_str(&read_text(path).ok()?).ok()
}
