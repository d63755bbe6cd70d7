//! Poses and a swing as one posterior, on the simulated wrist with a real surface and on readings of nothing.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use std::f64::consts::PI;

use hw_traits::clock::Clock;
use hw_traits::force_torque::ForceTorque;
use hw_traits::programme::run;
use hw_traits::rotary::Rotary;
use liquid_haptics::container::{Container, Cylinder};
use liquid_haptics::fake::{AXIA80, FakeWrist, Surface};
use liquid_haptics::fusion::{
    ForceErrors, FusionError, FusionFit, Marginal, PoseErrors, Prior, Quantity, Swing, SwingErrors,
};
use liquid_haptics::volume::SettledPose;
use liquid_haptics::wrench::Grasp;

use crate::common::wrist::{poses, programme};

const GRASP: Grasp = Grasp {
    container_mass_kg: 0.085,
    gripper_mass_kg: 0.9,
    grasp_height_m: 0.086,
    shell_center_m: 0.086,
    gravity_m_s2: 9.80665,
};
const SURFACE: Surface = Surface { tension_n_m: 0.06, dirt: 0.5, sticking: 0.001, softening: 0.02 };

fn bottle() -> Cylinder {
    Cylinder::new(0.035, 0.172, 0.001).unwrap()
}

fn pose_errors(forces: bool) -> PoseErrors {
    let force = ForceErrors { noise_n: 1.7e-3, wander_n: 2e-3, offset_n: 0.02, gain: 1e-3 };
    PoseErrors {
        torque_nm: 8.3e-5,
        torque_wander_nm: 1e-4,
        torque_offset_nm: 3e-4,
        grasp_m: 3e-4,
        tilt_rad: 1e-3,
        container_kg: 3e-4,
        shell_center_m: 5e-4,
        force: forces.then_some(force),
        wander_s: 30.0,
        between_poses_s: 21.0,
    }
}

fn plan(forces: bool) -> FusionFit {
    let swing = SwingErrors::of_sensor(5.9e-4, 1e-4, 30.0, 0.02);
    FusionFit::new(bottle(), GRASP, Prior::default(), pose_errors(forces), swing).unwrap()
}

struct Felt {
    poses: Vec<SettledPose>,
    t_s: Vec<f64>,
    tau_z_nm: Vec<f64>,
    head_start_s: f64,
}

impl Felt {
    fn swing(&self) -> Swing<'_> {
        Swing { t_s: &self.t_s, tau_z_nm: &self.tau_z_nm, head_start_s: self.head_start_s }
    }
}

/// Turns to an angle at a rate; how long that took, s.
fn turn(wrist: &mut FakeWrist, angle_rad: f64, rate_rad_s: f64) -> f64 {
    wrist.turn_to(angle_rad, rate_rad_s).unwrap();
    let begin = wrist.now_s().unwrap();
    while !wrist.settled().unwrap() {
        wrist.sleep_s(1e-3).unwrap();
    }
    wrist.now_s().unwrap() - begin
}

fn feel(fill: f64, density: f64, viscosity: f64, seed: u64) -> Felt {
    let volume = fill * bottle().capacity_m3();
    let load = crate::common::wrist::load(&GRASP, [density * volume, volume, viscosity], 500);
    let mut wrist = FakeWrist::new(load, AXIA80, seed).unwrap().with_surface(SURFACE);
    let poses = poses(&run(&mut wrist, &programme(4000)).unwrap());
    turn(&mut wrist, 0.5 * PI, 1.0);
    wrist.sleep_s(20.0).unwrap();
    let head_start_s = 2.0 / PI * turn(&mut wrist, 0.0, PI);
    let begin = wrist.now_s().unwrap();
    let (mut t_s, mut tau_z_nm) = (Vec::new(), Vec::new());
    for _ in 0..2000 {
        let (mut t, mut y) = (0.0, 0.0);
        for _ in 0..78 {
            let reading = wrist.read().unwrap();
            t += (reading.t_s - begin) / 78.0;
            y += reading.value.torque_nm[2] / 78.0;
        }
        t_s.push(t);
        tau_z_nm.push(y);
    }
    Felt { poses, t_s, tau_z_nm, head_start_s }
}

