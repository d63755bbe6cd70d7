//! The bottle at the wrist: what slips is found on a simulated rig, and from the tape of it.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::time::Duration;

use examples::rig::{Addresses, Devices, Loopback, Plan, World, recording, story};
use hw_traits::clock::Clock;
use hw_traits::conformance;
use hw_traits::force_torque::ForceTorque;
use hw_traits::rotary::Rotary;
use hw_traits::tape::{Playback, Recorder, read_tape, write_event};

#[test]
fn a_concealed_slip_is_found_and_a_tape_of_the_rig_tells_the_same() {
    let plan = Plan::new(true);
    let mut world = World::new(3).unwrap();
    let mut tape = Vec::new();
    let outcome =
        story(&mut Recorder::new(&mut world, |event| write_event(&event, &mut tape).unwrap()), &plan)
            .unwrap();
    let folder = tempfile::tempdir().unwrap();
    let (by_m, [low, high], pose) = recording(&outcome, folder.path()).unwrap().slip().unwrap();
    let truth = world.truth();
    assert!(
        (by_m - truth.slip_m).abs() < 5e-4 && low < truth.slip_m && truth.slip_m < high,
        "{by_m} {truth:?}"
    );
    // The first pose beyond the tilt at which it slid.
    let sweep = &outcome.sweeps[1];
    assert!(sweep[pose].angle_rad > truth.slip_tilt_rad && sweep[pose - 1].angle_rad < truth.slip_tilt_rad);
    let poured = outcome.volumes_m3[0][0] - outcome.volumes_m3[1][0];
    assert!(
        (poured - (truth.before_m3 - truth.now_m3)).abs() < 1e-6 && (poured - 50e-6).abs() < 3e-6,
        "{poured}"
    );
    let events = read_tape(&tape[..]).unwrap().events;
    assert_eq!(story(&mut Playback::new(events, 1e-9), &plan).unwrap(), outcome);
}

#[test]
fn the_rig_keeps_its_contracts_and_so_does_it_behind_emulated_devices() {
    let mut world = World::new(1).unwrap();
    conformance::rotary(&mut world, &[0.3, 0.1], 1.0, 1e-3, |w, s| w.sleep_s(s).unwrap()).unwrap();
    conformance::clock(&mut world, 0.5).unwrap();
    world.sleep_s(5.0).unwrap();
    conformance::force_torque(&mut world, 400, 0.05).unwrap();
    let loopback = Loopback::start(1).unwrap();
    let mut devices = Devices::connect(&loopback.addresses(), false).unwrap();
    let sleep = |_: &mut Devices, s| std::thread::sleep(Duration::from_secs_f64(s));
    conformance::rotary(&mut devices, &[0.3, 0.0], 1.0, 1e-6, sleep).unwrap();
    conformance::clock(&mut devices, 0.01).unwrap();
    // The arm's own watch does not stop it while nobody asks, and old readings are left out.
    std::thread::sleep(Duration::from_millis(700));
    devices.angle_rad().unwrap();
    devices.turn_to(0.2, 1.0).unwrap();
    let begin = devices.read().unwrap().t_s;
    while !devices.settled().unwrap() {
        devices.sleep_s(0.01).unwrap();
    }
    devices.skip().unwrap();
    assert!(devices.read().unwrap().t_s - begin > 0.19);
}

#[test]
fn addresses_have_the_makers_ports_unless_others_are_given() {
    let full = Addresses::parse("ati=192.0.2.1,ur=192.0.2.2").unwrap();
    assert_eq!(full, Addresses::parse("ur=192.0.2.2:30004,ati=192.0.2.1").unwrap());
    assert_ne!(full, Addresses::parse("ur=192.0.2.2:30004,ati=192.0.2.1:49152").unwrap());
    for wrong in ["ati=192.0.2.1", "ati=nowhere,ur=192.0.2.2", "gripper=192.0.2.1", "ati"] {
        assert!(Addresses::parse(wrong).unwrap_err().to_string().contains("expected"), "{wrong}");
    }
}
