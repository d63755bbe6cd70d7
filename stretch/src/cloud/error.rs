//! Why a picture gives no cloud.

use hw_traits::picture::Intrinsics;

/// Why a picture gives no cloud.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum CloudError {
    /// Intrinsics, lengths or settings that are none.
    #[error("{what} is {got}; expected {expected}")]
    Setting {
        /// Which.
        what: &'static str,
        /// What it has to be.
        expected: &'static str,
        /// What it is.
        got: f64,
    },
    /// The membrane lies outside the picture.
    #[error(
        "the membrane covers {columns} x {rows} pixels of the picture; expected {expected} or more either way"
    )]
    OutOfView {
        /// Columns of it in the picture.
        columns: usize,
        /// Rows of it in the picture.
        rows: usize,
        /// Least number.
        expected: usize,
    },
    /// Too many pixels saw nothing.
    #[error("{seen} of {total} pixels of the membrane are seen; expected half or more")]
    Blind {
        /// Pixels with a depth.
        seen: usize,
        /// Pixels of the membrane.
        total: usize,
    },
}

/// Refuses intrinsics that are none.
pub(super) fn check(intrinsics: &Intrinsics) -> Result<(), CloudError> {
    for (what, got) in [("fx", intrinsics.fx), ("fy", intrinsics.fy)] {
        if !(got > 0.0 && got.is_finite()) {
            return Err(CloudError::Setting { what, expected: "a finite number above 0", got });
        }
    }
    Ok(())
}
