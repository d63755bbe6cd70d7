use std::f64::consts::PI;
use std::fmt::Write as _;
use std::path::Path;

use hw_traits::Error as _;
use hw_traits::clock::Clock;
use hw_traits::force_torque::ForceTorque;
use hw_traits::programme::{FeltPose, TiltProgramme, run};
use hw_traits::rotary::Rotary;
use liquid_haptics::container::Cylinder;
use liquid_haptics::pour::{Bead, Mouth, Pour};
use liquid_haptics::volume::{ForceGain, MassFit, SettledPose, fit_mass};
use liquid_haptics::wrench::{Grasp, PlanarWrench, world_from_body};
use missing_physics::diagnosis::Diagnosis;
use missing_physics::engine::{Options, diagnose};
use missing_physics::observer::Silent;

use super::{
    BEAD_M, BOTTLE_KG, DENSITY_KG_M3, GRASP_M, GRAVITY_M_S2, GRIPPER_KG, LENGTH_M, Outcome, RADIUS_M,
    SHELL_M, WALL_M,
};

const GRASP: Grasp = Grasp {
    container_mass_kg: BOTTLE_KG,
    gripper_mass_kg: GRIPPER_KG,
    grasp_height_m: GRASP_M,
    shell_center_m: SHELL_M,
    gravity_m_s2: GRAVITY_M_S2,
};
/// The steepest tilt of a sweep, rad: nothing leaves there.
const STEEPEST_RAD: f64 = PI / 3.0;

/// How the programme is run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// Steps of a sweep from upright to 60 degrees, and as many back.
    pub steps: u8,
    /// Readings at each.
    pub readings: usize,
    /// Fastest turn, rad/s.
    pub rate_rad_s: f64,
    /// Wait at each pose, s.
    pub settle_s: f64,
    /// What is poured, m^3.
    pub wanted_m3: f64,
}

impl Plan {
    /// Two sweeps of 25 poses, or, small, of 15 that take less.
    pub fn new(small: bool) -> Self {
        let (steps, readings, settle_s) = if small { (7, 100, 0.25) } else { (12, 250, 0.4) };
        Self { steps, readings, rate_rad_s: 1.0, settle_s, wanted_m3: 50e-6 }
    }

    fn programme(&self, angles_rad: Vec<f64>) -> TiltProgramme {
        TiltProgramme {
            angles_rad,
            rate_rad_s: self.rate_rad_s,
            settle_s: self.settle_s,
            patience_s: 20.0,
            readings: self.readings,
        }
    }
}

/// What was felt.
#[derive(Debug, Clone, PartialEq)]
pub struct Story {
    /// The sweeps before and after the pour.
    pub sweeps: [Vec<FeltPose>; 2],
    /// Volumes felt before and after, with their standard errors, m^3.
    pub volumes_m3: [[f64; 2]; 2],
    /// The tilt of the pour, rad.
    pub pour_rad: f64,
}

/// A sweep, a pour of what was wanted, and a sweep again.
///
/// # Errors
/// The rig's, in words, and of a pour that cannot be.
pub fn story<R: Rotary + ForceTorque + Clock>(rig: &mut R, plan: &Plan) -> Outcome<Story> {
    let steps = i32::from(plan.steps);
    // Up and down again: what stays is told from what grows with time.
    let tilt = |k: i32| STEEPEST_RAD * (1.0 - f64::from((k - steps).abs()) / f64::from(steps));
    let sweep = plan.programme((0..=2 * steps).map(tilt).collect());
    let mut feel = |programme: &TiltProgramme| -> Outcome<Vec<FeltPose>> {
        // Nothing moves without a fresh look.
        rig.angle_rad().map_err(|e| e.kind().to_string())?;
        Ok(run(rig, programme)?)
    };
    let first = feel(&sweep)?;
    let before = volume(&first)?;
    let cylinder = Cylinder::new(RADIUS_M + WALL_M, LENGTH_M + 2.0 * WALL_M, WALL_M)?;
    let mouth = Mouth::of_cylinder(&cylinder);
    let pour = Pour::new(&cylinder, mouth, Bead::measured(BEAD_M, BEAD_M)?, PI)?;
    let pour_rad = pour.tilt_rad(before[0], plan.wanted_m3)?;
    feel(&plan.programme(vec![pour_rad, 0.0]))?;
    let second = feel(&sweep)?;
    let after = volume(&second)?;
    Ok(Story { sweeps: [first, second], volumes_m3: [before, after], pour_rad })
}

