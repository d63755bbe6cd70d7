//! What a proof is asked for.

use std::path::PathBuf;

/// What `prove` is asked for.
#[derive(Debug, Clone)]
pub struct ProveArguments {
    /// One domain; all that can be proven without it.
    pub domain: Option<String>,
    /// Worlds of each domain.
    pub worlds: usize,
    /// One kind of worlds (`nothing`, `one`, `two`, `unlisted`, `leftover`, `imitated`, `local`); all in turns without it.
    pub kind: Option<String>,
    /// Seed of the worlds.
    pub seed: u64,
    /// Of each recording's runs the first ones, so many; all without it.
    pub runs: Option<usize>,
    /// The folder of the proof.
    pub folder: PathBuf,
    /// Number of threads; 0 for all cores.
    pub threads: usize,
}

impl Default for ProveArguments {
    /// A hundred worlds of each domain from the first seed, whole, in the folder `proof`.
    fn default() -> Self {
        Self {
            domain: None,
            worlds: 100,
            kind: None,
            seed: 1,
            runs: None,
            folder: "proof".into(),
            threads: 0,
        }
    }
}
