//! The rigs of all chapters, and what is recorded of them, keep the contracts of `hw-traits`.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use bounce_audio::fake::{Court, CourtSettings, FakeBall};
use bounce_audio::playback::Playback as SoundPlayback;
use bounce_audio::wav::Sound;
use dough_mbrl::fake::{DoughKind, Effects, FakeRig as DoughRig};
use granular_infer::fake::{FakeRig as PourRig, Kind};
use granular_infer::scene::{Grain, Scene};
use granular_infer::view::View;
use hw_traits::arm::Pose;
use hw_traits::clock::{Clock, Stamped, SystemClock};
use hw_traits::conformance as contract;
use hw_traits::force_torque::Wrench;
use hw_traits::microphones::Microphones;
use hw_traits::replay::{RecordedPose, Replay};
use hw_traits::tape::{Event, Playback, Recorder};
use liquid_haptics::fake::{AXIA80, FakeWrist, Load, Round};
use softcell::fake::Bench;
use stretch::fake::{Filling, Rig as Hand, Shape};

/// Runs contracts on a device, and on what was recorded of it meanwhile.
macro_rules! keeps {
    ($device:expr, |$d:ident| $contracts:expr) => {{
        let mut events: Vec<Event> = Vec::new();
        {
            let $d = &mut Recorder::new($device, |event| events.push(event));
            $contracts
        }
        let $d = &mut Playback::new(events, 1e-9);
        $contracts
    }};
}

fn at(position_m: [f64; 3]) -> Pose {
    Pose { position_m, rotation_xyzw: [0.0, 0.0, 0.0, 1.0] }
}

/// Chapter 2.
#[test]
fn a_wrist_with_a_bottle() {
    let load = Load {
        cavity: Box::new(Round::new(0.034, 0.17, 0.001, 100)),
        radius_m: 0.034,
        length_m: 0.17,
        liquid_mass_kg: 0.2,
        volume_m3: 2e-4,
        viscosity_m2_s: 1e-4,
        container_mass_kg: 0.085,
        gripper_mass_kg: 0.9,
        grasp_height_m: 0.13,
        shell_center_m: 0.086,
        force_gain: 0.0,
        gravity_m_s2: 9.80665,
    };
    keeps!(FakeWrist::new(load, AXIA80, 1).unwrap(), |d| {
        contract::rotary(d, &[0.4, 1.2, 0.0], 1.0, 1e-3, |d, s| d.sleep_s(s).unwrap()).unwrap();
        contract::clock(d, 5.0).unwrap();
        contract::force_torque(d, 1000, 0.02).unwrap();
    });
}

/// Chapter 3.
#[test]
fn a_funnel_a_gate_and_a_camera_over_cloth() {
    let grain = Grain { sliding_friction: 0.67, rolling_friction: 0.05, restitution: 0.5 };
    let kind = Kind { grain, shape: None, size_variation: 0.0, work_of_adhesion_j_m2: 0.0 };
    keeps!(PourRig::new(Scene::default(), kind, View::default(), 1), |d| {
        contract::arm(d, &[at([0.05, 0.0, 0.1]), at([0.0, 0.02, 0.2])], 1.0, 1e-9, |d, s| {
            d.sleep_s(s).unwrap()
        })
        .unwrap();
        contract::gripper(d, &[0.005, 0.0], 0.1, 1e-9, |d, s| d.sleep_s(s).unwrap()).unwrap();
        contract::depth_camera(d, 2).unwrap();
        contract::clock(d, 0.1).unwrap();
    });
}

/// Chapter 4.
#[test]
fn a_court_with_microphones_and_a_paddle_and_a_sound_that_is_played_back() {
    let court =
        Court::new(Court::living_room(0.0).unwrap(), FakeBall::new(0.8, 1e3), CourtSettings::default(), 1);
    // Time passes as it is heard.
    keeps!(court, |d| {
        contract::microphones(d, 3, 441).unwrap();
        let goals = [at([0.55, 0.35, 0.2]), at([0.55, 0.3, 0.15])];
        contract::arm(d, &goals, 1.0, 2e-3, |d, _| {
            d.read(&mut [0.0; 3 * 441]).unwrap();
        })
        .unwrap();
    });
    let wave: Vec<f64> = (0..400).map(|k| (0.1 * f64::from(k)).sin()).collect();
    let sound = Sound { rate_hz: 8000.0, channels: vec![wave.clone(), wave] };
    contract::microphones(&mut SoundPlayback::new(sound), 5, 50).unwrap();
}

/// Chapter 5.
#[test]
fn a_tip_with_a_camera_air_and_a_valve() {
    keeps!(Bench::matl_2021(1), |d| {
        contract::camera(d, 2).unwrap();
        contract::pressure(d, 5).unwrap();
        contract::valve(d, |_| ()).unwrap();
        contract::clock(d, 0.1).unwrap();
    });
}

/// Chapter 6.
#[test]
fn a_hand_with_a_membrane_and_a_camera_in_it() {
    keeps!(Hand::new(Shape::Ball { radius_m: 0.02 }, Filling::Rigid, 1), |d| {
        contract::gripper(d, &[0.12, 0.1], 0.1, 1e-9, |_, _| ()).unwrap();
        contract::arm(d, &[at([0.0, 0.0, 0.04]), at([0.01, 0.0, 0.05])], 1.0, 1e-9, |_, _| ()).unwrap();
        contract::depth_camera(d, 2).unwrap();
    });
}

/// Chapter 7.
#[test]
fn an_arm_with_a_band_and_a_camera_above_the_dough() {
    let none = Effects { drying_per_s: 0.0, slip_n: 0.0, springback: 0.0, sticking: 0.0, softening: 0.0 };
    keeps!(DoughRig::new(DoughKind::A, none, 1), |d| {
        contract::arm(d, &[at([0.3, 0.0, 0.2]), at([0.3, 0.1, 0.15])], 2.0, 1e-9, |d, s| {
            d.sleep_s(s).unwrap()
        })
        .unwrap();
        contract::gripper(d, &[0.06, 0.1], 0.05, 1e-9, |d, s| d.sleep_s(s).unwrap()).unwrap();
        contract::depth_camera(d, 2).unwrap();
        contract::clock(d, 0.1).unwrap();
    });
}

/// What `hw-traits` brings itself.
#[test]
fn a_list_of_poses_and_the_computers_clock() {
    let wrench = Wrench { force_n: [0.0, -7.0, 0.0], ..Wrench::default() };
    let readings =
        |from: f64| (0..60).map(|k| Stamped { t_s: from + 0.01 * f64::from(k), value: wrench }).collect();
    let poses = vec![
        RecordedPose { angle_rad: 0.0, readings: readings(0.0) },
        RecordedPose { angle_rad: 0.5, readings: readings(10.0) },
    ];
    let mut replay = Replay::new(poses, 1e-3);
    contract::rotary(&mut replay, &[0.0, 0.5], 1.0, 1e-9, |r, s| r.sleep_s(s).unwrap()).unwrap();
    contract::clock(&mut replay, 1.0).unwrap();
    contract::force_torque(&mut replay, 10, 1e-9).unwrap();
    contract::clock(&mut SystemClock::default(), 0.01).unwrap();
}
