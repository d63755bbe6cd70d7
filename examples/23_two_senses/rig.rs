//! A bottle in the simulated wrist, and how far the true one is from what is stated of it.

use std::f64::consts::PI;

use examples::liquid::{self, Swing as Felt};
use liquid_haptics::container::Cylinder;
use liquid_haptics::fake::{AXIA80, FakeWrist, Load, Round, Surface};
use liquid_haptics::fusion::{ForceErrors, FusionFit, PoseErrors, Prior, Swing, SwingErrors};
use liquid_haptics::volume::SettledPose;
use liquid_haptics::wrench::Grasp;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::Outcome;

/// The small bottle of [Matl 2021], gripped at half its height.
const RADIUS_M: f64 = 0.034;
const LENGTH_M: f64 = 0.170;
const WALL_M: f64 = 0.001;
const GRASP: Grasp = Grasp {
    container_mass_kg: 0.085,
    gripper_mass_kg: 0.9,
    grasp_height_m: 0.5 * LENGTH_M + WALL_M,
    shell_center_m: 0.5 * LENGTH_M + WALL_M,
    gravity_m_s2: 9.80665,
};
/// Standard deviation of what a surface, a bottom and a shoulder do to the radius that the wave has.
const WAVE_RADIUS: f64 = 0.005;

/// Name, density (kg/m^3), kinematic viscosity (m^2/s), surface tension (N/m).
pub(crate) struct Liquid {
    pub(crate) name: &'static str,
    pub(crate) density: f64,
    pub(crate) viscosity: f64,
    tension: f64,
}

const fn liquid(name: &'static str, density: f64, viscosity: f64, tension: f64) -> Liquid {
    Liquid { name, density, viscosity, tension }
}

pub(crate) const LIQUIDS: [Liquid; 5] = [
    liquid("water", 997.0, 1e-6, 0.072),
    liquid("brine", 1190.0, 1.6e-6, 0.08),
    liquid("oil", 915.0, 7e-5, 0.033),
    liquid("glycerol", 1260.0, 7.5e-4, 0.063),
    liquid("honey", 1420.0, 7e-3, 0.06),
];
/// Fills: each has its twin among them, but the half.
pub(crate) const FILLS: [f64; 5] = [0.1, 0.25, 0.5, 0.75, 0.9];

/// What the sensor is trusted with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Axes {
    /// Forces and torque.
    Six,
    /// Forces and torque, at tilts up to 30 degrees: an open vessel.
    Open,
    /// The torque about the joint alone.
    Torque,
}

pub(crate) const SENSORS: [(&str, Axes); 3] =
    [("six axes", Axes::Six), ("six axes, tilts to 30 degrees", Axes::Open), ("torque alone", Axes::Torque)];

/// One bottle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Case {
    pub(crate) liquid: usize,
    pub(crate) fill: f64,
    pub(crate) seed: u64,
    /// The wave's radius over the stated one, beside what is drawn.
    pub(crate) wider: f64,
}

/// What was felt.
pub(crate) struct Readings {
    poses: Vec<SettledPose>,
    swing: Felt,
}

impl Readings {
    /// The poses that a sensor has.
    pub(crate) fn poses(&self, axes: Axes) -> &[SettledPose] {
        if axes == Axes::Open { &self.poses[..4] } else { &self.poses }
    }

    pub(crate) fn swing(&self) -> Swing<'_> {
        let head_start_s = 2.0 / PI * self.swing.turn_s;
        Swing { t_s: &self.swing.times_s, tau_z_nm: &self.swing.torques_nm, head_start_s }
    }
}

