use crate::container::ContainerError;

/// Why a pour cannot be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PourError {
    /// A quantity is outside its range.
    #[error("{name} is {got}, expected {expected} (at most {most})")]
    Range {
        /// What it is.
        name: &'static str,
        /// What came.
        got: f64,
        /// What is allowed.
        expected: &'static str,
        /// The upper end of what is allowed.
        most: f64,
    },
    /// The wanted volume is more than can leave, or less than the bead lets out when it breaks.
    #[error("{wanted_m3} m^3 cannot be poured, expected {least_m3} to {most_m3} m^3")]
    NotPourable {
        /// What was wanted.
        wanted_m3: f64,
        /// The least that can be poured.
        least_m3: f64,
        /// The most that can be poured.
        most_m3: f64,
    },
    /// At no tilt does liquid leave.
    #[error(
        "nothing of {inside_m3} m^3 leaves at tilts of 0 to {steepest_rad} rad, expected a tilt that pours"
    )]
    NothingLeaves {
        /// The volume inside.
        inside_m3: f64,
        /// The steepest tilt.
        steepest_rad: f64,
    },
    /// Tilting further lets nothing out here.
    #[error("no flow at {tilt_rad} rad, expected a tilt at which the volume that stays falls")]
    NoFlow {
        /// The tilt.
        tilt_rad: f64,
    },
    /// The container's.
    #[error(transparent)]
    Container(#[from] ContainerError),
}
