//! Cameras: grey pictures and depth pictures.

use crate::ErrorType;
use crate::clock::Stamped;
use crate::forward::forward;
use crate::picture::{Intrinsics, Picture};

/// A camera that sees brightness.
pub trait Camera: ErrorType {
    /// Waits for the next picture and returns it, 8-bit grey.
    ///
    /// * Each picture is returned once; times (the middle of the exposure) rise strictly. Pictures that were lost in between
    ///   leave a gap.
    /// * Size is the same from picture to picture.
    ///
    /// # Errors
    /// The device's error; the next call tries again.
    fn picture(&mut self) -> Result<Stamped<Picture<u8>>, Self::Error>;
}

/// A camera that sees distance.
pub trait DepthCamera: ErrorType {
    /// The pinhole that belongs to the pictures, lens distortion already removed.
    fn intrinsics(&self) -> Intrinsics;

    /// Waits for the next picture and returns it: depth along the optical axis in m.
    ///
    /// * As [`Camera::picture`].
    /// * A pixel that saw nothing is NaN, never zero; values are otherwise above zero and finite.
    ///
    /// # Errors
    /// The device's error; the next call tries again.
    fn depth_m(&mut self) -> Result<Stamped<Picture<f32>>, Self::Error>;
}

forward!(Camera {
    fn picture(&mut self) -> Result<Stamped<Picture<u8>>, Self::Error> {
        T::picture(self)
    }
});

forward!(DepthCamera {
    fn intrinsics(&self) -> Intrinsics {
        T::intrinsics(self)
    }

    fn depth_m(&mut self) -> Result<Stamped<Picture<f32>>, Self::Error> {
        T::depth_m(self)
    }
});
