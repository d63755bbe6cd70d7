//! Settled poses, simulated by quadrature.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use liquid_haptics::container::Cylinder;
use liquid_haptics::volume::{ErrorCorrelation, Liquid, SettledPose, VolumeEstimate, VolumeFit};
use liquid_haptics::wrench::{Departures, Grasp, PlanarWrench};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::common::Cavity;

pub(crate) const CAVITY: Cavity = Cavity { radius: 0.039, length: 0.158, bottom: 0.001 };
pub(crate) const GRASP: Grasp = Grasp {
    container_mass_kg: 0.1,
    gripper_mass_kg: 0.9,
    grasp_height_m: 0.12,
    shell_center_m: 0.08,
    gravity_m_s2: 9.80665,
};
pub(crate) const SIGMA_NM: f64 = 5e-4;
pub(crate) const SIGMA_N: f64 = 0.02;
pub(crate) const NONE: Departures = Departures {
    force_gain: 0.0,
    torque_offset_nm: 0.0,
    angle_offset_rad: 0.0,
    grasp_offset_m: 0.0,
    shell_shift_m: 0.0,
    surface_lag_rad: 0.0,
};

/// Every ten degrees from upright to upside down.
pub(crate) fn tilts() -> Vec<f64> {
    (0..19).map(|k| f64::from(10 * k).to_radians()).collect()
}

/// Poses without noise: eq. 2.1 written out here, the liquid's centre of mass by quadrature (to some 1e-6 of the radius).
pub(crate) fn sweep(tilts: &[f64], mass: f64, share: f64) -> Vec<SettledPose> {
    sweep_at(tilts, mass, share, 0.12)
}

/// The same, gripped at a height (m).
pub(crate) fn sweep_at(tilts: &[f64], mass: f64, share: f64, grasp: f64) -> Vec<SettledPose> {
    let pose = |&tilt_rad: &f64| {
        let (sin, cos) = tilt_rad.sin_cos();
        let liquid = if mass > 0.0 {
            let [x, z] = CAVITY.center(tilt_rad, share * CAVITY.capacity(), 2000);
            mass * ((z - grasp) * sin + x * cos)
        } else {
            0.0
        };
        let tau_z_nm = -9.80665 * (0.1 * (0.08 - grasp) * sin + liquid);
        SettledPose { tilt_rad, wrench: PlanarWrench { fx_n: 0.0, fy_n: -9.80665 * (1.0 + mass), tau_z_nm } }
    };
    tilts.iter().map(pose).collect()
}

pub(crate) fn noisy(poses: &[SettledPose], rng: &mut ChaCha8Rng) -> Vec<SettledPose> {
    let mut draw = |sigma: f64| sigma * Distribution::<f64>::sample(&StandardNormal, rng);
    let mut out = poses.to_vec();
    for SettledPose { wrench, .. } in &mut out {
        wrench.fx_n += draw(SIGMA_N);
        wrench.fy_n += draw(SIGMA_N);
        wrench.tau_z_nm += draw(SIGMA_NM);
    }
    out
}

pub(crate) fn bottle() -> Cylinder {
    Cylinder::new(0.040, 0.160, 0.001).unwrap()
}

pub(crate) fn fit<'a>(container: &'a Cylinder, liquid: Liquid, sigma_nm: Option<f64>) -> VolumeFit<'a> {
    VolumeFit {
        container,
        grasp: GRASP,
        departures: NONE,
        liquid,
        sigma_nm,
        error_correlation: ErrorCorrelation::NONE,
        widest_share: 0.5,
    }
}

pub(crate) fn exact(mass_kg: f64) -> Liquid {
    Liquid::Mass { mass_kg, error_kg: 0.0 }
}

pub(crate) fn holds(estimate: &VolumeEstimate, truth: f64) -> bool {
    let [low, high] = estimate.interval_m3;
    low <= truth && truth <= high
}
