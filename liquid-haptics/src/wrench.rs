//! What a wrist feels of a tilted container: forces and torque in the world's frame.
//!
//! World: origin at the grasp, y up, `theta` the clockwise tilt from upright. Forces are those of the load on the sensor, so
//! weight gives `f_y < 0`, and `tau_z = x_com f_y` ([Matl 2021], eq. 2.1, sign corrected).

use hw_traits::force_torque::Wrench;

use crate::container::{Container, ContainerError, up_at_tilt};

/// Masses and lengths of a gripper that holds a container at a height along its axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grasp {
    /// Mass of the empty container, kg.
    pub container_mass_kg: f64,
    /// Mass of the gripper, its centre at the grasp, kg.
    pub gripper_mass_kg: f64,
    /// Height of the grasp above the container's outer bottom, m.
    pub grasp_height_m: f64,
    /// Height of the empty container's centre of mass above its outer bottom, m.
    pub shell_center_m: f64,
    /// Gravity, m/s^2.
    pub gravity_m_s2: f64,
}

/// What may differ from what was stated; all zero is as stated.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Departures {
    /// Relative error of the forces, which the torque does not share.
    pub force_gain: f64,
    /// Offset of the torque, N m.
    pub torque_offset_nm: f64,
    /// The container's tilt less the stated one, rad; the sensor's axes keep to the latter.
    pub angle_offset_rad: f64,
    /// True height of the grasp less the stated one, m.
    pub grasp_offset_m: f64,
    /// Shift of the empty container's centre of mass towards its top, m.
    pub shell_shift_m: f64,
    /// The surface stands as at the container's tilt less this angle, rad.
    pub surface_lag_rad: f64,
}

/// Forces (N) and torque (N m) on the sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarWrench {
    /// Force along x, N.
    pub fx_n: f64,
    /// Force along y, N.
    pub fy_n: f64,
    /// Torque about z, N m.
    pub tau_z_nm: f64,
}

/// A wrench in the world's frame from one in the frame of a sensor that turns with the container about z: y along the container's
/// axis, `tilt_rad` clockwise from upright, both origins at the grasp.
pub fn world_from_body(wrench_in_body: &Wrench, tilt_rad: f64) -> Wrench {
    let (sin, cos) = tilt_rad.sin_cos();
    let turn = |[x, y, z]: [f64; 3]| [x * cos + y * sin, y * cos - x * sin, z];
    Wrench { force_n: turn(wrench_in_body.force_n), torque_nm: turn(wrench_in_body.torque_nm) }
}

impl From<&Wrench> for PlanarWrench {
    /// The parts of a wrench in the world's frame that a turn about z moves.
    fn from(wrench_in_world: &Wrench) -> Self {
        let ([fx_n, fy_n, _], [_, _, tau_z_nm]) = (wrench_in_world.force_n, wrench_in_world.torque_nm);
        Self { fx_n, fy_n, tau_z_nm }
    }
}

impl Grasp {
    /// The wrench of a load at a tilt (rad), with a mass (kg) of liquid of the given volume (m^3) in the container.
    ///
    /// # Errors
    /// [`ContainerError`] where the volume does not fit.
    pub fn wrench(
        &self,
        container: &dyn Container,
        tilt_rad: f64,
        liquid_mass_kg: f64,
        volume_m3: f64,
        departures: &Departures,
    ) -> Result<PlanarWrench, ContainerError> {
        let tilt = tilt_rad + departures.angle_offset_rad;
        let (sin, cos) = tilt.sin_cos();
        let liquid =
            container.fill(&up_at_tilt(tilt - departures.surface_lag_rad), volume_m3)?.center_of_mass;
        let grasp = self.grasp_height_m + departures.grasp_offset_m;
        let liquid_x = (liquid.z - grasp) * sin + liquid.x * cos;
        let shell_x = (self.shell_center_m + departures.shell_shift_m - grasp) * sin;
        let weight = self.container_mass_kg + self.gripper_mass_kg + liquid_mass_kg;
        Ok(PlanarWrench {
            fx_n: 0.0,
            fy_n: -weight * self.gravity_m_s2 * (1.0 + departures.force_gain),
            tau_z_nm: -self.gravity_m_s2 * (self.container_mass_kg * shell_x + liquid_mass_kg * liquid_x)
                + departures.torque_offset_nm,
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::container::Cylinder;

    const GRASP: Grasp = Grasp {
        container_mass_kg: 0.1,
        gripper_mass_kg: 0.5,
        grasp_height_m: 0.05,
        shell_center_m: 0.08,
        gravity_m_s2: 10.0,
    };

    /// Upright nothing turns; on its side a full bottle pulls at its centre, by hand.
    #[test]
    fn upright_and_on_its_side_are_as_by_hand() {
        let bottle = Cylinder::new(0.03, 0.16, 0.0).unwrap();
        let full = bottle.capacity_m3();
        let none = Departures::default();
        let upright = GRASP.wrench(&bottle, 0.0, 0.4, 0.5 * full, &none).unwrap();
        approx::assert_relative_eq!(upright.fy_n, -10.0, max_relative = 1e-12);
        assert!(upright.tau_z_nm.abs() < 1e-15 && upright.fx_n == 0.0);
        let side = GRASP.wrench(&bottle, FRAC_PI_2, 0.4, full, &none).unwrap();
        approx::assert_relative_eq!(side.tau_z_nm, -10.0 * 0.5 * 0.03, max_relative = 1e-12);
        // A grasp 1 mm higher lifts every lever by 1 mm; the offset adds to the torque alone.
        let moved = Departures { grasp_offset_m: 0.001, torque_offset_nm: 0.02, force_gain: 0.1, ..none };
        let side = GRASP.wrench(&bottle, FRAC_PI_2, 0.4, full, &moved).unwrap();
        approx::assert_relative_eq!(side.tau_z_nm, -10.0 * 0.5 * 0.029 + 0.02, max_relative = 1e-12);
        approx::assert_relative_eq!(side.fy_n, -11.0, max_relative = 1e-12);
        assert!(GRASP.wrench(&bottle, 0.0, 0.4, 2.0 * full, &none).is_err());
    }

    /// A surface that lags behind the container stands as it did at the smaller tilt.
    #[test]
    fn a_lagging_surface_is_that_of_the_smaller_tilt() {
        let bottle = Cylinder::new(0.03, 0.16, 0.001).unwrap();
        let volume = 0.4 * bottle.capacity_m3();
        let lag = Departures { surface_lag_rad: 0.2, ..Departures::default() };
        let felt = GRASP.wrench(&bottle, 1.0, 0.2, volume, &lag).unwrap();
        let liquid = bottle.fill(&up_at_tilt(0.8), volume).unwrap().center_of_mass;
        let (sin, cos) = 1f64.sin_cos();
        let by_hand = -10.0 * (0.1 * 0.03 * sin + 0.2 * ((liquid.z - 0.05) * sin + liquid.x * cos));
        approx::assert_relative_eq!(felt.tau_z_nm, by_hand, max_relative = 1e-12);
    }
}
