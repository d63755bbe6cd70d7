//! The funnel that grains are poured from.

use super::{
    error::{DemError, finite, positive, within},
    wall::Shape,
};

/// A funnel: a cone that ends in its outlet below and in a tube above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Funnel {
    /// Radius of the outlet, m, positive.
    pub outlet_radius_m: f64,
    /// Half angle of the cone from the axis in rad, above 0 and below pi/2.
    pub cone_half_angle_rad: f64,
    /// Radius of the tube, m, above the outlet's.
    pub tube_radius_m: f64,
    /// Height of the outlet above z = 0, m.
    pub outlet_height_m: f64,
    /// The axis's x and y, m.
    pub axis_m: [f64; 2],
}

impl Funnel {
    /// Refuses a funnel that has no cone.
    pub fn check(&self) -> Result<(), DemError> {
        positive("outlet_radius_m", self.outlet_radius_m)?;
        positive("tube_radius_m - outlet_radius_m", self.tube_radius_m - self.outlet_radius_m)?;
        within("cone_half_angle_rad", self.cone_half_angle_rad, 0.01, 1.56)?;
        finite("axis_m and outlet_height_m", [self.axis_m[0], self.axis_m[1], self.outlet_height_m])
    }

    /// Height at which the cone becomes the tube, m.
    pub fn tube_height_m(&self) -> f64 {
        self.outlet_height_m + (self.tube_radius_m - self.outlet_radius_m) / self.cone_half_angle_rad.tan()
    }

    /// Cone and tube.
    pub fn shapes(&self) -> [Shape; 2] {
        let axis_m = self.axis_m;
        [
            Shape::Frustum {
                axis_m,
                bottom_m: self.outlet_height_m,
                bottom_radius_m: self.outlet_radius_m,
                top_radius_m: self.tube_radius_m,
                half_angle_rad: self.cone_half_angle_rad,
            },
            Shape::Tube { axis_m, radius_m: self.tube_radius_m, bottom_m: self.tube_height_m() },
        ]
    }
}
