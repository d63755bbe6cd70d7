//! The simulated wrist: the generic tilt programme on it and on a replay of it, and what the estimators make of what it feels.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use std::f64::consts::PI;

use hw_traits::ErrorKind;
use hw_traits::clock::Clock;
use hw_traits::force_torque::ForceTorque;
use hw_traits::programme::run;
use hw_traits::replay::{self, Replay};
use hw_traits::rotary::Rotary;
use liquid_haptics::container::{Container, Cylinder};
use liquid_haptics::fake::{AXIA80, FakeWrist, Load};
use liquid_haptics::viscosity::{Bottle, Regime, Verdict, ViscosityFit};
use liquid_haptics::volume::{ErrorCorrelation, ForceGain, Liquid, MassFit, VolumeFit, fit_mass};
use liquid_haptics::wrench::{Departures, Grasp, world_from_body};

use crate::common::wrist::{poses, programme};

const GRASP: Grasp = Grasp {
    container_mass_kg: 0.08,
    gripper_mass_kg: 0.9,
    grasp_height_m: 0.129,
    shell_center_m: 0.086,
    gravity_m_s2: 9.80665,
};

fn load(mass: f64, density: f64, viscosity: f64) -> Load {
    crate::common::wrist::load(&GRASP, [mass, mass / density, viscosity], 600)
}

#[test]
fn a_sweep_gives_mass_and_volume_back() {
    let bottle = Cylinder::new(0.035, 0.172, 0.001).unwrap();
    let (mut off, mut inside) = (Vec::new(), 0);
    for seed in 0..12 {
        let mass = 0.05 * (1 + seed) as f64;
        let mut wrist = FakeWrist::new(load(mass, 997.0, 1e-6), AXIA80, seed).unwrap();
        let poses = poses(&run(&mut wrist, &programme(4000)).unwrap());
        let fit = MassFit { gain: ForceGain::Known(0.0), offsets: false, sigma_n: None };
        let felt = fit_mass(&GRASP, &poses, &fit).unwrap();
        assert!((felt.mass_kg - mass).abs() < 4.0 * felt.error_kg.max(3e-4), "{mass}: {felt:?}");
        let fit = VolumeFit {
            container: &bottle,
            grasp: GRASP,
            departures: Departures::default(),
            liquid: Liquid::from(&felt),
            sigma_nm: None,
            error_correlation: ErrorCorrelation::NONE,
            widest_share: 0.5,
        };
        let estimate = fit.estimate(&poses).unwrap();
        let volume = mass / 997.0;
        println!(
            "{mass:.3} kg: {:+.2} g, {:+.2} ml",
            1e3 * (felt.mass_kg - mass),
            1e6 * (estimate.volume_m3 - volume)
        );
        off.push((estimate.volume_m3 - volume).abs());
        inside += usize::from((estimate.interval_m3[0]..=estimate.interval_m3[1]).contains(&volume));
    }
    off.sort_by(f64::total_cmp);
    assert!(off[off.len() / 2] < 2e-6 && inside >= 9, "{off:?} {inside}");
}

/// The same programme on what was recorded gives the very same poses.
#[test]
fn the_programme_runs_on_a_replay_of_the_fake() {
    let programme = programme(20);
    let felt = run(&mut FakeWrist::new(load(0.3, 997.0, 1e-6), AXIA80, 5).unwrap(), &programme).unwrap();
    let mut wrist = FakeWrist::new(load(0.3, 997.0, 1e-6), AXIA80, 5).unwrap();
    let mut recorded = Vec::new();
    for &angle_rad in &programme.angles_rad {
        wrist.turn_to(angle_rad, programme.rate_rad_s).unwrap();
        while !wrist.settled().unwrap() {
            wrist.sleep_s(0.01).unwrap();
        }
        wrist.sleep_s(programme.settle_s).unwrap();
        let readings = (0..20).map(|_| wrist.read().unwrap()).collect();
        recorded.push(replay::RecordedPose { angle_rad: wrist.angle_rad().unwrap().value, readings });
    }
    let replayed = run(&mut Replay::new(recorded, 1e-3), &programme).unwrap();
    assert_eq!(felt, replayed);
}

