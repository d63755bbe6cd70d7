use super::{ForceErrors, FusionError, PoseErrors, Prior, SwingErrors};
use crate::wrench::Grasp;

/// Settings within their ranges.
pub(super) fn check(
    grasp: &Grasp,
    prior: &Prior,
    poses: &PoseErrors,
    swing: &SwingErrors,
) -> Result<(), FusionError> {
    let range = |name, got: f64, expected, fine: bool| {
        if fine { Ok(()) } else { Err(FusionError::Range { name, got, expected }) }
    };
    for (name, [low, high]) in
        [("density_kg_m3", prior.density_kg_m3), ("viscosity_m2_s", prior.viscosity_m2_s)]
    {
        range(name, low, "above 0", low > 0.0 && low.is_finite())?;
        range(name, high, "above the least", high > low && high.is_finite())?;
    }
    let above = [
        ("gravity_m_s2", grasp.gravity_m_s2),
        ("torque_nm of a pose", poses.torque_nm),
        ("wander_s of poses", poses.wander_s),
        ("noise_n", poses.force.map_or(1.0, |f| f.noise_n)),
        ("torque_nm of a reading", swing.torque_nm),
        ("wander_s of readings", swing.wander_s),
        ("torque_offset_nm of a swing", swing.torque_offset_nm),
        ("frequency", swing.frequency),
        ("ln_damping", swing.ln_damping),
    ];
    for (name, got) in above {
        range(name, got, "above 0", got > 0.0 && got.is_finite())?;
    }
    let force = |of: fn(&ForceErrors) -> f64| poses.force.as_ref().map_or(0.0, of);
    let rest = [
        ("torque_wander_nm of poses", poses.torque_wander_nm),
        ("torque_offset_nm of poses", poses.torque_offset_nm),
        ("grasp_m", poses.grasp_m),
        ("tilt_rad", poses.tilt_rad),
        ("container_kg", poses.container_kg),
        ("shell_center_m", poses.shell_center_m),
        ("between_poses_s", poses.between_poses_s),
        ("wander_n", force(|f| f.wander_n)),
        ("offset_n", force(|f| f.offset_n)),
        ("gain", force(|f| f.gain)),
        ("torque_wander_nm of a swing", swing.torque_wander_nm),
        ("tension_over_density", swing.tension_over_density[0]),
        ("tension_over_density's error", swing.tension_over_density[1]),
        ("layer", swing.layer),
        ("shape", swing.shape),
        ("film_shape", swing.film_shape),
        ("film", swing.film),
        ("ln_film_viscosity", swing.ln_film_viscosity),
        ("container_mass_kg", grasp.container_mass_kg),
        ("gripper_mass_kg", grasp.gripper_mass_kg),
    ];
    for (name, got) in rest {
        range(name, got, "0 or more", got >= 0.0 && got.is_finite())?;
    }
    Ok(())
}
