//! What an answer was made from: version, options, and the files that were read.

use std::path::Path;

use missing_physics::engine::Options;
use missing_physics_domains::recording::Source;
use serde_json::{Value, json};

/// Version, seed, alpha, and the SHA-256 of the header and of every file in the recording's folder that the header names.
pub(super) fn provenance(folder: &Path, options: &Options) -> Value {
    let sha256 = Source::folder(folder).sha256();
    json!({"version": env!("CARGO_PKG_VERSION"), "seed": options.seed, "alpha": options.alpha, "sha256": sha256})
}
