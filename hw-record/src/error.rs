use std::path::PathBuf;

use hw_drivers::DriverError;

/// Why nothing was recorded, or no more.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// A file cannot be written.
    #[error("{}: {error}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        error: std::io::Error,
    },
    /// Two sources have one name.
    #[error("two devices are called {name}, expected a name for each")]
    Twice {
        /// The name.
        name: String,
    },
}

/// Why there is no such source.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// It is not written as it should be.
    #[error("{given:?}, expected {expected}")]
    Words {
        /// What was given.
        given: String,
        /// What was expected.
        expected: String,
    },
    /// The device cannot be reached.
    #[error(transparent)]
    Device(#[from] DriverError),
}
