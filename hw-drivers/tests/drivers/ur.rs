//! Universal Robots: the contract in both versions, the dead-man's rule, and what goes wrong on a line.
#![cfg(all(feature = "ur", feature = "emulator"))]
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::time::Duration;

use hw_drivers::DriverError;
use hw_drivers::emulator::{UrEmulator, UrFaults};
use hw_drivers::ur::{Rtde, Type, UrArm, UrLimits, UrSettings, UrWrist};
use hw_traits::arm::{Arm, Pose};
use hw_traits::{Error as _, ErrorKind, conformance};

const LIMITS: UrLimits = UrLimits {
    place_m: [[-1.0, 1.0], [-1.0, 1.0], [0.0, 1.0]],
    speed_m_s: 1.0,
    speed_rad_s: 2.0,
    force_n: 50.0,
};
const SETTINGS: UrSettings =
    UrSettings { limits: LIMITS, version: None, rate_hz: 500.0, timeout_s: 0.5, patience_s: 0.15 };
const BEGIN: [f64; 6] = [0.3, 0.1, 0.4, 0.0, 0.0, 0.0];

fn arm(emulator: &UrEmulator) -> UrArm {
    UrArm::connect(emulator.address(), SETTINGS).unwrap()
}

fn pose(x: f64) -> Pose {
    Pose { position_m: [x, 0.1, 0.4], rotation_xyzw: [0.0, 0.0, 0.0, 1.0] }
}

fn sleep<D: ?Sized>(_: &mut D, duration_s: f64) {
    std::thread::sleep(Duration::from_secs_f64(duration_s));
}

#[test]
fn the_contract_holds_in_both_versions_and_in_pieces() {
    let holds = |version: Option<u16>, pieces| {
        let emulator = UrEmulator::start(BEGIN).unwrap();
        emulator.fail(UrFaults { pieces, text_every: 5, ..UrFaults::default() });
        let mut arm =
            UrArm::connect(emulator.address(), UrSettings { version, patience_s: 2.0, ..SETTINGS }).unwrap();
        assert_eq!(arm.version(), version.or(Some(2)));
        let turned = Pose { rotation_xyzw: [0.0, 0.0, 0.2f64.sin(), 0.2f64.cos()], ..pose(0.2) };
        conformance::arm(&mut arm, &[pose(0.4), turned, pose(0.3)], 0.3, 1e-6, sleep).unwrap();
        let mut wrist = UrWrist::new(arm, (-1.0, 3.0)).unwrap();
        conformance::rotary(&mut wrist, &[1.0, 2.5, -0.5, 0.0], 20.0, 1e-6, sleep).unwrap();
    };
    // An arm takes its time: all of them at once.
    std::thread::scope(|scope| {
        for (version, pieces) in [(Some(1), 0), (Some(2), 0), (None, 7)] {
            scope.spawn(move || holds(version, pieces));
        }
    });
}

#[test]
fn a_controller_that_knows_version_1_alone_is_spoken_to_in_it() {
    let emulator = UrEmulator::start(BEGIN).unwrap();
    emulator.fail(UrFaults { newest_version: 1, ..UrFaults::default() });
    assert_eq!(arm(&emulator).version(), Some(1));
    let only_2 = UrSettings { version: Some(2), ..SETTINGS };
    assert!(matches!(UrArm::connect(emulator.address(), only_2), Err(DriverError::Garbled { .. })));
}

#[test]
fn recipes_have_the_types_of_the_guide_and_unknown_fields_are_refused() {
    let emulator = UrEmulator::start(BEGIN).unwrap();
    let mut client = Rtde::connect(emulator.address(), None, 0.5).unwrap();
    assert_eq!(client.outputs(&["timestamp", "actual_q"], 100.0).unwrap(), [Type::Double, Type::Vector6d]);
    let error = client.outputs(&["timestamp", "no_such_field"], 100.0).unwrap_err();
    assert!(error.to_string().contains("NOT_FOUND"), "{error}");
    client.inputs(&["input_double_register_0"]).unwrap();
    assert_eq!(client.write(&[1.0, 2.0]).unwrap_err().kind(), ErrorKind::OutOfRange);
}

#[test]
fn no_command_without_a_fresh_reading() {
    let emulator = UrEmulator::start(BEGIN).unwrap();
    let mut arm = arm(&emulator);
    assert_eq!(arm.move_to(pose(0.4), 1.0).unwrap_err().kind(), ErrorKind::Stale);
    arm.pose().unwrap();
    std::thread::sleep(Duration::from_millis(200));
    assert_eq!(arm.move_to(pose(0.4), 1.0).unwrap_err().kind(), ErrorKind::Stale);
    // A wrong command is wrong, fresh or not.
    assert_eq!(arm.move_to(pose(4.0), 1.0).unwrap_err().kind(), ErrorKind::OutOfRange);
    assert_eq!(emulator.world().tool_in_base, BEGIN);
    arm.pose().unwrap();
    arm.move_to(pose(0.4), 1.0).unwrap();
}

