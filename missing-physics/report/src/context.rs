//! What a report says beside the diagnosis.

use std::collections::BTreeMap;

use crate::figure::Figure;

/// What a report says of the recording beside the diagnosis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReportContext {
    /// Identifier of the domain.
    pub domain: String,
    /// The folder, as it was given.
    pub recording: String,
    /// Title of the page.
    pub title: String,
    /// Sources that references cite by a key, in full: each begins with its key, `[Author year]`.
    pub citations: Vec<String>,
    /// Channels and variables in words, by name (`z_m`: `height`); a name without words stands for itself.
    pub words: BTreeMap<String, String>,
    /// What the domain adds to the answer, by the key it has there.
    pub additions: serde_json::Map<String, serde_json::Value>,
    /// Pictures of the domain, for the page.
    pub figures: Vec<Figure>,
    /// What the answer was made from: version, seed, alpha, and the SHA-256 of the files; null where nobody says.
    pub provenance: serde_json::Value,
}
