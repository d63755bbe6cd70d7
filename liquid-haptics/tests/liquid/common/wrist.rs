//! The simulated wrist's load and its slow turn.

use hw_traits::programme::{FeltPose, TiltProgramme};
use liquid_haptics::fake::{Load, Round};
use liquid_haptics::volume::SettledPose;
use liquid_haptics::wrench::{Grasp, PlanarWrench, world_from_body};

/// Liquid in a bottle of 34 mm radius and 170 mm length inside, its cavity on so many columns.
pub(crate) fn load(grasp: &Grasp, [mass, volume, viscosity]: [f64; 3], columns: usize) -> Load {
    Load {
        cavity: Box::new(Round::new(0.034, 0.170, 0.001, columns)),
        radius_m: 0.034,
        length_m: 0.170,
        liquid_mass_kg: mass,
        volume_m3: volume,
        viscosity_m2_s: viscosity,
        container_mass_kg: grasp.container_mass_kg,
        gripper_mass_kg: grasp.gripper_mass_kg,
        grasp_height_m: grasp.grasp_height_m,
        shell_center_m: grasp.shell_center_m,
        force_gain: 0.0,
        gravity_m_s2: grasp.gravity_m_s2,
    }
}

/// 19 poses, so many readings at each.
pub(crate) fn programme(readings: usize) -> TiltProgramme {
    TiltProgramme {
        angles_rad: (0..19).map(|k| f64::from(10 * k).to_radians()).collect(),
        rate_rad_s: 0.3,
        settle_s: 20.0,
        patience_s: 10.0,
        readings,
    }
}

pub(crate) fn poses(felt: &[FeltPose]) -> Vec<SettledPose> {
    let pose = |p: &FeltPose| SettledPose {
        tilt_rad: p.angle_rad,
        wrench: PlanarWrench::from(&world_from_body(&p.wrench, p.angle_rad)),
    };
    felt.iter().map(pose).collect()
}
