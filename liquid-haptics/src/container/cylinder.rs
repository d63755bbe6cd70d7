//! The circular cylinder, in closed form.

use nalgebra::{UnitVector3, Vector3};

use super::wedge::Tilted;
use super::{Container, ContainerError, Fill};

/// A closed circular cylinder with walls of one thickness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder {
    radius_m: f64,
    length_m: f64,
    wall_m: f64,
}

impl Cylinder {
    /// A cylinder of outer radius and length, and the thickness of wall, base and lid (all m): its cavity has the radius
    /// `radius_m - wall_m` and reaches from `z = wall_m` to `length_m - wall_m`.
    ///
    /// # Errors
    /// [`ContainerError::Dimension`].
    pub fn new(radius_m: f64, length_m: f64, wall_m: f64) -> Result<Self, ContainerError> {
        for (name, got) in [("radius_m", radius_m), ("length_m", length_m)] {
            if !(got > 0.0 && got.is_finite()) {
                return Err(ContainerError::Dimension { name, got, expected: "above 0" });
            }
        }
        if !(wall_m >= 0.0 && wall_m < radius_m && 2.0 * wall_m < length_m) {
            return Err(ContainerError::Dimension {
                name: "wall_m",
                got: wall_m,
                expected: "0 or more, below the radius and half the length",
            });
        }
        Ok(Self { radius_m, length_m, wall_m })
    }

    /// Radius of the cavity, m.
    pub fn inner_radius_m(&self) -> f64 {
        self.radius_m - self.wall_m
    }

    /// Length of the cavity, m.
    pub fn inner_length_m(&self) -> f64 {
        self.length_m - 2.0 * self.wall_m
    }

    /// Thickness of wall, base and lid, m.
    pub fn wall_m(&self) -> f64 {
        self.wall_m
    }

    /// Liquid in the cavity at a tilt of sine and cosine, the former not negative: where the centre of mass lies sideways
    /// (towards the lower wall) and along the axis from the cavity's bottom, and the surface's height above the point of the
    /// axis at that bottom. All in m.
    fn settle(&self, sin: f64, cos: f64, volume_m3: f64) -> (f64, f64, f64) {
        let (radius, length) = (self.inner_radius_m(), self.inner_length_m());
        let capacity = self.capacity_m3();
        if cos < 0.0 {
            // Turned over: the lid is the bottom.
            let (x, z, height) = self.settle(sin, -cos, volume_m3);
            return (x, length - z, height + length * cos);
        }
        if volume_m3 > 0.5 * capacity {
            // The air above is the mirror image of as much liquid below.
            let air = capacity - volume_m3;
            let (x, z, height) = self.settle(sin, cos, air);
            let share = air / volume_m3;
            return (share * x, 0.5 * length + share * (z - 0.5 * length), length * cos - height);
        }
        let area = std::f64::consts::PI * radius * radius;
        let depth = volume_m3 / area;
        if depth * cos >= radius * sin {
            let slope = sin / cos;
            if depth == 0.0 {
                return (0.0, 0.0, 0.0);
            }
            let sideways = 0.25 * radius * radius * slope / depth;
            return (sideways, 0.5 * (depth + slope * sideways), depth * cos);
        }
        if volume_m3 == 0.0 {
            return (radius, if cos == 0.0 { 0.5 * length } else { 0.0 }, -radius * sin);
        }
        let tilted = Tilted::new(length / radius, sin, cos);
        let delta = tilted.delta_of(volume_m3 / radius.powi(3));
        let center = tilted.center(delta);
        (radius * (1.0 - center.from_wall), radius * center.from_bottom, -radius * sin * (1.0 - delta))
    }

    /// Volume below a height above the point of the axis at the cavity's bottom.
    fn below(&self, sin: f64, cos: f64, height_m: f64) -> f64 {
        let (radius, length) = (self.inner_radius_m(), self.inner_length_m());
        let capacity = self.capacity_m3();
        if cos < 0.0 {
            return self.below(sin, -cos, height_m - length * cos);
        }
        if height_m > 0.5 * length * cos {
            return capacity - self.below(sin, cos, length * cos - height_m);
        }
        let above_lowest = height_m + radius * sin;
        if above_lowest <= 0.0 {
            return 0.0;
        }
        if height_m >= radius * sin {
            return (std::f64::consts::PI * radius * radius * height_m / cos).min(capacity);
        }
        let delta = above_lowest / (radius * sin);
        radius.powi(3) * Tilted::new(length / radius, sin, cos).volume(delta)[0]
    }
}

impl Container for Cylinder {
    fn capacity_m3(&self) -> f64 {
        let radius = self.inner_radius_m();
        std::f64::consts::PI * radius * radius * self.inner_length_m()
    }

    fn fill(&self, up: &UnitVector3<f64>, volume_m3: f64) -> Result<Fill, ContainerError> {
        let capacity_m3 = self.capacity_m3();
        if !(volume_m3 >= 0.0 && volume_m3 <= capacity_m3 * (1.0 + 1e-12)) {
            return Err(ContainerError::Volume { got_m3: volume_m3, capacity_m3 });
        }
        let sin = (up.x * up.x + up.y * up.y).sqrt();
        let (sideways, along, height) = self.settle(sin, up.z, volume_m3.min(capacity_m3));
        // The lower side is where up does not point.
        let (lower_x, lower_y) = if sin > 0.0 { (-up.x / sin, -up.y / sin) } else { (1.0, 0.0) };
        Ok(Fill {
            volume_m3,
            surface_height_m: height + self.wall_m * up.z,
            center_of_mass: Vector3::new(sideways * lower_x, sideways * lower_y, along + self.wall_m),
        })
    }

    fn volume_below(&self, up: &UnitVector3<f64>, height_m: f64) -> Result<f64, ContainerError> {
        if height_m.is_nan() {
            return Err(ContainerError::Dimension { name: "height_m", got: height_m, expected: "a number" });
        }
        Ok(self.below(up.x.hypot(up.y), up.z, height_m - self.wall_m * up.z))
    }
}
