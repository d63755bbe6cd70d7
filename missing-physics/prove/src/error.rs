//! Why a proof cannot go on.

use std::path::PathBuf;

use missing_physics::engine::DiagnoseError;
use missing_physics_domains::recording::{ReadError, quoted};

/// Why a proof cannot go on; its text is one line.
#[derive(Debug, thiserror::Error)]
pub enum ProveError {
    /// A world's recording cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// No worlds can be drawn of the domain.
    #[error("no worlds of the domain {}, expected one of: {}", quoted(.domain), .known.join(", "))]
    UnknownDomain {
        /// The domain that was asked for.
        domain: String,
        /// The domains of which worlds can be drawn.
        known: Vec<&'static str>,
    },
    /// A kind of worlds that there is not.
    #[error("no worlds of the kind {}, expected one of: nothing, one, two, unlisted, leftover, imitated, local", quoted(.kind))]
    UnknownKind {
        /// The kind that was asked for.
        kind: String,
    },
    /// A kind of worlds that the domain has not.
    #[error("no worlds of the kind {kind} in the domain {domain}, expected one of the domains: {}", .known.join(", "))]
    NoneOfKind {
        /// The domain that was asked for.
        domain: String,
        /// The kind that was asked for.
        kind: String,
        /// The domains that have such worlds.
        known: Vec<&'static str>,
    },
    /// A world that is none of the proof's.
    #[error("no world {}, expected a domain and a number as trajectory/0003", quoted(.name))]
    UnknownWorld {
        /// The world that was asked for.
        name: String,
    },
    /// No world was asked for.
    #[error("0 worlds prove nothing, expected at least 1")]
    NoWorlds,
    /// No run of each world was asked for.
    #[error("0 runs of each world prove nothing, expected at least 1")]
    NoRuns,
    /// The threads that were asked for cannot be started.
    #[error("{threads} threads cannot be had: {error}")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// What the thread pool says.
        error: rayon::ThreadPoolBuildError,
    },
    /// A file or folder of the proof cannot be written.
    #[error("{}: {error}", .path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the system says.
        error: std::io::Error,
    },
    /// The folder holds the proof of other arguments, or of another version.
    #[error(
        "{}: another proof (other domains, worlds, seed or version), expected a new folder or the same arguments",
        .folder.display()
    )]
    OtherProof {
        /// The folder.
        folder: PathBuf,
    },
    /// A file of a world is missing or is not whole.
    #[error("{}: {file} is missing", .folder.display())]
    Missing {
        /// The world's folder.
        folder: PathBuf,
        /// The file.
        file: &'static str,
    },
    /// A world cannot be diagnosed.
    #[error("{}: {error}", .recording.display())]
    Diagnose {
        /// The world's recording.
        recording: PathBuf,
        /// Why.
        error: DiagnoseError,
    },
    /// The observer asked for a stop.
    #[error("stopped; the same command goes on")]
    Stopped,
}
