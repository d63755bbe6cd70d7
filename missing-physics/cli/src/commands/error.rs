//! Why a command failed.

use std::path::PathBuf;

use missing_physics_domains::recording::quoted;

/// Why a command failed; its text is one line.
#[derive(Debug, thiserror::Error)]
pub enum CommandError {
    /// The recording cannot be read.
    #[error(transparent)]
    Read(#[from] missing_physics_domains::recording::ReadError),
    /// No such domain.
    #[error(transparent)]
    UnknownDomain(#[from] missing_physics_domains::UnknownDomain),
    /// The recording cannot be diagnosed.
    #[error(transparent)]
    Diagnose(#[from] missing_physics::engine::DiagnoseError),
    /// The repaired model cannot be read, or does not fit the recording.
    #[error(transparent)]
    Repair(#[from] missing_physics_domains::repair::RepairError),
    /// A file cannot be imported.
    #[error(transparent)]
    Import(#[from] missing_physics_import::ImportError),
    /// What was imported is no sound recording; nothing is left of it.
    #[error("{why} (--map, --run and --every settle what was taken for what; without --out it is shown)")]
    Unsound {
        /// What was taken for what.
        text: String,
        /// What `check` says.
        why: String,
    },
    /// The proof cannot go on.
    #[error(transparent)]
    Prove(#[from] missing_physics_prove::ProveError),
    /// The folder of a file that is to be written is not there.
    #[error("{}: no such folder to write to", .folder.display())]
    NoFolder {
        /// The folder.
        folder: PathBuf,
    },
    /// A folder stands where a file is to be written.
    #[error("{}: a folder, expected the name of a file", .path.display())]
    NotAFile {
        /// The folder.
        path: PathBuf,
    },
    /// Something else stands where a folder is to be written to.
    #[error("{}: no folder, expected one: several recordings have a file each", .path.display())]
    NotAFolder {
        /// What stands there.
        path: PathBuf,
    },
    /// The recording starts a program, and nobody has allowed it.
    #[error(
        "{}: starts the program {}; call again with --allow-command where you trust it", .folder.display(), quoted(.program)
    )]
    Program {
        /// The recording's folder.
        folder: PathBuf,
        /// The program and its arguments.
        program: String,
    },
    /// A file that is read would be written over.
    #[error("{}: is read, and cannot be an output as well", .path.display())]
    IsInput {
        /// The file.
        path: PathBuf,
    },
    /// Two outputs have one name.
    #[error("{}: two outputs of one name, expected a name for each", .path.display())]
    Twice {
        /// The name.
        path: PathBuf,
    },
    /// The folder of a new recording holds something.
    #[error("{}: exists, expected a new or empty folder", .folder.display())]
    NotEmpty {
        /// The folder.
        folder: PathBuf,
    },
    /// A file or folder cannot be read or written.
    #[error("{}: {error}", .path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system says.
        error: std::io::Error,
    },
    /// A diagnosis would take more memory than there is.
    #[error(
        "takes up to {needed_gb:.1} GB of memory, and {free_gb:.1} GB are free: give it fewer rows, or allow it with --memory {:.0}", .needed_gb.ceil()
    )]
    Memory {
        /// The most that it takes, GB.
        needed_gb: f64,
        /// What is free, GB.
        free_gb: f64,
    },
    /// The threads that were asked for cannot be started.
    #[error("{threads} threads cannot be had: {error}")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// What the thread pool says.
        error: rayon::ThreadPoolBuildError,
    },
}
