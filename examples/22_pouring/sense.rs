//! What is felt before a pour: mass and volume from a slow turn of the closed vessel, the viscosity from a swing.

use std::f64::consts::PI;

use hw_traits::clock::Clock;
use hw_traits::force_torque::ForceTorque;
use hw_traits::programme::{FeltPose, TiltProgramme, run};
use hw_traits::rotary::Rotary;
use liquid_haptics::fake::{AXIA80, FakeWrist, Load, Round};
use liquid_haptics::pour::closed_loop::Inside;
use liquid_haptics::viscosity::{Bottle, Verdict, ViscosityFit};
use liquid_haptics::volume::{
    ErrorCorrelation, ForceGain, Liquid, MassFit, SettledPose, VolumeFit, fit_mass,
};
use liquid_haptics::wrench::{Departures, Grasp, PlanarWrench, world_from_body};

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
    let programme = TiltProgramme {
        angles_rad: (0..19).map(|k| f64::from(10 * k).to_radians()).collect(),
        rate_rad_s: 0.3,
        settle_s: 20.0,
        patience_s: 10.0,
        readings: 4000,
    };
    let mut wrist = FakeWrist::new(load(case), AXIA80, case.seed).map_err(|e| e.to_string())?;
    let pose = |p: &FeltPose| SettledPose {
        tilt_rad: p.angle_rad,
        wrench: PlanarWrench::from(&world_from_body(&p.wrench, p.angle_rad)),
    };
    let poses: Vec<SettledPose> = run(&mut wrist, &programme)?.iter().map(pose).collect();
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
    let mut turn = |angle: f64, rate: f64, wait_s: f64| -> Result<f64, hw_traits::ErrorKind> {
        wrist.turn_to(angle, rate)?;
        let begin = wrist.now_s()?;
        while !wrist.settled()? {
            wrist.sleep_s(1e-3)?;
        }
        let took = wrist.now_s()? - begin;
        wrist.sleep_s(wait_s)?;
        Ok(took)
    };
    turn(0.5 * PI, 1.0, 20.0).map_err(|e| e.to_string())?;
    let turn_s = turn(0.0, PI, 0.0).map_err(|e| e.to_string())?;
    let begin = wrist.now_s().map_err(|e| e.to_string())?;
    let (mut times, mut torques) = (Vec::new(), Vec::new());
    for _ in 0..2000 {
        let (mut t, mut y) = (0.0, 0.0);
        for _ in 0..78 {
            let reading = wrist.read().map_err(|e| e.to_string())?;
            t += (reading.t_s - begin) / 78.0;
            y += reading.value.torque_nm[2] / 78.0;
        }
        times.push(t);
        torques.push(y);
    }
    let bottle = Bottle::new(&case.cylinder()?, volume_m3, mass_kg, GRAVITY)?;
    let fit =
        ViscosityFit { bottle, mass_error_share: 0.002, head_start_s: 2.0 / PI * turn_s, widest_factor: 4.0 };
    Ok(match fit.estimate(&times, &torques)? {
        Verdict::Viscosity(estimate) => estimate.kinematic_m2_s,
        Verdict::Refused(_) => REFUSED_M2_S,
    })
}

/// What is taken where a swing does not tell the viscosity: it is then thick, or nothing would be refused.
pub(crate) const REFUSED_M2_S: f64 = 3e-3;