#[test]
fn a_time_out_stops_and_wants_to_be_cleared() {
    let emulator = UrEmulator::start(BEGIN).unwrap();
    let mut arm = arm(&emulator);
    arm.pose().unwrap();
    arm.move_at([0.2, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
    std::thread::sleep(Duration::from_millis(400));
    let there = emulator.world();
    assert_eq!(there.speed, [0.0; 6]);
    std::thread::sleep(Duration::from_millis(50));
    assert!(
        there.tool_in_base[0] > BEGIN[0] && emulator.world().tool_in_base == there.tool_in_base,
        "{there:?}"
    );
    assert!(arm.stopped().is_some());
    assert_eq!(arm.settled().unwrap_err().kind(), ErrorKind::Stopped);
    arm.pose().unwrap();
    let error = arm.move_to(pose(0.4), 1.0).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Stopped, "{error}");
    arm.clear();
    arm.pose().unwrap();
    arm.move_to(pose(0.4), 1.0).unwrap();
}

#[test]
fn a_program_that_ends_leaves_no_arm_that_moves() {
    let emulator = UrEmulator::start(BEGIN).unwrap();
    let mut arm = arm(&emulator);
    arm.pose().unwrap();
    arm.move_at([0.0, 0.1, 0.0, 0.0, 0.0, 0.0]).unwrap();
    drop(arm);
    std::thread::sleep(Duration::from_millis(50));
    assert_eq!(emulator.world().speed, [0.0; 6]);
}

#[test]
fn limits_of_place_speed_and_force_are_kept() {
    let emulator = UrEmulator::start(BEGIN).unwrap();
    let mut arm = arm(&emulator);
    arm.pose().unwrap();
    assert_eq!(arm.move_at([1.1, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap_err().kind(), ErrorKind::OutOfRange);
    assert_eq!(arm.move_at([0.0, 0.0, 0.0, 0.0, 2.1, 0.0]).unwrap_err().kind(), ErrorKind::OutOfRange);
    assert_eq!(arm.move_at([f64::NAN; 6]).unwrap_err().kind(), ErrorKind::OutOfRange);
    assert_eq!(arm.move_to(pose(0.9), 1e-3).unwrap_err().kind(), ErrorKind::Timeout);
    // A place that is reached by a speed.
    arm.pose().unwrap();
    arm.move_at([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
    let error = (0..1000).find_map(|_| arm.pose().err()).unwrap();
    assert_eq!(error.kind(), ErrorKind::Stopped, "{error}");
    std::thread::sleep(Duration::from_millis(50));
    assert!(emulator.world().tool_in_base[0] < 1.1 && emulator.world().speed == [0.0; 6]);
    // A force.
    let emulator = UrEmulator::start(BEGIN).unwrap();
    let mut arm = self::arm(&emulator);
    arm.pose().unwrap();
    arm.move_at([0.1, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
    emulator.push([0.0, 0.0, -51.0, 0.0, 0.0, 0.0]);
    let error = (0..1000).find_map(|_| arm.pose().err()).unwrap();
    assert!(error.to_string().contains("force in N is 51"), "{error}");
    std::thread::sleep(Duration::from_millis(20));
    assert_eq!(emulator.world().speed, [0.0; 6]);
}

#[test]
fn a_line_that_is_cut_silent_or_garbled_is_said_and_comes_back() {
    let emulator = UrEmulator::start(BEGIN).unwrap();
    let mut arm = arm(&emulator);
    let mut before = arm.pose().unwrap().t_s;
    for (faults, kinds) in [
        (UrFaults { cut: true, ..UrFaults::default() }, vec![ErrorKind::Link, ErrorKind::Timeout]),
        (UrFaults { silent: true, ..UrFaults::default() }, vec![ErrorKind::Timeout]),
        (UrFaults { garble_every: 3, ..UrFaults::default() }, vec![ErrorKind::Link]),
        (UrFaults { protective_stop: true, ..UrFaults::default() }, vec![ErrorKind::Stopped]),
    ] {
        emulator.fail(faults);
        let error = (0..1000).find_map(|_| arm.pose().err()).unwrap();
        assert!(kinds.contains(&error.kind()), "{error}");
        emulator.fail(UrFaults::default());
        let after = (0..20).find_map(|_| arm.pose().ok()).unwrap().t_s;
        assert!(after > before);
        before = after;
    }
    // Packages that are lost leave gaps, no more.
    emulator.fail(UrFaults { lose_every: 2, ..UrFaults::default() });
    for _ in 0..20 {
        let after = arm.pose().unwrap().t_s;
        assert!(after > before);
        before = after;
    }
}

/// The driver is gone for good, as where its program was killed: the controller's own watch stops the arm.
#[test]
fn the_controllers_own_watch_is_told_of_a_register_that_is_written() {
    assert!(hw_drivers::ur::SCRIPT.contains("rtde_set_watchdog(\"input_int_register_0\""));
    let emulator = UrEmulator::start(BEGIN).unwrap();
    let mut client = Rtde::connect(emulator.address(), None, 0.5).unwrap();
    let fields = ["input_double_register_0", "input_int_register_1", "input_int_register_2"];
    client.inputs(&fields).unwrap();
    client.write(&[0.3, 1.0, 2.0]).unwrap();
    std::thread::sleep(Duration::from_millis(60));
    assert!(emulator.world().speed[0] > 0.0);
    std::thread::sleep(Duration::from_millis(150));
    assert!(emulator.world().watch_stopped && emulator.world().speed == [0.0; 6]);
}

/// The controller's watch wants to hear ten times a second, and a stream that nobody reads piles up.
#[test]
fn an_arm_that_rests_is_not_stopped_by_its_own_watch_and_is_then_read_as_it_is() {
    let emulator = UrEmulator::start(BEGIN).unwrap();
    let mut arm = arm(&emulator);
    for x in [0.35, 0.4] {
        let before = arm.pose().unwrap().t_s;
        arm.move_to(pose(x), 0.5).unwrap();
        while !arm.settled().unwrap() {
            sleep(&mut arm, 0.01);
        }
        sleep(&mut arm, 1.0);
        assert!(!emulator.world().watch_stopped);
        // A second of readings at 500 Hz was left out.
        let reading = arm.pose().unwrap();
        assert!(reading.t_s - before > 1.0 && (reading.value.position_m[0] - x).abs() < 1e-6, "{reading:?}");
    }
}
