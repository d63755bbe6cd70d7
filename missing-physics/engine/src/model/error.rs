//! What a simulation says where it has no answer.

/// The largest modulus that a prediction may have: its square is a number still, and so are sums of squares.
pub const LARGEST_PREDICTION: f64 = 1e150;

/// A prediction that could not be made at the given parameters.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("no prediction for run {run}: {reason}")]
pub struct PredictError {
    /// Label of the run.
    pub run: String,
    /// What went wrong, with the values involved.
    pub reason: String,
}
