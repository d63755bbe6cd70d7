//! Files that are there whole or not at all.

use std::io;
use std::path::Path;

/// Writes a file whole or not at all: beside its place first, then moved there.
///
/// # Errors
/// What the file system says; where `path` ends in no name, [`io::ErrorKind::InvalidInput`].
pub fn write_whole(path: &Path, contents: impl AsRef<[u8]>) -> io::Result<()> {
    let Some(name) = path.file_name() else {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not the name of a file"));
    };
    let mut hidden = std::ffi::OsString::from(".");
    hidden.push(name);
    hidden.push(format!(".{}.part", std::process::id()));
    let part = path.with_file_name(hidden);
    std::fs::write(&part, contents)?;
    std::fs::rename(&part, path).inspect_err(|_| {
        // The half that was written is of no use to anybody; that it cannot be removed changes nothing.
        let _ = std::fs::remove_file(&part);
    })
}
