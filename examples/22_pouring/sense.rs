//! What is felt before a pour: mass and volume from a slow turn of the closed vessel, the viscosity from a swing.

use std::f64::consts::PI;

use examples::liquid::{self, Swing};
use liquid_haptics::fake::{AXIA80, FakeWrist, Load, Round};
use liquid_haptics::pour::closed_loop::Inside;
use liquid_haptics::viscosity::{Bottle, Verdict, ViscosityFit};
use liquid_haptics::volume::{ErrorCorrelation, ForceGain, Liquid, MassFit, VolumeFit, fit_mass};
use liquid_haptics::wrench::{Departures, Grasp};

use crate::Outcome;
use crate::rig::{Case, GAIN, GRAVITY, WALL_M};

fn load(case: &Case) -> Load {
    let bottle = &case.truth;
    Load {
        cavity: Box::new(Round::new(bottle.radius_m, bottle.length_m, WALL_M, 500)),
        radius_m: bottle.radius_m,
        length_m: bottle.length_m,
        liquid_mass_kg: bottle.volume_m3 * bottle.density_kg_m3,
        volume_m3: bottle.volume_m3,
        viscosity_m2_s: bottle.viscosity_m2_s,
        container_mass_kg: bottle.container_mass_kg,
        gripper_mass_kg: bottle.gripper_mass_kg,
        grasp_height_m: bottle.grasp_height_m,
        shell_center_m: bottle.shell_center_m,
        force_gain: case.disturbances.force_gain,
        gravity_m_s2: GRAVITY,
    }
}

/// Volume, density and viscosity, as they were felt.
pub(crate) fn felt(case: &Case) -> Outcome<Inside> {
    let bottle = &case.stated;
    let cylinder = case.cylinder()?;
    let grasp = Grasp {
        container_mass_kg: bottle.container_mass_kg,
        gripper_mass_kg: bottle.gripper_mass_kg,
        grasp_height_m: bottle.grasp_height_m,
        shell_center_m: bottle.shell_center_m,
        gravity_m_s2: GRAVITY,
    };
    let mut wrist = FakeWrist::new(load(case), AXIA80, case.seed).map_err(|e| e.to_string())?;
    let poses = liquid::sweep(&mut wrist)?;
    let mass =
        fit_mass(&grasp, &poses, &MassFit { gain: ForceGain::Known(0.0), offsets: false, sigma_n: None })?;
    let fit = VolumeFit {
        container: &cylinder,
        grasp,
        departures: Departures::default(),
        liquid: Liquid::from(&mass),
        sigma_nm: None,
        error_correlation: ErrorCorrelation::NONE,
        widest_share: 0.5,
    };
    let volume = fit.estimate(&poses)?;
    let whole = mass.mass_kg + grasp.container_mass_kg + grasp.gripper_mass_kg;
    let mass_share = mass.error_kg.hypot(GAIN * whole) / mass.mass_kg;
    let volume_share = (volume.interval_m3[1] - volume.interval_m3[0]) / 3.92 / volume.volume_m3;
    Ok(Inside {
        volume_m3: volume.volume_m3,
        density_kg_m3: mass.mass_kg / volume.volume_m3,
        density_error_share: mass_share.hypot(volume_share),
        viscosity_m2_s: viscosity(case, volume.volume_m3, mass.mass_kg)?,
    })
}

/// The viscosity that a swing from the side to upright shows (m^2/s), or a middling one where it is refused.
fn viscosity(case: &Case, volume_m3: f64, mass_kg: f64) -> Outcome<f64> {
    let mut wrist = FakeWrist::new(load(case), AXIA80, case.seed + 1).map_err(|e| e.to_string())?;
    let Swing { turn_s, times_s, torques_nm } = liquid::swing(&mut wrist).map_err(|e| e.to_string())?;
    let bottle = Bottle::new(&case.cylinder()?, volume_m3, mass_kg, GRAVITY)?;
    let fit =
        ViscosityFit { bottle, mass_error_share: 0.002, head_start_s: 2.0 / PI * turn_s, widest_factor: 4.0 };
    Ok(match fit.estimate(&times_s, &torques_nm)? {
        Verdict::Viscosity(estimate) => estimate.kinematic_m2_s,
        Verdict::Refused(_) => REFUSED_M2_S,
    })
}

/// What is taken where a swing does not tell the viscosity: it is then thick, or nothing would be refused.
pub(crate) const REFUSED_M2_S: f64 = 3e-3;
