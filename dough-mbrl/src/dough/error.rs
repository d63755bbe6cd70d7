//! Why a cloud shows no dough.

/// Why a cloud shows no dough.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DoughError {
    /// Nothing was seen at all: no points, or none that is a number.
    #[error("none of the {points} points is a place: is the lens covered, or the depth picture all holes?")]
    Empty {
        /// Points that came.
        points: usize,
    },
    /// A setting of the view is no length above zero.
    #[error("{name} is {value}: expected above 0 and finite")]
    View {
        /// The setting.
        name: &'static str,
        /// What it is.
        value: f64,
    },
    /// The pose of the camera is none.
    #[error(
        "the camera's pose is none: its rotation has the size {size}, expected 1, and its position is to be finite"
    )]
    Pose {
        /// Size of the quaternion.
        size: f64,
    },
    /// The ground cannot be found.
    #[error("only {share:.0}% of the points lie on one level plane: expected at least {least:.0}%; is z up?", share = 100.0 * share, least = 100.0 * least)]
    NoGround {
        /// Share of the points in the best plane.
        share: f64,
        /// Share needed.
        least: f64,
    },
    /// Nothing stands on the ground.
    #[error(
        "{points} points stand on the ground together, at least {least} are needed: there is no dough in view"
    )]
    NoDough {
        /// Points of the largest thing on the ground.
        points: usize,
        /// Points needed.
        least: usize,
    },
    /// The dough goes on beyond the picture.
    #[error(
        "the dough lies at the edge of the picture, at column {column:.0} and row {row:.0}: what lies beyond is not seen"
    )]
    CutOff {
        /// Column of a corner of the box around it.
        column: f64,
        /// Its row.
        row: f64,
    },
}