/// Swings a bottle upright and reads the torque, 100 averaged readings a second.
fn swing(load: Load, seconds: f64, seed: u64) -> (Vec<f64>, Vec<f64>, f64) {
    let mut wrist = FakeWrist::new(load, AXIA80, seed).unwrap();
    let settle = |wrist: &mut FakeWrist, angle: f64, rate: f64| {
        wrist.turn_to(angle, rate).unwrap();
        let begin = wrist.now_s().unwrap();
        while !wrist.settled().unwrap() {
            wrist.sleep_s(1e-3).unwrap();
        }
        wrist.now_s().unwrap() - begin
    };
    settle(&mut wrist, 0.5 * PI, 1.0);
    wrist.sleep_s(20.0).unwrap();
    let turn_s = settle(&mut wrist, 0.0, PI);
    let begin = wrist.now_s().unwrap();
    let (mut times, mut torques) = (Vec::new(), Vec::new());
    for _ in 0..(seconds * 100.0) as usize {
        let (mut t, mut y) = (0.0, 0.0);
        for _ in 0..78 {
            let reading = wrist.read().unwrap();
            t += (reading.t_s - begin) / 78.0;
            y += world_from_body(&reading.value, 0.0).torque_nm[2] / 78.0;
        }
        times.push(t);
        torques.push(y);
    }
    (times, torques, turn_s)
}

#[test]
fn water_oil_and_honey_have_their_viscosities() {
    let cylinder = Cylinder::new(0.035, 0.172, 0.001).unwrap();
    for (name, density, viscosity, seconds) in
        [("water", 997.0, 1e-6, 20.0), ("oil", 915.0, 7e-5, 10.0), ("honey", 1420.0, 7e-3, 20.0)]
    {
        for (seed, volume) in [(1, 292e-6), (2, 442e-6)] {
            let mass = density * volume;
            let (t, y, turn_s) = swing(load(mass, density, viscosity), seconds, seed);
            let bottle = Bottle::new(&cylinder, volume, mass, 9.80665).unwrap();
            let fit = ViscosityFit {
                bottle,
                mass_error_share: 0.0,
                head_start_s: 2.0 / PI * turn_s,
                widest_factor: 4.0,
            };
            let Verdict::Viscosity(estimate) = fit.estimate(&t, &y).unwrap() else {
                panic!("{name}: {:?}", fit.estimate(&t, &y))
            };
            println!("{name} {volume}: {:.3e} {:?}", estimate.kinematic_m2_s, estimate.interval_m2_s);
            assert_eq!(matches!(estimate.regime, Regime::Draining { .. }), name == "honey");
            assert!((estimate.kinematic_m2_s / viscosity - 1.0).abs() < 0.2, "{name}: {estimate:?}");
        }
    }
}

#[test]
fn the_contract_holds() {
    let mut wrist = FakeWrist::new(load(0.3, 997.0, 1e-6), AXIA80, 1).unwrap();
    assert_eq!(wrist.turn_to(4.0, 1.0), Err(ErrorKind::OutOfRange));
    assert_eq!(wrist.turn_to(1.0, 0.0), Err(ErrorKind::OutOfRange));
    assert_eq!(wrist.turn_to(f64::NAN, 1.0), Err(ErrorKind::OutOfRange));
    let (a, b) = (wrist.read().unwrap(), wrist.read().unwrap());
    assert!(b.t_s > a.t_s);
    wrist.tare(2000).unwrap();
    let mean = (0..2000).map(|_| wrist.read().unwrap().value.force_n[1]).sum::<f64>() / 2000.0;
    assert!(mean.abs() < 0.02, "{mean}");
    wrist.sleep_s(f64::NAN).unwrap();
    wrist.sleep_s(-1.0).unwrap();
    let before = wrist.now_s().unwrap();
    wrist.sleep_s(0.5).unwrap();
    assert!(wrist.now_s().unwrap() >= before + 0.5);
    // 60 kg are beyond the sensor's range.
    let heavy = Load { gripper_mass_kg: 60.0, ..load(0.3, 997.0, 1e-6) };
    assert_eq!(FakeWrist::new(heavy, AXIA80, 1).unwrap().read(), Err(ErrorKind::Saturated));
    assert!(FakeWrist::new(load(2.0, 997.0, 1e-6), AXIA80, 1).is_err());
    assert!(Cylinder::new(0.035, 0.172, 0.001).unwrap().capacity_m3() > 6e-4);
}
