//! The contracts, on a recording.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use hw_traits::ErrorKind;
use hw_traits::clock::{Clock, Stamped, SystemClock};
use hw_traits::force_torque::{ForceTorque, Wrench};
use hw_traits::programme::{TiltProgramme, run};
use hw_traits::replay::{RecordedPose, Replay};
use hw_traits::rotary::Rotary;

fn rig() -> Replay {
    let pose = |angle_rad: f64, t: f64| RecordedPose {
        angle_rad,
        readings: (0..4)
            .map(|i| Stamped {
                t_s: t + f64::from(i),
                value: Wrench { force_n: [angle_rad, -1.0, f64::from(i)], torque_nm: [0.0; 3] },
            })
            .collect(),
    };
    Replay::new(vec![pose(0.0, 10.0), pose(0.5, 20.0), pose(1.0, 30.0)], 0.01)
}

#[test]
fn commands_come_in_the_recorded_order_or_are_refused() {
    let mut rig = rig();
    assert_eq!(rig.turn_to(0.5, 1.0), Err(ErrorKind::NotAsRecorded));
    assert_eq!(rig.turn_to(0.0, 0.0), Err(ErrorKind::OutOfRange));
    assert_eq!(rig.turn_to(f64::NAN, 1.0), Err(ErrorKind::OutOfRange));
    assert_eq!(rig.turn_to(5.0, 1.0), Err(ErrorKind::OutOfRange));
    rig.turn_to(0.005, 1.0).unwrap();
    rig.turn_to(0.5, 1.0).unwrap();
    rig.turn_to(1.0, 1.0).unwrap();
    assert_eq!(rig.turn_to(1.0, 1.0), Err(ErrorKind::EndOfRecording));
    assert_eq!(rig.angle_rad().unwrap().value, 1.0);
    rig.rewind();
    rig.turn_to(0.0, 1.0).unwrap();
}

#[test]
fn each_reading_comes_once_and_time_never_falls() {
    let mut rig = rig();
    rig.turn_to(0.0, 1.0).unwrap();
    let mut before = f64::NEG_INFINITY;
    for i in 0..4 {
        let reading = rig.read().unwrap();
        assert_eq!(reading.value.force_n[2], f64::from(i));
        assert!(reading.t_s > before && rig.now_s().unwrap() >= reading.t_s);
        before = reading.t_s;
    }
    assert_eq!(rig.read().map(|r| r.t_s), Err(ErrorKind::EndOfRecording));
    rig.sleep_s(-1.0).unwrap();
    rig.sleep_s(f64::NAN).unwrap();
    assert_eq!(rig.now_s().unwrap(), 13.0);
}

#[test]
fn tare_subtracts_a_mean_and_keeps_the_old_one_on_failure() {
    let mut rig = rig();
    rig.turn_to(0.0, 1.0).unwrap();
    rig.tare(2).unwrap();
    assert_eq!(rig.read().unwrap().value.components(), [0.0, 0.0, 1.5, 0.0, 0.0, 0.0]);
    assert_eq!(rig.tare(5), Err(ErrorKind::EndOfRecording));
    rig.turn_to(0.5, 1.0).unwrap();
    assert_eq!(rig.read().unwrap().value.components(), [0.5, 0.0, -0.5, 0.0, 0.0, 0.0]);
}

#[test]
fn a_programme_says_where_it_ended_and_keeps_what_it_felt() {
    let programme = TiltProgramme {
        angles_rad: vec![0.0, 0.5, 0.7],
        rate_rad_s: 1.0,
        settle_s: 0.1,
        patience_s: 1.0,
        readings: 4,
    };
    // By reference: a driver may borrow its rig.
    let mut rig = rig();
    let error = run(&mut &mut rig, &programme).unwrap_err();
    assert_eq!((error.pose, error.kind, error.felt.len()), (2, ErrorKind::NotAsRecorded, 2));
    assert_eq!(error.felt[1].wrench.force_n, [0.5, -1.0, 1.5]);
    assert!((error.felt[1].standard_error[2] - (5.0f64 / 3.0 / 4.0).sqrt()).abs() < 1e-12);
    assert!(error.to_string().contains("pose 2 at 0.7 rad"));
}

#[test]
fn the_computers_clock_keeps_its_promise() {
    let mut clock = SystemClock::default();
    let before = clock.now_s().unwrap();
    clock.sleep_s(0.01).unwrap();
    clock.sleep_s(f64::INFINITY.min(-1.0)).unwrap();
    assert!(clock.now_s().unwrap() - before >= 0.01);
}
