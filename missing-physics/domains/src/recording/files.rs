//! Files of limited size, within a recording's folder.

use std::path::{Path, PathBuf};

use super::error::{LARGEST_FILE, ReadError};
use super::words::{one_line, quoted};

/// Name of a recording's header.
pub(super) const HEADER: &str = "recording.toml";

/// Reads a file of limited size.
///
/// # Errors
/// [`ReadError::Open`], [`ReadError::TooLarge`].
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, ReadError> {
    let file = one_line(&path.display().to_string());
    let open = |e: std::io::Error| ReadError::Open { file: file.clone(), why: plain(&e) };
    let metadata = std::fs::metadata(path).map_err(open)?;
    if !metadata.is_file() {
        return Err(ReadError::Open { file, why: "not a file".into() });
    }
    if metadata.len() > LARGEST_FILE {
        return Err(ReadError::TooLarge { file, bytes: metadata.len() });
    }
    std::fs::read(path).map_err(open)
}

/// Reads a text file of limited size.
///
/// # Errors
/// [`ReadError::Open`], [`ReadError::TooLarge`], [`ReadError::NotText`].
pub fn read_text(path: &Path) -> Result<String, ReadError> {
    text_of(one_line(&path.display().to_string()), read_bytes(path)?)
}

/// The bytes of a file as text, without the mark that it is UTF-8.
pub(super) fn text_of(file: String, bytes: Vec<u8>) -> Result<String, ReadError> {
    let text = String::from_utf8(bytes)
        .map_err(|e| ReadError::NotText { file, at: e.utf8_error().valid_up_to() })?;
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}

/// What the system says of a failure, in words that are the same everywhere.
fn plain(error: &std::io::Error) -> String {
    match error.kind() {
        std::io::ErrorKind::NotFound => "no such file".into(),
        std::io::ErrorKind::PermissionDenied => "may not be read".into(),
        _ => one_line(&error.to_string()),
    }
}

/// Checks the name of a file that a recording names: it must lie in the recording's own folder.
///
/// # Errors
/// [`ReadError::Value`] for a path that is absolute or leads out of the folder.
pub(super) fn within(file: &str, key: &str, name: &str) -> Result<(), ReadError> {
    use std::path::Component;
    let mut components = Path::new(name).components();
    if !name.is_empty() && components.all(|c| matches!(c, Component::Normal(_) | Component::CurDir)) {
        return Ok(());
    }
    Err(ReadError::Value {
        file: file.into(),
        key: key.into(),
        got: quoted(name),
        expected: "a file in the recording's folder".into(),
    })
}

/// The program that a recording starts, with its arguments, where it names one.
pub fn program_of(folder: &Path) -> Option<Vec<String>> {
    let table = read_text(&folder.join(HEADER)).ok()?.parse::<toml::Table>().ok()?;
    let command = table.get("simulator")?.get("command")?.as_array()?;
    Some(command.iter().filter_map(|word| word.as_str().map(str::to_owned)).collect())
}

/// The files that a recording's folder is read from: `recording.toml`, what it names, and pictures beside it.
///
/// Nothing is checked; a folder without a header has the header's name alone.
pub fn files_of(folder: &Path) -> Vec<PathBuf> {
    fn texts(value: &toml::Value, found: &mut Vec<String>) {
        match value {
            toml::Value::String(text) => found.push(text.clone()),
            toml::Value::Array(list) => list.iter().for_each(|inner| texts(inner, found)),
            toml::Value::Table(table) => table.values().for_each(|inner| texts(inner, found)),
            _ => {}
        }
    }
    let header = folder.join(HEADER);
    let mut names = Vec::new();
    if let Some(table) = read_text(&header).ok().and_then(|text| text.parse::<toml::Table>().ok()) {
        table.values().for_each(|value| texts(value, &mut names));
    }
    let named = names.iter().map(|name| folder.join(name)).filter(|path| path.is_file());
    let beside = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let pictures = beside.filter(|path| path.extension().is_some_and(|e| e == "png"));
    std::iter::once(header.clone()).chain(named).chain(pictures).collect()
}
