//! Why there is no such room.

use thiserror::Error;

/// Why there is no such room.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{what} is {got}, expected {expected}")]
pub struct RoomError {
    /// Which value.
    pub what: &'static str,
    /// What is taken.
    pub expected: &'static str,
    /// The value stated.
    pub got: f64,
}
