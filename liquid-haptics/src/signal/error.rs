/// Why streams cannot be processed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SignalError {
    /// A setting is outside its range.
    #[error("{name} is {got}, expected {expected}")]
    Range {
        /// What it is.
        name: &'static str,
        /// What came.
        got: f64,
        /// What is allowed.
        expected: &'static str,
    },
    /// A time is no number or not after the one before.
    #[error("{stream}: time {got} s after {before} s, expected times that rise")]
    Time {
        /// Which stream.
        stream: &'static str,
        /// The time before.
        before: f64,
        /// What came.
        got: f64,
    },
    /// A value is no number.
    #[error("{stream}: a value of {got} at {t_s} s, expected a number")]
    Value {
        /// Which stream.
        stream: &'static str,
        /// When.
        t_s: f64,
        /// What came.
        got: f64,
    },
    /// There is too little to work on.
    #[error("{got} {what}, expected {least} or more")]
    TooFew {
        /// What is counted.
        what: &'static str,
        /// How many came.
        got: usize,
        /// How many are needed.
        least: usize,
    },
    /// Two streams do not show the same motion.
    #[error("the streams' best correlation is {got}, expected {least} or more")]
    NotAlike {
        /// What came.
        got: f64,
        /// What is needed.
        least: f64,
    },
}
