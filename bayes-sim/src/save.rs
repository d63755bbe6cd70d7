//! Trained densities on disk, with the version of their format; predictions after loading have the same bits.

use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::error::Error;

/// Version of the format; a file of another one is refused.
pub const VERSION: u32 = 1;
const FORMAT: &str = "bayes-sim density";

#[derive(Serialize)]
struct Out<'a, T> {
    format: &'static str,
    version: u32,
    kind: &'static str,
    content: &'a T,
}

#[derive(Deserialize)]
struct Head {
    format: String,
    version: u32,
    kind: String,
}

#[derive(Deserialize)]
struct Content<T> {
    content: T,
}

/// What can be saved and loaded.
pub trait Saved: Serialize + DeserializeOwned {
    /// Name of the kind in the file.
    const KIND: &'static str;

    /// Writes a file.
    ///
    /// # Errors
    /// [`Error::Io`].
    fn save(&self, path: &Path) -> Result<(), Error> {
        let out = Out { format: FORMAT, version: VERSION, kind: Self::KIND, content: self };
        let text = serde_json::to_string(&out)
            .map_err(|e| Error::Format { path: path.to_owned(), reason: e.to_string() })?;
        // Whole or not at all: a stop while writing must not leave half a file in the place of a good one.
        let beside = path.with_extension("part");
        std::fs::write(&beside, text).map_err(Error::io(&beside))?;
        std::fs::rename(&beside, path).map_err(Error::io(path))
    }

    /// Reads a file.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] for another kind or version, or a damaged file.
    fn load(path: &Path) -> Result<Self, Error> {
        let bad = |reason: String| Error::Format { path: path.to_owned(), reason };
        let text = std::fs::read_to_string(path).map_err(Error::io(path))?;
        let head: Head = serde_json::from_str(&text).map_err(|e| bad(format!("no saved density: {e}")))?;
        if head.format != FORMAT || head.version != VERSION || head.kind != Self::KIND {
            let expected = format!("{FORMAT} version {VERSION}, {}", Self::KIND);
            return Err(bad(format!(
                "expected {expected}, got {} version {}, {}",
                head.format, head.version, head.kind
            )));
        }
        let content: Content<Self> = serde_json::from_str(&text).map_err(|e| bad(e.to_string()))?;
        Ok(content.content)
    }
}

impl Saved for crate::mdn::Mdn {
    const KIND: &'static str = "mixture density network";
}

impl Saved for crate::mdrff::Mdrff {
    const KIND: &'static str = "mixture density on random features";
}

impl Saved for crate::autoregressive::Autoregressive {
    const KIND: &'static str = "autoregressive density";
}

impl Saved for crate::novelty::Novelty {
    const KIND: &'static str = "novelty";
}