fn pose_errors() -> PoseErrors {
    PoseErrors {
        // Steps and noise of 4000 readings.
        torque_nm: AXIA80.torque_step_nm * (13.0f64 / 12.0 / 4000.0).sqrt(),
        torque_wander_nm: AXIA80.torque_step_nm * AXIA80.wander_steps,
        torque_offset_nm: 3e-4,
        grasp_m: 3e-4,
        tilt_rad: 1e-3,
        container_kg: 3e-4,
        shell_center_m: 5e-4,
        force: Some(ForceErrors {
            noise_n: AXIA80.force_step_n * (13.0f64 / 12.0 / 4000.0).sqrt(),
            wander_n: AXIA80.force_step_n * AXIA80.wander_steps,
            offset_n: 0.02,
            gain: 1e-3,
        }),
        wander_s: AXIA80.wander_s,
        between_poses_s: 21.0,
    }
}

/// The estimator's plan.
pub(crate) fn plan(axes: Axes) -> Outcome<FusionFit> {
    let cylinder = Cylinder::new(RADIUS_M + WALL_M, LENGTH_M + 2.0 * WALL_M, WALL_M)?;
    let all = pose_errors();
    let poses = if axes == Axes::Torque { PoseErrors { force: None, ..all } } else { all };
    let reading = AXIA80.torque_step_nm * (13.0f64 / 12.0 / 78.0).sqrt();
    let wander = AXIA80.torque_step_nm * AXIA80.wander_steps;
    let swing = SwingErrors::of_sensor(reading, wander, AXIA80.wander_s, 0.02);
    Ok(FusionFit::new(cylinder, GRASP, Prior::default(), poses, swing)?)
}

impl Case {
    pub(crate) fn kind(&self) -> &'static Liquid {
        &LIQUIDS[self.liquid]
    }

    pub(crate) fn volume_m3(&self) -> f64 {
        self.fill * PI * RADIUS_M * RADIUS_M * LENGTH_M
    }

    /// The slow turn and the swing; grasp, tilt, masses, gain, offsets, surface and the wave's radius are drawn.
    pub(crate) fn feel(&self) -> Outcome<Readings> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let surface = Surface {
            tension_n_m: self.kind().tension,
            dirt: rng.random_range(0.05..0.85),
            sticking: rng.random_range(0.0..0.002),
            softening: rng.random_range(0.0..0.04),
        };
        let mut draw = |sigma: f64| sigma * Distribution::<f64>::sample(&StandardNormal, &mut rng);
        let errors = pose_errors();
        let force = errors.force.ok_or("a sensor of six axes")?;
        let load = Load {
            cavity: Box::new(Round::new(RADIUS_M, LENGTH_M, WALL_M, 500)),
            radius_m: RADIUS_M * self.wider * (1.0 + draw(WAVE_RADIUS)),
            length_m: LENGTH_M,
            liquid_mass_kg: self.kind().density * self.volume_m3(),
            volume_m3: self.volume_m3(),
            viscosity_m2_s: self.kind().viscosity,
            container_mass_kg: GRASP.container_mass_kg + draw(errors.container_kg),
            gripper_mass_kg: GRASP.gripper_mass_kg,
            grasp_height_m: GRASP.grasp_height_m + draw(errors.grasp_m),
            shell_center_m: GRASP.shell_center_m + draw(errors.shell_center_m),
            force_gain: draw(force.gain),
            gravity_m_s2: GRASP.gravity_m_s2,
        };
        let (tilt, torque) = (draw(errors.tilt_rad), draw(errors.torque_offset_nm));
        let offset = [draw(force.offset_n), draw(force.offset_n)];
        let wrist = FakeWrist::new(load, AXIA80, self.seed + 1).map_err(|e| e.to_string())?;
        let mut wrist = wrist.with_surface(surface);
        let mut poses = liquid::sweep(&mut wrist)?;
        for pose in &mut poses {
            let (sin, cos) = pose.tilt_rad.sin_cos();
            pose.wrench.fy_n += offset[1] * cos - offset[0] * sin;
            pose.wrench.tau_z_nm += torque;
            pose.tilt_rad -= tilt;
        }
        let mut swing = liquid::swing(&mut wrist).map_err(|e| e.to_string())?;
        swing.torques_nm.iter_mut().for_each(|y| *y += torque);
        Ok(Readings { poses, swing })
    }
}
