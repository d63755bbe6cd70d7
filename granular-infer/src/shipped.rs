//! What was learned, in few bytes.

use std::io::Read;

use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// A learned density that cannot be read or written.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("no learned density: {reason}")]
pub struct ShippedError {
    /// In words.
    pub reason: String,
}

fn bad(error: impl std::fmt::Display) -> ShippedError {
    ShippedError { reason: error.to_string() }
}

/// Compressed JSON.
pub(crate) fn pack<T: Serialize>(value: &T) -> Result<Vec<u8>, ShippedError> {
    let mut encoder = GzEncoder::new(Vec::new(), flate2::Compression::best());
    serde_json::to_writer(&mut encoder, value).map_err(bad)?;
    encoder.finish().map_err(bad)
}

/// What [`pack`] wrote.
pub(crate) fn unpack<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, ShippedError> {
    let mut text = String::new();
    GzDecoder::new(bytes).read_to_string(&mut text).map_err(bad)?;
    serde_json::from_str(&text).map_err(bad)
}
