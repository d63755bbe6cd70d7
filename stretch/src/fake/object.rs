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
    /// A prism that lies along x, an edge up.
    Prism {
        /// Half its breadth, m.
        half_m: f64,
        /// Its height, m.
        height_m: f64,
        /// Half its length, m.
        half_length_m: f64,
    },
    /// A pyramid on a square, tip up.
    Pyramid {
        /// Half the square's side, m.
        half_m: f64,
        /// Its height, m.
        height_m: f64,
    },
    /// Three balls in a row along x that lie on one table, the first on the axis.
    Snowman {
        /// Radii, the largest first, m.
        radii_m: [f64; 3],
    },
    /// A wire bent to a circle about the axis.
    Hoop {
        /// Radius of the circle, m.
        radius_m: f64,
        /// Radius of the wire, m.
        wire_m: f64,
    },
    /// A wire bent to a circle that stands on edge in the plane of x and z.
    Rim {
        /// Radius of the circle, m.
        radius_m: f64,
        /// Radius of the wire, m.
        wire_m: f64,
    },
    /// A wire bent to a triangle of equal sides about the axis, one corner along x.
    Triangle {
        /// Distance of the corners from the axis, m.
        radius_m: f64,
        /// Radius of the wire, m.
        wire_m: f64,
    },
    /// A lump of dough.
    Lump(Lump),
}

/// Height of a ball's, or a lying wire's, upper side at a distance from its middle: at most 0; none beyond it.
fn round_m(radius_m: f64, away_m: f64) -> Option<f64> {
    (away_m < radius_m).then(|| (radius_m * radius_m - away_m * away_m).sqrt() - radius_m)
}

/// Distance of a place from the sides of a triangle of equal sides about the origin, one corner along x.
fn from_triangle_m(corner_m: f64, x: f64, y: f64) -> f64 {
    let side = |k: u32| {
        let [(ay, ax), (by, bx)] =
            [k, k + 1].map(|corner| (f64::from(corner) * std::f64::consts::TAU / 3.0).sin_cos());
        let [ax, ay, bx, by] = [ax, ay, bx, by].map(|at| corner_m * at);
        let (along, across) = ([bx - ax, by - ay], [x - ax, y - ay]);
        let length = along[0].hypot(along[1]);
        let part = ((across[0] * along[0] + across[1] * along[1]) / (length * length)).clamp(0.0, 1.0);
        (across[0] - part * along[0]).hypot(across[1] - part * along[1])
    };
    (0..3).map(side).fold(f64::INFINITY, f64::min)
}

