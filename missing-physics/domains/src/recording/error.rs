//! Why a recording cannot be read.

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
    /// The recording is sound, but what its model needs cannot be learned from it or simulated for it.
    #[error("{file}: {why}")]
    Unfit {
        /// The file.
        file: String,
        /// What cannot be done, and why.
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
