//! Lengths with their standard deviations.

/// A length that was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredLength {
    /// The length, m.
    pub value_m: f64,
    /// Its standard deviation, m.
    pub sigma_m: f64,
}