fn settled(felt: &FeltPose) -> SettledPose {
    SettledPose {
        tilt_rad: felt.angle_rad,
        wrench: PlanarWrench::from(&world_from_body(&felt.wrench, felt.angle_rad)),
    }
}

/// What the forces say is in the bottle, and the standard error, m^3.
fn volume(felt: &[FeltPose]) -> Outcome<[f64; 2]> {
    let poses: Vec<SettledPose> = felt.iter().map(settled).collect();
    let fit = MassFit { gain: ForceGain::Known(0.0), offsets: false, sigma_n: None };
    let mass = fit_mass(&GRASP, &poses, &fit)?;
    Ok([mass.mass_kg / DENSITY_KG_M3, mass.error_kg / DENSITY_KG_M3])
}

/// Writes the sweeps as a recording of the domain `liquid-tilt`: the bottle by its inside, whose bottom is a wall's thickness up.
///
/// # Errors
/// Those of files.
pub fn recording(story: &Story, folder: &Path) -> Outcome<Diagnosed> {
    let header = format!(
        "format = 1\ndomain = \"liquid-tilt\"\ndata = \"data.csv\"\n\n[rig]\n\
         container = {{ shape = \"cylinder\", radius_m = {RADIUS_M}, length_m = {LENGTH_M} }}\n\
         container_mass_kg = {BOTTLE_KG}\ngripper_mass_kg = {GRIPPER_KG}\ngrasp_height_m = {:.6}\n\
         density_kg_m3 = {DENSITY_KG_M3}\ngravity_m_s2 = {GRAVITY_M_S2}\n",
        GRASP_M - WALL_M
    );
    let mut rows = String::from("run,theta_rad,fx_n,fy_n,tau_z_nm\n");
    for (run, sweep) in ["before", "after"].iter().zip(&story.sweeps) {
        for pose in sweep.iter().map(settled) {
            let PlanarWrench { fx_n, fy_n, tau_z_nm } = pose.wrench;
            writeln!(rows, "{run},{:.6},{fx_n:.5},{fy_n:.5},{tau_z_nm:.6}", pose.tilt_rad.clamp(0.0, PI))?;
        }
    }
    std::fs::write(folder.join("recording.toml"), header)?;
    std::fs::write(folder.join("data.csv"), rows)?;
    let (_, loaded) = missing_physics_domains::load(folder).map_err(|e| e.to_string())?;
    let options = Options { seed: 1, replicates: 499, ..Options::default() };
    let answer = diagnose(&*loaded.model, &loaded.recording, &[], &options, &Silent)?;
    Ok(Diagnosed { answer, poses: story.sweeps[0].len() })
}

/// What the tool says of it.
#[derive(Debug)]
pub struct Diagnosed {
    /// The diagnosis.
    pub answer: Diagnosis,
    poses: usize,
}

impl Diagnosed {
    /// By how much the grip slipped (m, with its 95 % interval), and at which pose of the sweep after the pour; none where the diagnosis chose no slip.
    pub fn slip(&self) -> Option<(f64, [f64; 2], usize)> {
        let chosen = |id: &str| self.answer.chosen.iter().any(|c| c == id);
        let slip = self.answer.mechanisms.iter().find(|m| m.id == "grasp-slip" && chosen(&m.id))?;
        let value = |name: &str| slip.parameters.iter().find(|p| p.name == name);
        let (by, row) = (value("slip_m")?, value("row")?);
        Some((by.value, by.ci95, (row.value.round() as usize).checked_sub(self.poses)?))
    }
}
