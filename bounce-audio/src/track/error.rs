//! Why there is no such tracker.

use thiserror::Error;

/// Why a tracker cannot be made.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum TrackError {
    /// The posterior has no draws.
    #[error("{got} balls, expected at least {expected}")]
    NoBall {
        /// Least number.
        expected: usize,
        /// Number of balls.
        got: usize,
    },
    /// A value is out of its range.
    #[error("{what} is {got}, expected {expected}")]
    Value {
        /// Which one.
        what: &'static str,
        /// What is taken.
        expected: &'static str,
        /// The value stated.
        got: f64,
    },
}
