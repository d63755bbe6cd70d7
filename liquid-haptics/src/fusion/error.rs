use crate::container::ContainerError;

/// Why there is no posterior.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FusionError {
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
    /// A pose or a reading holds something that is no number, or a time that does not rise.
    #[error("{what} {index} (counted from 0) holds {got}, expected {expected}")]
    Value {
        /// A pose, a time or a torque.
        what: &'static str,
        /// Which one.
        index: usize,
        /// What came.
        got: f64,
        /// What is allowed.
        expected: &'static str,
    },
    /// There are not as many times as torques.
    #[error("{times} times and {torques} torques, expected as many of each")]
    Lengths {
        /// How many times.
        times: usize,
        /// How many torques.
        torques: usize,
    },
    /// There is too little to weigh.
    #[error("{got} {what}, expected {least} or more")]
    TooFew {
        /// What is counted.
        what: &'static str,
        /// How many came.
        got: usize,
        /// How many are needed.
        least: usize,
    },
    /// The readings of a swing end too soon.
    #[error("a swing of {got_s} s, expected {least_s} s or more")]
    TooShort {
        /// How long the readings last, s.
        got_s: f64,
        /// How long they should, s.
        least_s: f64,
    },
    /// Nothing within the prior has a likelihood: another unit, another container, or noise that is stated far too small.
    #[error(
        "no volume, density and viscosity within the prior come near the readings; expected readings of this container, in N, N m, rad and s"
    )]
    NothingFits,
    /// The container's.
    #[error(transparent)]
    Container(#[from] ContainerError),
}