fn holds(marginal: &Marginal, truth: f64) -> bool {
    marginal.highest_density(0.95).iter().any(|p| (p[0]..=p[1]).contains(&truth))
}

fn width(marginal: &Marginal) -> f64 {
    marginal.highest_density(0.95).iter().map(|p| p[1] - p[0]).sum()
}

/// Gripped at half its height and felt by the torque alone, a tenth full pulls as nine tenths do: poses leave both, the wave's frequency one;
/// the swing alone knows the volume to a tenth of what it holds, and no density.
#[test]
fn the_wave_tells_twins_apart() {
    let (fit, volume) = (plan(false), 0.1 * bottle().capacity_m3());
    let felt = feel(0.1, 997.0, 1e-6, 3);
    let motion = fit.motion(&felt.swing()).unwrap();
    let by_poses = fit.posterior(Some(&felt.poses), None).unwrap();
    let pieces = by_poses.volume_m3().highest_density(0.95);
    assert_eq!(pieces.len(), 2, "{pieces:?}");
    assert!(pieces[0][0] < volume && volume < pieces[0][1] && pieces[1][0] > 5.0 * volume);
    let low = by_poses.volume_m3().between(0.0, 5.0 * volume);
    assert!((0.1..0.9).contains(&low), "{low}");
    assert!(holds(&by_poses.density_kg_m3(), 997.0));
    let by_swing = fit.posterior(None, Some(&motion)).unwrap();
    assert!(holds(&by_swing.volume_m3(), volume) && width(&by_swing.volume_m3()) < 0.2 * volume);
    assert!(width(&by_swing.density_kg_m3()) > 1200.0);
    let both = fit.posterior(Some(&felt.poses), Some(&motion)).unwrap();
    assert_eq!(both.volume_m3().highest_density(0.95).len(), 1);
    assert!(holds(&both.volume_m3(), volume) && holds(&both.viscosity_m2_s(), 1e-6));
    assert!(holds(&both.dynamic_viscosity_pa_s(), 0.997e-3));
    assert!(width(&both.volume_m3()) < 0.05 * volume && width(&both.viscosity_m2_s()) < 4e-6);
    assert!(fit.frequency_p(&by_poses, &motion).unwrap() > 0.01);
    assert!(both.swing_p().unwrap() > 1e-3 && both.poses_p().unwrap() > 1e-3);
}

/// A drain is weighed: honey has its density and volume from the swing too, and what draws the film out makes the liquid thick. No wave
/// contradicts the poses, since none stands out.
#[test]
fn a_drain_is_weighed() {
    let (fit, volume) = (plan(false), 0.25 * bottle().capacity_m3());
    let felt = feel(0.25, 1420.0, 7e-3, 4);
    let motion = fit.motion(&felt.swing()).unwrap();
    let by_swing = fit.posterior(None, Some(&motion)).unwrap();
    let volumes = by_swing.volume_m3();
    assert!(
        holds(&volumes, volume) && width(&volumes) < 0.5 * bottle().capacity_m3(),
        "{:?}",
        volumes.highest_density(0.95)
    );
    assert!(holds(&by_swing.viscosity_m2_s(), 7e-3) && holds(&by_swing.density_kg_m3(), 1420.0));
    let tied = by_swing.correlation(Quantity::Volume, Quantity::Density);
    assert!(tied < -0.2, "{tied}");
    let by_poses = fit.posterior(Some(&felt.poses), None).unwrap();
    assert_eq!(by_poses.volume_m3().highest_density(0.95).len(), 2);
    let both = fit.posterior(Some(&felt.poses), Some(&motion)).unwrap();
    assert_eq!(both.volume_m3().highest_density(0.95).len(), 1);
    assert!(holds(&both.volume_m3(), volume) && holds(&both.density_kg_m3(), 1420.0));
    assert!(holds(&both.viscosity_m2_s(), 7e-3) && width(&both.viscosity_m2_s()) < 6e-3);
    assert_eq!(fit.frequency_p(&by_poses, &motion), None);
    approx::assert_relative_eq!(
        by_poses.correlation(Quantity::Density, Quantity::Density),
        1.0,
        max_relative = 1e-9
    );
}