impl Shape {
    /// Height of the surface at a place off the axis, m; none where there is nothing.
    pub fn height_m(&self, x: f64, y: f64) -> Option<f64> {
        let r = x.hypot(y);
        match *self {
            Self::Ball { radius_m } => round_m(radius_m, r),
            Self::Cylinder { radius_m } => (r <= radius_m).then_some(0.0),
            Self::Cone { angle_rad } => Some(-r * angle_rad.tan()),
            Self::Box { half_m } => (x.abs() <= half_m[0] && y.abs() <= half_m[1]).then_some(0.0),
            Self::Ridge { radius_m, half_length_m } => {
                (x.abs() <= half_length_m).then(|| round_m(radius_m, y.abs())).flatten()
            }
            Self::Prism { half_m, height_m, half_length_m } => {
                (x.abs() <= half_length_m && y.abs() <= half_m).then(|| -height_m * y.abs() / half_m)
            }
            Self::Pyramid { half_m, height_m } => {
                let out = x.abs().max(y.abs());
                (out <= half_m).then(|| -height_m * out / half_m)
            }
            Self::Snowman { radii_m } => {
                let mut middle_m = 0.0;
                let mut before_m = None;
                let ball = |radius_m: f64| {
                    middle_m += before_m.map_or(0.0, |before_m: f64| before_m + radius_m);
                    before_m = Some(radius_m);
                    let lower_m = 2.0 * (radii_m[0] - radius_m);
                    round_m(radius_m, (x - middle_m).hypot(y)).map(|height_m| height_m - lower_m)
                };
                radii_m.map(ball).into_iter().flatten().reduce(f64::max)
            }
            Self::Hoop { radius_m, wire_m } => round_m(wire_m, (r - radius_m).abs()),
            Self::Rim { radius_m, wire_m } => {
                let outer_m = radius_m + wire_m;
                round_m(wire_m, y.abs())
                    .and_then(|z| round_m(outer_m + z, x.abs()).map(|lower_m| z + lower_m))
            }
            Self::Triangle { radius_m, wire_m } => round_m(wire_m, from_triangle_m(radius_m, x, y)),
            Self::Lump(lump) => lump.below_top_m(x, y),
        }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    fn height_m(shape: &Shape, x: f64, y: f64) -> f64 {
        shape.height_m(x, y).unwrap_or(f64::NAN)
    }

    #[test]
    fn balls_in_a_row_touch_and_lie_on_one_table() {
        let row = Shape::Snowman { radii_m: [3.0, 2.0, 1.0] };
        for (x, top) in [(0.0, 0.0), (5.0, -2.0), (8.0, -4.0)] {
            assert_relative_eq!(height_m(&row, x, 0.0), top, epsilon = 1e-12);
        }
        assert_relative_eq!(height_m(&row, 5.0, 1.0), -2.0 + 3f64.sqrt() - 2.0, epsilon = 1e-12);
        assert!(row.height_m(3.0, 0.0).is_none() && row.height_m(9.5, 0.0).is_none());
    }

    #[test]
    fn edges_and_tips_fall_off_evenly() {
        let roof = Shape::Prism { half_m: 2.0, height_m: 3.0, half_length_m: 5.0 };
        assert_relative_eq!(height_m(&roof, -4.0, 1.0), -1.5, epsilon = 1e-12);
        let tip = Shape::Pyramid { half_m: 2.0, height_m: 3.0 };
        assert_relative_eq!(height_m(&tip, -0.5, 1.0), -1.5, epsilon = 1e-12);
        assert!(roof.height_m(5.1, 0.0).is_none() && tip.height_m(0.0, 2.1).is_none());
    }

    /// Every point of the upper side is a wire's radius from the circle.
    #[test]
    fn a_standing_circle_is_a_torus() {
        let rim = Shape::Rim { radius_m: 2.0, wire_m: 0.2 };
        for (x, y) in [(0.0, 0.0), (0.9, 0.1), (-1.7, -0.15), (2.1, 0.05)] {
            let z = height_m(&rim, x, y) + 2.2;
            assert_relative_eq!((x.hypot(z) - 2.0).hypot(y), 0.2, epsilon = 1e-12);
        }
        assert!(rim.height_m(0.0, 0.21).is_none() && rim.height_m(2.19, 0.15).is_none());
    }

    #[test]
    fn a_wire_is_highest_along_its_middle_and_hollow_within() {
        let (circle, triangle) =
            (Shape::Hoop { radius_m: 2.0, wire_m: 0.2 }, Shape::Triangle { radius_m: 2.0, wire_m: 0.2 });
        assert_relative_eq!(height_m(&circle, 0.0, -2.0), 0.0, epsilon = 1e-12);
        assert_relative_eq!(height_m(&circle, 2.12, 0.0), 0.16 - 0.2, epsilon = 1e-12);
        // A corner, and the middle of the side across.
        assert_relative_eq!(height_m(&triangle, 2.0, 0.0), 0.0, epsilon = 1e-12);
        assert_relative_eq!(height_m(&triangle, -1.12, 0.0), 0.16 - 0.2, epsilon = 1e-12);
        assert!(circle.height_m(0.0, 0.0).is_none() && triangle.height_m(0.0, 0.0).is_none());
        assert!(triangle.height_m(1.5, 1.5).is_none());
    }
}
