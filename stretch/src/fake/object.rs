//! What the membrane is pressed onto.

use super::lump::Lump;

/// An object's upper side: its highest point is at height 0 on the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// A ball.
    Ball {
        /// Radius, m.
        radius_m: f64,
    },
    /// A standing cylinder: a flat round face.
    Cylinder {
        /// Radius, m.
        radius_m: f64,
    },
    /// A cone, tip up.
    Cone {
        /// Angle between side and horizontal, rad.
        angle_rad: f64,
    },
    /// A box with a level top.
    Box {
        /// Half the sides along x and y, m.
        half_m: [f64; 2],
    },
    /// Half a cylinder that lies along x.
    Ridge {
        /// Radius, m.
        radius_m: f64,
        /// Half its length, m.
        half_length_m: f64,
    },
    /// A lump of dough.
    Lump(Lump),
}

impl Shape {
    /// Height of the surface at a place off the axis, m; none where there is nothing.
    pub fn height_m(&self, x: f64, y: f64) -> Option<f64> {
        let r = x.hypot(y);
        match *self {
            Self::Ball { radius_m } => {
                (r < radius_m).then(|| (radius_m * radius_m - r * r).sqrt() - radius_m)
            }
            Self::Cylinder { radius_m } => (r <= radius_m).then_some(0.0),
            Self::Cone { angle_rad } => Some(-r * angle_rad.tan()),
            Self::Box { half_m } => (x.abs() <= half_m[0] && y.abs() <= half_m[1]).then_some(0.0),
            Self::Ridge { radius_m, half_length_m } => (x.abs() <= half_length_m && y.abs() < radius_m)
                .then(|| (radius_m * radius_m - y * y).sqrt() - radius_m),
            Self::Lump(lump) => lump.below_top_m(x, y),
        }
    }
}