/// Half full the liquid is deep: the wave knows next to nothing of the volume, and the poses all of it.
#[test]
fn a_deep_wave_says_nothing_of_the_volume() {
    let (fit, volume) = (plan(true), 0.5 * bottle().capacity_m3());
    let felt = feel(0.5, 915.0, 7e-5, 5);
    let motion = fit.motion(&felt.swing()).unwrap();
    let by_swing = fit.posterior(None, Some(&motion)).unwrap();
    assert!(width(&by_swing.volume_m3()) > 0.5 * bottle().capacity_m3());
    let by_poses = fit.posterior(Some(&felt.poses), None).unwrap();
    let both = fit.posterior(Some(&felt.poses), Some(&motion)).unwrap();
    let [poses, both_] = [&by_poses, &both].map(|p| width(&p.volume_m3()));
    assert!((both_ / poses - 1.0).abs() < 0.1 && holds(&both.volume_m3(), volume), "{both_} {poses}");
    assert!(holds(&both.viscosity_m2_s(), 7e-5) && holds(&both.density_kg_m3(), 915.0));
    // What the poses leave of the viscosity is the prior.
    let [low, high] = by_poses.viscosity_m2_s().highest_density(0.95)[0];
    assert!((high / low).ln() > 0.9 * (0.1f64 / 3e-7).ln());
}

/// Readings of noise alone leave the viscosity open over decades, and the volume too; no wave stands out.
#[test]
fn noise_leaves_all_open() {
    let fit = plan(true);
    let t_s: Vec<f64> = (0..2000).map(|i| 0.01 * f64::from(i)).collect();
    let mut state = 1u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        5.9e-4 * ((state >> 11) as f64 / (1u64 << 53) as f64 - 0.5) * 12f64.sqrt()
    };
    let tau_z_nm: Vec<f64> = t_s.iter().map(|_| noise()).collect();
    let motion = fit.motion(&Swing { t_s: &t_s, tau_z_nm: &tau_z_nm, head_start_s: 0.3 }).unwrap();
    assert!(!motion.swings());
    let by_swing = fit.posterior(None, Some(&motion)).unwrap();
    assert!(width(&by_swing.volume_m3()) > 0.3 * bottle().capacity_m3());
    let viscosity = by_swing.viscosity_m2_s();
    let decades: f64 = viscosity.highest_density(0.95).iter().map(|p| (p[1] / p[0]).log10()).sum();
    assert!(decades > 3.0, "{decades}");
    assert!(by_swing.swing_p().unwrap() > 1e-3);
}

/// Without liquid the poses leave a drop at most, of any density; a bottle that is no such bottle is a misfit.
#[test]
fn an_empty_bottle_and_another_one() {
    let fit = plan(true);
    let felt = feel(0.0, 997.0, 1e-6, 6);
    let empty = fit.posterior(Some(&felt.poses), None).unwrap();
    let capacity = bottle().capacity_m3();
    assert!(empty.volume_m3().quantile(0.95) < 0.01 * capacity, "{}", empty.volume_m3().quantile(0.95));
    assert!(width(&empty.density_kg_m3()) > 1000.0);
    assert!(empty.poses_p().unwrap() > 1e-3);
    let mut poses = feel(0.3, 997.0, 1e-6, 7).poses;
    assert!(fit.posterior(Some(&poses), None).unwrap().poses_p().unwrap() > 1e-3);
    // A tenth of a newton metre that goes with twice the tilt is no liquid.
    for pose in &mut poses {
        pose.wrench.tau_z_nm += 0.01 * (4.0 * pose.tilt_rad).sin();
    }
    assert!(fit.posterior(Some(&poses), None).unwrap().poses_p().unwrap() < 1e-6);
}

