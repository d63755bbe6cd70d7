//! How an object is palpated, and why palpation stops.

use hw_traits::ErrorKind;
use hw_traits::arm::Pose;

use crate::cloud::{CloudError, CloudSettings};
use crate::contact::ContactError;
use crate::force::ForceError;
use crate::segment::SegmentSettings;

/// Why palpation stopped. The hand stays where it was.
#[derive(Debug, thiserror::Error)]
pub enum PalpateError<E: std::fmt::Debug> {
    /// A device failed.
    #[error("{1}: {0:?}")]
    Device(E, ErrorKind),
    /// Arm or gripper did not come to rest.
    #[error("no rest after {pictures} pictures")]
    Restless {
        /// Pictures waited for.
        pictures: usize,
    },
    /// The membrane is not seen.
    #[error(transparent)]
    Cloud(CloudError),
    /// No ball is seen in it.
    #[error(transparent)]
    Contact(ContactError),
    /// The model does not know the force.
    #[error(transparent)]
    Force(ForceError),
    /// A setting out of range.
    #[error("{what} is {got}; expected {expected}")]
    Setting {
        /// Which.
        what: &'static str,
        /// What it has to be.
        expected: &'static str,
        /// What it is.
        got: f64,
    },
}

/// How to palpate.
#[derive(Debug, Clone, PartialEq)]
pub struct Programme {
    /// The tool above the object: the palpation moves along the base frame's z from here, the rest stays.
    pub above: Pose,
    /// Height of the object's top in the base frame, roughly (from a camera, within a few millimetres), m.
    pub top_m: f64,
    /// Gripper's width without stretch, m.
    pub sheet_length_m: f64,
    /// Membrane's breadth, m.
    pub sheet_breadth_m: f64,
    /// Border of the membrane that is not looked at, m.
    pub margin_m: f64,
    /// Stretches, rising, m.
    pub stretches_m: Vec<f64>,
    /// Indentation of the first touch, m.
    pub touch_m: f64,
    /// Step of the indentation, m.
    pub depth_step_m: f64,
    /// Greatest indentation, m.
    pub deepest_m: f64,
    /// Sinking at which the object has yielded, m.
    pub yield_m: f64,
    /// Pictures that are looked at at each step.
    pub pictures: usize,
    /// Speed of the gripper, m/s.
    pub gripper_m_s: f64,
    /// Time for each of the arm's moves, s.
    pub move_s: f64,
    /// Most pictures to wait for rest.
    pub patience_pictures: usize,
    /// How clouds are smoothed.
    pub cloud: CloudSettings,
    /// How they are segmented.
    pub segment: SegmentSettings,
}

impl Programme {
    /// The hand of [Matl 2021]: 100 x 90 mm, stretches to 60 mm, depths of 1 mm to 15 mm, yielded at 1.5 mm.
    pub fn matl_2021(above: Pose, top_m: f64) -> Self {
        Self {
            above,
            top_m,
            sheet_length_m: 0.1,
            sheet_breadth_m: 0.09,
            margin_m: 6e-3,
            stretches_m: (0..=6).map(|k| 0.01 * f64::from(k)).collect(),
            touch_m: 6e-3,
            depth_step_m: 1e-3,
            deepest_m: 15e-3,
            yield_m: 1.5e-3,
            pictures: 3,
            gripper_m_s: 0.05,
            move_s: 1.0,
            patience_pictures: 300,
            cloud: CloudSettings::default(),
            segment: SegmentSettings::default(),
        }
    }

    pub(super) fn check<E: std::fmt::Debug>(&self) -> Result<(), PalpateError<E>> {
        let rising = self.stretches_m.windows(2).all(|w| w[0] < w[1]);
        let first = self.stretches_m.first().copied().unwrap_or(f64::NAN);
        if !(rising && first >= 0.0) {
            return Err(PalpateError::Setting {
                what: "the first stretch",
                expected: "0 or more, then rising",
                got: first,
            });
        }
        for (what, got) in [
            ("the first touch", self.touch_m),
            ("the step", self.depth_step_m),
            ("the greatest depth less the first touch", self.deepest_m - self.touch_m),
            ("the sinking", self.yield_m),
            ("the number of pictures", self.pictures as f64),
        ] {
            if !(got > 0.0 && got.is_finite()) {
                return Err(PalpateError::Setting { what, expected: "a finite number above 0", got });
            }
        }
        Ok(())
    }
}
