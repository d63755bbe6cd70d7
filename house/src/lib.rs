//! What the rules of this workspace are checked with: its packages, their files and what a file imports.
//!
//! The rules themselves are the tests. `cargo run -p house` prints the files and lines of every folder.

mod circles;
mod modules;
mod names;
mod sizes;
mod workspace;

pub use circles::{Circle, Edge, circles};
pub use modules::{Module, modules};
pub use sizes::{Size, sizes};
pub use workspace::{Package, metadata, packages, root, sources};

/// What can go wrong while sources are read, in words.
pub type Error = Box<dyn std::error::Error>;
