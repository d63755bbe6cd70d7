//! The containers of [Matl 2021], section 2.6, and what fills them.

use liquid_haptics::container::Cylinder;
use liquid_haptics::fake::{Load, Round};
use liquid_haptics::wrench::Grasp;

use super::{GRAVITY, Outcome};

/// A cylindrical container with a wall, held at a part of its length.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Vessel {
    /// Outer radius and length as measured with a caliper, and the wall.
    pub(crate) radius_m: f64,
    pub(crate) length_m: f64,
    pub(crate) wall_m: f64,
    pub(crate) mass_kg: f64,
    /// Where it is held, as a part of its length.
    pub(crate) held_at: f64,
}

/// The small bottle; its wall is what [Matl 2021] later suspected.
pub(crate) const SMALL: Vessel =
    Vessel { radius_m: 0.035, length_m: 0.172, wall_m: 0.001, mass_kg: 0.085, held_at: 0.75 };
/// The larger bottle of the viscosities; its size is not stated.
pub(crate) const LARGE: Vessel =
    Vessel { radius_m: 0.05, length_m: 0.2, wall_m: 0.001, mass_kg: 0.15, held_at: 0.75 };
/// The water bottle of 48 ounces; its size is not stated, but that it holds 1.5 L.
pub(crate) const WATER_BOTTLE: Vessel =
    Vessel { radius_m: 0.046, length_m: 0.24, wall_m: 0.0015, mass_kg: 0.18, held_at: 0.75 };

impl Vessel {
    /// The container as its walls are known.
    pub(crate) fn inner(&self) -> Outcome<Cylinder> {
        Ok(Cylinder::new(self.radius_m, self.length_m, self.wall_m)?)
    }

    pub(crate) fn grasp(&self) -> Grasp {
        Grasp {
            container_mass_kg: self.mass_kg,
            gripper_mass_kg: 0.9,
            grasp_height_m: self.held_at * self.length_m,
            shell_center_m: 0.5 * self.length_m,
            gravity_m_s2: GRAVITY,
        }
    }

    /// The vessel with so much liquid of a density (kg/m3) and kinematic viscosity (m2/s) in the simulated wrist, whose forces are
    /// right.
    pub(crate) fn load(&self, volume_m3: f64, density: f64, viscosity_m2_s: f64) -> Load {
        let (radius_m, length_m) = (self.radius_m - self.wall_m, self.length_m - 2.0 * self.wall_m);
        let grasp = self.grasp();
        Load {
            cavity: Box::new(Round::new(radius_m, length_m, self.wall_m, 500)),
            radius_m,
            length_m,
            liquid_mass_kg: density * volume_m3,
            volume_m3,
            viscosity_m2_s,
            container_mass_kg: grasp.container_mass_kg,
            gripper_mass_kg: grasp.gripper_mass_kg,
            grasp_height_m: grasp.grasp_height_m,
            shell_center_m: grasp.shell_center_m,
            force_gain: 0.0,
            gravity_m_s2: GRAVITY,
        }
    }
}
