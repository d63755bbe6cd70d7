//! Why there is no simulation, or why it ended.

/// What is wrong with a set-up or a run.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DemError {
    /// A number that has to be finite and above zero is not.
    #[error("{name} is {value}, expected a finite number above zero")]
    NotPositive {
        /// Which one.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// A number lies outside its range.
    #[error("{name} is {value}, expected {low} to {high}")]
    OutOfRange {
        /// Which one.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The lowest that is allowed.
        low: f64,
        /// The highest that is allowed.
        high: f64,
    },
    /// There are no grains, or too many.
    #[error("{received} grains, expected 1 to {most}")]
    Count {
        /// How many there are.
        received: usize,
        /// The largest number allowed.
        most: usize,
    },
    /// A list has another length than the grains.
    #[error("{name} has {received} entries, expected {expected}, one a grain")]
    Length {
        /// Which list.
        name: &'static str,
        /// The number of grains.
        expected: usize,
        /// The list's length.
        received: usize,
    },
    /// There is no wall or grain of that number.
    #[error("there is no {name} {received}, expected an index below {count}")]
    Index {
        /// A wall or a grain.
        name: &'static str,
        /// The index that was asked for.
        received: usize,
        /// How many there are.
        count: usize,
    },
    /// The step is longer than contacts can be followed with.
    #[error("a step of {received_s} s is unstable, at most {stable_s} s is stable")]
    Step {
        /// The step that was asked for, in s.
        received_s: f64,
        /// The longest stable step, in s.
        stable_s: f64,
    },
    /// The funnel does not take up the grains: its outlet or its tube is narrower than one.
    #[error("grain {placed} of {expected} found no free place in the funnel")]
    Fill {
        /// Grains that found a place.
        placed: usize,
        /// Grains to be placed.
        expected: usize,
    },
    /// A position or a speed is no longer a finite number.
    #[error("the motion is not finite after {time_s} s")]
    Diverged {
        /// Simulated time in s.
        time_s: f64,
    },
}

/// Refuses what is not finite and above zero.
pub(crate) fn positive(name: &'static str, value: f64) -> Result<(), DemError> {
    if value > 0.0 && value.is_finite() { Ok(()) } else { Err(DemError::NotPositive { name, value }) }
}

/// Refuses what is not a finite number from `low` to `high`.
pub(crate) fn within(name: &'static str, value: f64, low: f64, high: f64) -> Result<(), DemError> {
    if value >= low && value <= high && value.is_finite() {
        Ok(())
    } else {
        Err(DemError::OutOfRange { name, value, low, high })
    }
}

/// Refuses vectors with a part that is not finite.
pub(crate) fn finite(name: &'static str, value: [f64; 3]) -> Result<(), DemError> {
    value.iter().try_for_each(|&x| within(name, x, f64::MIN, f64::MAX))
}
