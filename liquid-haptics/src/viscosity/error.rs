/// Why no viscosity can be estimated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ViscosityError {
    /// A quantity is outside its range.
    #[error("{name} is {got}, expected {expected}")]
    Range {
        /// What it is.
        name: &'static str,
        /// What came.
        got: f64,
        /// What is allowed.
        expected: &'static str,
    },
    /// A reading or its time is no number, or its time does not rise.
    #[error("reading {index} (counted from 0): {what} is {got}, expected {expected}")]
    Reading {
        /// Which reading.
        index: usize,
        /// Time or value.
        what: &'static str,
        /// What came.
        got: f64,
        /// What is allowed.
        expected: &'static str,
    },
    /// There are not as many times as readings.
    #[error("{times} times and {readings} readings, expected as many of each")]
    Lengths {
        /// How many times.
        times: usize,
        /// How many readings.
        readings: usize,
    },
    /// There are too few readings.
    #[error("{got} readings, expected {least} or more")]
    TooFew {
        /// How many came.
        got: usize,
        /// How many are needed.
        least: usize,
    },
    /// Nothing like it is in the readings.
    #[error("the readings hold no {what}")]
    NoFit {
        /// What was looked for.
        what: &'static str,
    },
}
