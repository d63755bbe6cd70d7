//! An arm that carries a tool.

use crate::ErrorType;
use crate::clock::Stamped;
use crate::forward::forward;

/// Where a tool is and how it is turned, in a frame that whoever passes it on has to name (`tool_in_world`).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "tape-file", derive(serde::Serialize, serde::Deserialize))]
pub struct Pose {
    /// Position of the tool's origin, m.
    pub position_m: [f64; 3],
    /// Unit quaternion x, y, z, w that turns the tool's axes into the frame's.
    pub rotation_xyzw: [f64; 4],
}

/// An arm that moves its tool through poses in a fixed base frame.
pub trait Arm: ErrorType {
    /// Starts to move the tool straight to a pose and returns at once; the pose is to be reached within `deadline_s` from now.
    ///
    /// * A new command replaces one that is still under way, from wherever the tool is.
    /// * A pose out of reach, a rotation that is no unit quaternion (to 1e-6), a deadline that is not above zero and anything that is no
    ///   number is an error of the kind [`OutOfRange`](crate::ErrorKind::OutOfRange); a deadline that the arm cannot keep is of
    ///   the kind [`Timeout`](crate::ErrorKind::Timeout). Nothing moves then. The pose's faults win over the deadline's.
    ///
    /// # Errors
    /// The device's error; the arm then goes on with the command before.
    fn move_to(&mut self, tool_in_base: Pose, deadline_s: f64) -> Result<(), Self::Error>;

    /// The tool's present pose in the base frame, measured and not the commanded one.
    ///
    /// # Errors
    /// The device's error.
    fn pose(&mut self) -> Result<Stamped<Pose>, Self::Error>;

    /// Whether the last command has been carried out and the tool stands still.
    ///
    /// # Errors
    /// The device's error.
    fn settled(&mut self) -> Result<bool, Self::Error>;
}

forward!(Arm {
    fn move_to(&mut self, tool_in_base: Pose, deadline_s: f64) -> Result<(), Self::Error> {
        T::move_to(self, tool_in_base, deadline_s)
    }

    fn pose(&mut self) -> Result<Stamped<Pose>, Self::Error> {
        T::pose(self)
    }

    fn settled(&mut self) -> Result<bool, Self::Error> {
        T::settled(self)
    }
});
