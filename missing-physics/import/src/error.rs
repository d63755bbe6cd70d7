//! Why a file cannot be imported.

use std::path::PathBuf;

use missing_physics_domains::recording::quoted;

/// Why a file cannot be imported; its text is one line that says what to do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// The file is not there, or cannot be opened.
    #[error("{}: {why}", name(.file))]
    Open {
        /// The file.
        file: PathBuf,
        /// What the system says.
        why: String,
    },
    /// The file is larger than what is read at once.
    #[error("{}: {bytes} bytes, expected at most {most}: cut it, or keep every tenth row", name(.file))]
    TooLarge {
        /// The file.
        file: PathBuf,
        /// Its size.
        bytes: u64,
        /// The largest size.
        most: u64,
    },
    /// The name tells no format.
    #[error(
        "{}: unknown kind of file, expected .csv, .tsv, .txt, .dat, .mcap (or a bag's folder), .parquet (or a data set's folder), .npy, .npz, .mat or .wav",
        name(.file)
    )]
    UnknownKind {
        /// The file.
        file: PathBuf,
    },
    /// A format that was left out when this program was compiled.
    #[error("{}: this program was compiled without the feature \"{feature}\", which reads it", name(.file))]
    LeftOut {
        /// The file.
        file: PathBuf,
        /// The cargo feature.
        feature: &'static str,
    },
    /// The file is not what its name says, or broken.
    #[error("{}: {why}", name(.file))]
    Broken {
        /// The file.
        file: PathBuf,
        /// What is wrong, and what helps.
        why: String,
    },
    /// A `--map`, `--set` or run option that makes no sense.
    #[error("{option}: {why}")]
    Option {
        /// The option as it was given.
        option: String,
        /// What is wrong, and what is expected.
        why: String,
    },
    /// The domain needs columns that were neither found nor mapped.
    #[error(
        "no column found for {}: say which by --map {}=\"NAME\"; there are: {}",
        .missing.join(", "), .missing[0], .there.join(", ")
    )]
    Missing {
        /// The domain's columns; at least one.
        missing: Vec<String>,
        /// The columns of the files.
        there: Vec<String>,
    },
    /// Nothing is left to write.
    #[error("{}: no row holds a number in every column that is used ({})", name(.file), .columns.join(", "))]
    NoRows {
        /// The file.
        file: PathBuf,
        /// The columns.
        columns: Vec<String>,
    },
    /// What cannot be done with this domain.
    #[error("{domain}: {why}")]
    Domain {
        /// The domain.
        domain: String,
        /// Why not, and what helps.
        why: String,
    },
    /// No such domain.
    #[error(transparent)]
    UnknownDomain(#[from] missing_physics_domains::UnknownDomain),
}

impl ImportError {
    pub(crate) fn broken(file: &std::path::Path, why: impl Into<String>) -> Self {
        Self::Broken { file: file.into(), why: one_line(&why.into()) }
    }

    pub(crate) fn option(option: impl Into<String>, why: impl Into<String>) -> Self {
        Self::Option { option: one_line(&option.into()), why: why.into() }
    }
}

/// A path on one line.
fn name(path: &std::path::Path) -> String {
    one_line(&path.display().to_string())
}

/// Foreign text on one line, and not too long.
pub(crate) fn one_line(text: &str) -> String {
    const LONGEST: usize = 300;
    let line: String = text.chars().take(LONGEST).map(|c| if c.is_control() { ' ' } else { c }).collect();
    if text.chars().nth(LONGEST).is_some() { format!("{line}…") } else { line }
}

/// A name in quotes, on one line.
pub(crate) fn in_quotes(text: &str) -> String {
    quoted(text)
}
