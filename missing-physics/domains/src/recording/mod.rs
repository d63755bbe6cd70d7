//! Recordings on disk: `recording.toml` and the tables that it names.
//!
//! Strict on purpose: an unknown key or column is an error, and every error is one line that says which file, row and
//! column, what is wrong and what is expected.

mod header;
mod table;

pub use header::{Header, Section};
pub use table::{Column, Table, Values};

use std::path::{Path, PathBuf};

/// The largest file that is read, in bytes.
pub const LARGEST_FILE: u64 = 256 * 1024 * 1024;

/// Why a recording cannot be read; its text is one line.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ReadError {
    /// The file or folder is not there or cannot be opened.
    #[error("{file}: {why}")]
    Open {
        /// The file.
        file: String,
        /// What the system says.
        why: String,
    },
    /// The file is larger than [`LARGEST_FILE`].
    #[error("{file}: {bytes} bytes, expected at most {LARGEST_FILE}")]
    TooLarge {
        /// The file.
        file: String,
        /// Its size.
        bytes: u64,
    },
    /// The text is not UTF-8.
    #[error("{file}: byte {at} is not UTF-8 text")]
    NotText {
        /// The file.
        file: String,
        /// Where the text ends.
        at: usize,
    },
    /// The TOML does not parse.
    #[error("{file}, row {row}: {why}")]
    Toml {
        /// The file.
        file: String,
        /// Line, from 1.
        row: usize,
        /// What the parser says.
        why: String,
    },
    /// A key is missing.
    #[error("{file}: key {key} is missing, expected {expected}")]
    MissingKey {
        /// The file.
        file: String,
        /// The key with its section.
        key: String,
        /// What it should hold.
        expected: String,
    },
    /// A key that nobody knows.
    #[error("{file}: unknown key {key}, expected one of: {expected}")]
    UnknownKey {
        /// The file.
        file: String,
        /// The key with its section.
        key: String,
        /// The known keys.
        expected: String,
    },
    /// A key holds the wrong thing.
    #[error("{file}: key {key} is {got}, expected {expected}")]
    Value {
        /// The file.
        file: String,
        /// The key with its section.
        key: String,
        /// What it holds.
        got: String,
        /// What it should hold.
        expected: String,
    },
    /// A column is missing.
    #[error("{file}, row 1: column {column} is missing, expected {expected}")]
    MissingColumn {
        /// The file.
        file: String,
        /// The column.
        column: String,
        /// What it should hold.
        expected: String,
    },
    /// A column that nobody knows.
    #[error("{file}, row 1: unknown column {column}, expected {expected}")]
    UnknownColumn {
        /// The file.
        file: String,
        /// The column.
        column: String,
        /// The known columns, or the one that was meant.
        expected: String,
    },
    /// A column that stands twice.
    #[error("{file}, row 1: column {column} stands twice, expected once")]
    DuplicateColumn {
        /// The file.
        file: String,
        /// The column.
        column: String,
    },
    /// A row with another number of cells than the header.
    #[error("{file}, row {row}: {got} cells, expected {expected}")]
    Ragged {
        /// The file.
        file: String,
        /// Line, from 1.
        row: u64,
        /// Cells found.
        got: usize,
        /// Cells expected.
        expected: usize,
    },
    /// A cell that is not what its column holds.
    #[error("{file}, row {row}, column {column}: {got}, expected {expected}")]
    Cell {
        /// The file.
        file: String,
        /// Line, from 1.
        row: u64,
        /// The column.
        column: String,
        /// What the cell holds.
        got: String,
        /// What it should hold.
        expected: String,
    },
    /// Too few rows.
    #[error("{file}: {what} has {got} rows, expected {expected}")]
    TooFewRows {
        /// The file.
        file: String,
        /// The run, or the whole file.
        what: String,
        /// Rows found.
        got: usize,
        /// Rows expected.
        expected: String,
    },
}

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
    let file = one_line(&path.display().to_string());
    let text = String::from_utf8(read_bytes(path)?)
        .map_err(|e| ReadError::NotText { file: file.clone(), at: e.utf8_error().valid_up_to() })?;
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

/// The file that a recording names: it must lie in the recording's own folder.
///
/// # Errors
/// [`ReadError::Value`] for a path that is absolute or leads out of the folder.
pub fn inside(folder: &Path, file: &str, key: &str, name: &str) -> Result<PathBuf, ReadError> {
    use std::path::Component;
    let path = Path::new(name);
    let within =
        !name.is_empty() && path.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
    if !within {
        return Err(ReadError::Value {
            file: file.into(),
            key: key.into(),
            got: quoted(name),
            expected: "a file in the recording's folder".into(),
        });
    }
    Ok(folder.join(path))
}

/// A text in quotes, on one line and not too long.
pub fn quoted(text: &str) -> String {
    let short: String = text.chars().take(40).collect();
    let dots = if text.chars().count() > 40 { "…" } else { "" };
    format!("\"{}{dots}\"", one_line(&short))
}

/// What another reader says, on one line, without its middle where it quotes much.
pub(crate) fn brief(text: &str) -> String {
    const END: usize = 100;
    let line: Vec<char> = one_line(text).chars().collect();
    if line.len() <= 2 * END {
        return line.into_iter().collect();
    }
    let part = |chars: &[char]| chars.iter().collect::<String>();
    format!("{}…{}", part(&line[..END]), part(&line[line.len() - END..]))
}

/// A text with everything that would break a line escaped.
pub(crate) fn one_line(text: &str) -> String {
    text.chars()
        .flat_map(|c| if c.is_control() { c.escape_default().collect::<Vec<_>>() } else { vec![c] })
        .collect()
}
