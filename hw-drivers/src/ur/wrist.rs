use hw_traits::ErrorType;
use hw_traits::arm::{Arm as _, Pose};
use hw_traits::clock::Stamped;
use hw_traits::rotary::Rotary;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::arm::{UrArm, of_pose};
use crate::error::{DriverError, within};

/// An arm that turns its tool about the tool's own z axis, in one place: a wrist.
pub struct UrWrist {
    arm: UrArm,
    place_m: [f64; 3],
    zero: UnitQuaternion<f64>,
    limits_rad: (f64, f64),
}

impl UrWrist {
    /// Takes the present pose as an angle of zero; the wrist turns between `limits_rad`, within -pi to pi.
    ///
    /// # Errors
    /// [`DriverError::Limit`] for other limits; the arm's.
    pub fn new(mut arm: UrArm, limits_rad: (f64, f64)) -> Result<Self, DriverError> {
        let half = std::f64::consts::PI;
        within("smallest angle in rad", limits_rad.0, -half, half)?;
        within("largest angle in rad", limits_rad.1, limits_rad.0, half)?;
        let pose = arm.pose()?.value;
        Ok(Self { arm, place_m: pose.position_m, zero: unit(&pose), limits_rad })
    }

    /// The arm.
    pub fn arm(&mut self) -> &mut UrArm {
        &mut self.arm
    }
}

fn unit(pose: &Pose) -> UnitQuaternion<f64> {
    let [x, y, z, w] = pose.rotation_xyzw;
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

impl ErrorType for UrWrist {
    type Error = DriverError;
}

impl Rotary for UrWrist {
    fn limits_rad(&self) -> (f64, f64) {
        self.limits_rad
    }

    fn turn_to(&mut self, angle_rad: f64, rate_rad_s: f64) -> Result<(), DriverError> {
        within("angle in rad", angle_rad, self.limits_rad.0, self.limits_rad.1)?;
        within("rate in rad/s", rate_rad_s, f64::MIN_POSITIVE, f64::MAX)?;
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle_rad);
        let q = (self.zero * turn).into_inner();
        let pose = Pose { position_m: self.place_m, rotation_xyzw: [q.i, q.j, q.k, q.w] };
        let limits = self.arm.limits();
        self.arm.move_at_most(of_pose(&pose)?, limits.speed_m_s, rate_rad_s.min(limits.speed_rad_s))
    }

    fn angle_rad(&mut self) -> Result<Stamped<f64>, DriverError> {
        let pose = self.arm.pose()?;
        let turn = self.zero.inverse() * unit(&pose.value);
        let angle = 2.0 * turn.k.atan2(turn.w);
        let full = 2.0 * std::f64::consts::PI;
        let value = angle - full * (angle / full).round();
        Ok(Stamped { t_s: pose.t_s, value })
    }

    fn settled(&mut self) -> Result<bool, DriverError> {
        self.arm.settled()
    }
}
