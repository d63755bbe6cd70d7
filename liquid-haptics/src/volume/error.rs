use crate::container::ContainerError;

/// Why neither mass nor volume can be said.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum VolumeError {
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
    /// A pose holds something that is no number.
    #[error("pose {index} (counted from 0) holds {got}, expected numbers")]
    Pose {
        /// Which pose.
        index: usize,
        /// What came.
        got: f64,
    },
    /// There are too few poses for what is to be fitted.
    #[error("{got} {what}, expected {least} or more")]
    TooFew {
        /// What is counted.
        what: &'static str,
        /// How many came.
        got: usize,
        /// How many are needed.
        least: usize,
    },
    /// No pose determines a quantity that is to be fitted.
    #[error("the poses fix {fixed} of {fitted} quantities ({what}), expected poses that tell them apart")]
    NotDetermined {
        /// What was to be fitted.
        what: &'static str,
        /// How many combinations the poses fix.
        fixed: usize,
        /// How many were to be fitted.
        fitted: usize,
    },
    /// The liquid's mass is below zero by more than its error.
    #[error("a liquid's mass of {mass_kg} kg with a standard error of {error_kg} kg, expected 0 or more")]
    NegativeMass {
        /// The mass.
        mass_kg: f64,
        /// Standard error of the mass.
        error_kg: f64,
    },
    /// No tilt tells anything about the volume.
    #[error(
        "no tilt's torque depends on the volume with a mass of {mass_kg} kg, expected a mass above its error"
    )]
    NothingToLearn {
        /// The liquid's mass.
        mass_kg: f64,
    },
    /// The container's.
    #[error(transparent)]
    Container(#[from] ContainerError),
    /// The search stopped early.
    #[error("the search for the volume stopped: {0}, expected it to run to its end")]
    Search(String),
}
