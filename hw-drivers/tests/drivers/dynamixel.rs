//! Dynamixel servos: contract, dead-man's rule, the servo's own watch, and what goes wrong on a line.
#![cfg(all(feature = "dynamixel", feature = "emulator"))]
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::time::Duration;

use hw_drivers::dynamixel::{Bus, Mode, Servo, ServoCommand, ServoSettings};
use hw_drivers::emulator::{DynamixelEmulator, DynamixelFaults};
use hw_drivers::line::tcp;
use hw_traits::rotary::Rotary;
use hw_traits::{Error as _, ErrorKind, conformance};

const SETTINGS: ServoSettings = ServoSettings {
    id: 1,
    mode: Mode::Position,
    limits_rad: (-1.5, 1.5),
    speed_rad_s: 5.0,
    current_a: 1.0,
    current_unit_a: 0.00269,
    tolerance_rad: 2e-3,
    patience_s: 0.2,
};

fn bus(emulator: &DynamixelEmulator) -> Bus {
    Bus::new("on loopback", tcp(emulator.address(), 0.1), 0.1).unwrap()
}

fn servo(emulator: &DynamixelEmulator, mode: Mode) -> Servo {
    Servo::new(bus(emulator), ServoSettings { mode, ..SETTINGS }).unwrap()
}

#[test]
fn the_contract_holds_on_a_line_that_hears_itself_and_on_one_with_noise() {
    for faults in [
        DynamixelFaults::default(),
        DynamixelFaults { echo: true, ..Default::default() },
        DynamixelFaults { noise: true, in_pieces: true, ..Default::default() },
    ] {
        let emulator = DynamixelEmulator::start().unwrap();
        emulator.fail(faults);
        let mut servo = servo(&emulator, Mode::Position);
        let sleep = |_: &mut Servo, s| std::thread::sleep(Duration::from_secs_f64(s));
        conformance::rotary(&mut servo, &[0.7, -1.2, 0.0], 4.0, 2e-3, sleep).unwrap();
    }
}

/// Model 1030, firmware 38: the maker's example of Ping.
#[test]
fn a_ping_says_model_and_firmware() {
    let emulator = DynamixelEmulator::start().unwrap();
    assert_eq!(bus(&emulator).ping(1).unwrap(), (1030, 38));
    assert_eq!(bus(&emulator).ping(2).unwrap_err().kind(), ErrorKind::Timeout);
}

#[test]
fn speed_is_kept_until_nobody_looks() {
    let emulator = DynamixelEmulator::start().unwrap();
    let mut servo = servo(&emulator, Mode::Velocity);
    let go = ServoCommand::Speed(1.0);
    assert_eq!(servo.command(go).unwrap_err().kind(), ErrorKind::Stale);
    servo.reading().unwrap();
    servo.command(go).unwrap();
    for _ in 0..20 {
        std::thread::sleep(Duration::from_millis(10));
        servo.reading().unwrap();
    }
    assert!((servo.reading().unwrap().value.speed_rad_s - 1.0).abs() < 0.03);
    std::thread::sleep(Duration::from_millis(500));
    let (place, speed) = emulator.now();
    assert!(place > 2048.0 && speed == 0, "{place} {speed}");
    servo.reading().unwrap();
    assert_eq!(servo.command(go).unwrap_err().kind(), ErrorKind::Stopped);
    servo.clear();
    servo.reading().unwrap();
    servo.command(go).unwrap();
}

#[test]
fn limits_of_place_speed_and_current_are_kept() {
    let emulator = DynamixelEmulator::start().unwrap();
    let mut fast = servo(&emulator, Mode::Velocity);
    fast.reading().unwrap();
    for wrong in [ServoCommand::Speed(5.1), ServoCommand::Speed(f64::NAN), ServoCommand::Current(0.1)] {
        assert_eq!(fast.command(wrong).unwrap_err().kind(), ErrorKind::OutOfRange);
    }
    fast.command(ServoCommand::Speed(5.0)).unwrap();
    let error = (0..10_000).find_map(|_| fast.reading().err()).unwrap();
    assert!(error.kind() == ErrorKind::Stopped && error.to_string().contains("angle"), "{error}");
    std::thread::sleep(Duration::from_millis(20));
    assert_eq!(emulator.now().1, 0);
    let emulator = DynamixelEmulator::start().unwrap();
    let mut weak = servo(&emulator, Mode::Current);
    weak.reading().unwrap();
    weak.command(ServoCommand::Current(0.5)).unwrap();
    emulator.fail(DynamixelFaults { current: 500, ..Default::default() });
    let error = (0..1000).find_map(|_| weak.reading().err()).unwrap();
    assert!(error.to_string().contains("current"), "{error}");
}

/// Nobody stops it but itself: its line is silent.
#[test]
fn the_servos_own_watch_stops_it_where_the_line_is_gone() {
    let emulator = DynamixelEmulator::start().unwrap();
    let mut servo = servo(&emulator, Mode::Velocity);
    servo.reading().unwrap();
    servo.command(ServoCommand::Speed(0.5)).unwrap();
    std::mem::forget(servo);
    emulator.fail(DynamixelFaults { cut: true, ..Default::default() });
    std::thread::sleep(Duration::from_millis(500));
    assert_eq!(emulator.now().1, 0);
}

#[test]
fn a_line_that_is_cut_silent_or_garbled_is_said_and_comes_back() {
    let emulator = DynamixelEmulator::start().unwrap();
    let mut servo = servo(&emulator, Mode::Position);
    let mut before = servo.angle_rad().unwrap().t_s;
    for (faults, kinds) in [
        (DynamixelFaults { cut: true, ..Default::default() }, vec![ErrorKind::Link, ErrorKind::Timeout]),
        (DynamixelFaults { silent: true, ..Default::default() }, vec![ErrorKind::Timeout]),
        (DynamixelFaults { garbled: true, ..Default::default() }, vec![ErrorKind::Link]),
        (DynamixelFaults { error: 0x80, ..Default::default() }, vec![ErrorKind::Other]),
    ] {
        emulator.fail(faults);
        let error = (0..100).find_map(|_| servo.angle_rad().err()).unwrap();
        assert!(kinds.contains(&error.kind()), "{error}");
        emulator.fail(DynamixelFaults::default());
        let after = (0..20).find_map(|_| servo.angle_rad().ok()).unwrap().t_s;
        // Its tick is a millisecond.
        assert!(after >= before);
        before = after;
    }
}