/// A wave a tenth slower than any volume that the poses allow contradicts them; something else that moves is no wave.
#[test]
fn contradictions_are_said() {
    let fit = plan(true);
    let felt = feel(0.4, 997.0, 1e-6, 8);
    let by_poses = fit.posterior(Some(&felt.poses), None).unwrap();
    let slower: Vec<f64> = felt.t_s.iter().map(|t| 1.1 * t).collect();
    let [as_it_was, slowed] = [&felt.t_s, &slower].map(|t_s| {
        let motion = fit.motion(&Swing { t_s, ..felt.swing() }).unwrap();
        fit.frequency_p(&by_poses, &motion).unwrap()
    });
    assert!(as_it_was > 0.01 && slowed < 1e-6, "{as_it_was} {slowed}");
    let steps =
        felt.t_s.iter().zip(&felt.tau_z_nm).map(|(t, y)| y + if (t % 5.0) < 2.5 { 0.01 } else { 0.0 });
    let tau_z_nm: Vec<f64> = steps.collect();
    let motion = fit.motion(&Swing { tau_z_nm: &tau_z_nm, ..felt.swing() }).unwrap();
    let stepped = fit.posterior(Some(&felt.poses), Some(&motion)).unwrap();
    assert!(stepped.swing_p().unwrap() < 1e-6, "{:?}", stepped.swing_p());
}

/// Neither sense is the prior; settings and readings that are none are refused by name.
#[test]
fn what_is_no_reading_is_refused() {
    let fit = plan(true);
    let prior = fit.posterior(None, None).unwrap();
    approx::assert_relative_eq!(
        prior.volume_m3().median(),
        0.5 * bottle().capacity_m3(),
        max_relative = 1e-6
    );
    approx::assert_relative_eq!(
        prior.density_kg_m3().median(),
        f64::sqrt(600.0 * 2000.0),
        max_relative = 1e-3
    );
    let t_s: Vec<f64> = (0..500).map(|i| 0.01 * f64::from(i)).collect();
    let still = vec![0.0; 500];
    let refused = |t_s: &[f64], tau_z_nm: &[f64], head_start_s: f64| {
        fit.motion(&Swing { t_s, tau_z_nm, head_start_s }).unwrap_err()
    };
    assert!(matches!(refused(&t_s, &still[1..], 0.3), FusionError::Lengths { times: 500, torques: 499 }));
    assert!(matches!(refused(&t_s[..5], &still[..5], 0.3), FusionError::TooFew { got: 5, .. }));
    assert!(matches!(refused(&t_s[..50], &still[..50], 0.3), FusionError::TooShort { .. }));
    assert!(matches!(refused(&t_s, &still, -1.0), FusionError::Range { name: "head_start_s", .. }));
    let mut bad = still.clone();
    bad[7] = f64::NAN;
    assert!(matches!(refused(&t_s, &bad, 0.3), FusionError::Value { what: "torque", index: 7, .. }));
    let mut back = t_s.clone();
    back[9] = 0.0;
    assert!(matches!(refused(&back, &still, 0.3), FusionError::Value { what: "time", index: 9, .. }));
    assert!(matches!(fit.posterior(Some(&[]), None), Err(FusionError::TooFew { what: "poses", .. })));
    let errors = SwingErrors { torque_nm: 0.0, ..SwingErrors::of_sensor(5.9e-4, 1e-4, 30.0, 0.02) };
    let prior = Prior { density_kg_m3: [900.0, 800.0], ..Prior::default() };
    for (prior, errors) in
        [(Prior::default(), errors), (prior, SwingErrors::of_sensor(5.9e-4, 1e-4, 30.0, 0.02))]
    {
        let made = FusionFit::new(bottle(), GRASP, prior, pose_errors(true), errors);
        assert!(matches!(made, Err(FusionError::Range { .. })));
    }
}
