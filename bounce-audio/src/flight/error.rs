/// Why there is no flight.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FlightError {
    /// A coefficient or the state at the start is not a finite number.
    #[error("{name} is {value}, expected a finite number")]
    NotFinite {
        /// Which one.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// A drag is below zero: it would push.
    #[error("{name} is {value}, expected zero or more")]
    Negative {
        /// Which one.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// The times do not rise from zero on.
    #[error("time {index} is {value} s, expected finite times of zero or more that do not fall")]
    Times {
        /// Index of the time.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// The integration needs more steps than it is allowed: drag or lift are too strong for these speeds.
    #[error("the flight cannot be followed beyond {reached_s} s: its acceleration changes too fast")]
    TooStiff {
        /// Time reached in seconds.
        reached_s: f64,
    },
    /// The ball is farther away, or faster, than a number can hold.
    #[error("the state at {time_s} s is beyond what a number can hold")]
    Overflow {
        /// Time of the state in seconds.
        time_s: f64,
    },
    /// `out` has another length than `times`.
    #[error("{expected} times need as many states, got {got}")]
    Length {
        /// Number of times.
        expected: usize,
        /// Length of the output.
        got: usize,
    },
}
