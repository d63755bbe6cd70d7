//! Net F/T: the contract, and everything that a line does to records.
#![cfg(all(feature = "ati", feature = "emulator"))]
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::net::UdpSocket;

use hw_drivers::ati::{NetFt, NetFtSettings, set_rate, settings_of};
use hw_drivers::emulator::{AtiEmulator, AtiFaults, AtiPages};
use hw_traits::force_torque::ForceTorque;
use hw_traits::{Error as _, ErrorKind, conformance};

/// A load that tells the time: 1 N a second.
fn clocked() -> AtiEmulator {
    AtiEmulator::start(1000.0, |t| [t, -2.0, 3.0, 0.1, 0.2, -0.3]).unwrap()
}

fn steady() -> AtiEmulator {
    AtiEmulator::start(1000.0, |_| [1.0, -2.0, 3.0, 0.1, 0.2, -0.3]).unwrap()
}

#[test]
fn the_contract_holds() {
    let emulator = steady();
    let mut sensor = NetFt::connect(emulator.address(), NetFtSettings::default()).unwrap();
    conformance::force_torque(&mut sensor, 50, 1e-5).unwrap();
}

/// Bytes as section 10 of the manual has them, sent by hand.
#[test]
fn a_record_is_read_as_the_manual_has_it() {
    let sensor = UdpSocket::bind("127.0.0.1:0").unwrap();
    let settings = NetFtSettings { timeout_s: 1.0, counts_per_nm: 5e5, ..NetFtSettings::default() };
    let mut driver = NetFt::connect(sensor.local_addr().unwrap(), settings).unwrap();
    let mut request = [0; 64];
    let (count, driver_at) = sensor.recv_from(&mut request).unwrap();
    assert_eq!(request[..count], [0x12, 0x34, 0x00, 0x02, 0, 0, 0, 0]);
    let mut record = vec![0, 0, 0, 1, 0, 0, 0x1B, 0x58, 0, 0, 0, 0];
    for counts in [1_000_000i32, -2_000_000, 0, 500_000, -1, i32::MIN] {
        record.extend(counts.to_be_bytes());
    }
    sensor.send_to(&record, driver_at).unwrap();
    let felt = driver.read().unwrap();
    // 0x1B58 is 7000 samples, a second.
    assert_eq!(felt.t_s, 1.0);
    assert_eq!(felt.value.components(), [1.0, -2.0, 0.0, 1.0, -2e-6, -4294.967296]);
    drop(driver);
    let (count, _) = sensor.recv_from(&mut request).unwrap();
    assert_eq!(request[..count], [0x12, 0x34, 0, 0, 0, 0, 0, 0]);
}

#[test]
fn lost_late_double_and_cut_records_are_counted_and_never_returned_twice() {
    let emulator = clocked();
    emulator.fail(AtiFaults {
        lose_every: 10,
        swap_every: 7,
        double_every: 13,
        cut_every: 101,
        ..AtiFaults::default()
    });
    let mut sensor = NetFt::connect(emulator.address(), NetFtSettings::default()).unwrap();
    let (mut last, first_sent) = (sensor.read().unwrap(), emulator.records());
    for _ in 0..500 {
        let next = sensor.read().unwrap();
        assert!(next.t_s > last.t_s && next.value.force_n[0] >= last.value.force_n[0], "{last:?} {next:?}");
        last = next;
    }
    let (losses, made) = (sensor.losses(), emulator.records() - first_sent);
    assert!(losses.late > 40 && losses.garbled > 3 && losses.restarts == 0, "{losses:?}");
    // A tenth is lost, and a hundredth is cut; one that was late is not lost.
    let share = losses.lost as f64 / made as f64;
    assert!((0.09..0.14).contains(&share), "{losses:?} of {made}");
}

#[test]
fn sequence_numbers_may_turn_over() {
    let sensor = UdpSocket::bind("127.0.0.1:0").unwrap();
    let mut driver = NetFt::connect(sensor.local_addr().unwrap(), NetFtSettings::default()).unwrap();
    let (_, driver_at) = sensor.recv_from(&mut [0; 64]).unwrap();
    let mut times = Vec::new();
    for (rdt, ft) in [(u32::MAX, u32::MAX - 6), (0, 0), (1, 7)] {
        let mut record = [0; 36];
        record[..4].copy_from_slice(&rdt.to_be_bytes());
        record[4..8].copy_from_slice(&ft.to_be_bytes());
        sensor.send_to(&record, driver_at).unwrap();
        times.push(driver.read().unwrap().t_s);
    }
    assert!((times[1] - times[0] - 1e-3).abs() < 1e-6 && (times[2] - times[1] - 1e-3).abs() < 1e-6);
    assert_eq!(driver.losses().lost, 0);
}

#[test]
fn a_sensor_without_power_is_late_and_comes_back_with_times_that_rise() {
    let emulator = clocked();
    let mut sensor = NetFt::connect(emulator.address(), NetFtSettings::default()).unwrap();
    let before = sensor.read().unwrap();
    emulator.fail(AtiFaults { dark: true, ..AtiFaults::default() });
    // What was on its way still comes.
    let error = (0..1000).find_map(|_| sensor.read().err()).unwrap();
    assert_eq!(error.kind(), ErrorKind::Timeout, "{error}");
    emulator.fail(AtiFaults::default());
    let after = (0..50).find_map(|_| sensor.read().ok()).unwrap();
    assert!(after.t_s > before.t_s && sensor.losses().restarts > 0);
    // It felt less than before: its clock began again.
    assert!(after.value.force_n[0] < before.value.force_n[0] + 1.0);
    assert!(sensor.read().unwrap().t_s > after.t_s);
}

#[test]
fn a_status_word_is_an_error_and_the_next_reading_comes() {
    let emulator = steady();
    let mut sensor = NetFt::connect(emulator.address(), NetFtSettings::default()).unwrap();
    sensor.read().unwrap();
    for (status, kind) in [
        (0xC000_0000, ErrorKind::Saturated),
        (0x8800_0000, ErrorKind::Saturated),
        (0x8000_0002, ErrorKind::Other),
    ] {
        emulator.fail(AtiFaults { status, ..AtiFaults::default() });
        let error = (0..1000).find_map(|_| sensor.read().err()).unwrap();
        assert_eq!(error.kind(), kind, "{error}");
        emulator.fail(AtiFaults::default());
        assert!((0..1000).any(|_| sensor.read().is_ok()));
    }
}

#[test]
fn bias_is_taken_by_the_sensor() {
    let emulator = steady();
    let mut sensor = NetFt::connect(emulator.address(), NetFtSettings::default()).unwrap();
    sensor.bias().unwrap();
    let zeroed = (0..1000).any(|_| sensor.read().unwrap().value.components().iter().all(|v| v.abs() < 1e-5));
    assert!(zeroed);
}

#[test]
fn nobody_at_the_address_is_an_error_and_so_are_settings_that_are_none() {
    let free = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let mut sensor = NetFt::connect(free, NetFtSettings::default()).unwrap();
    assert!(matches!(sensor.read().unwrap_err().kind(), ErrorKind::Link | ErrorKind::Timeout));
    for wrong in [f64::NAN, 0.0, -1.0] {
        let settings = NetFtSettings { counts_per_n: wrong, ..NetFtSettings::default() };
        assert_eq!(NetFt::connect(free, settings).unwrap_err().kind(), ErrorKind::OutOfRange);
    }
}

#[test]
fn the_sensors_pages_say_counts_and_rate_and_the_rate_can_be_set() {
    let pages = AtiPages::start().unwrap();
    let (settings, rate_hz) = settings_of(pages.address(), 1.0).unwrap();
    assert_eq!((settings.counts_per_n, settings.counts_per_nm, rate_hz), (1e6, 5e5, 7000.0));
    set_rate(pages.address(), 1000, 1.0).unwrap();
    assert_eq!(settings_of(pages.address(), 1.0).unwrap().1, 1000.0);
    assert_eq!(set_rate(pages.address(), 0, 1.0).unwrap_err().kind(), ErrorKind::OutOfRange);
}

/// A program that waited wants to know how things are, not how they were.
#[test]
fn readings_that_waited_are_left_out_when_that_is_asked_for() {
    let emulator = clocked();
    let mut sensor = NetFt::connect(emulator.address(), NetFtSettings::default()).unwrap();
    let before = sensor.read().unwrap();
    std::thread::sleep(std::time::Duration::from_millis(500));
    sensor.skip().unwrap();
    let after = sensor.read().unwrap();
    assert!(after.t_s - before.t_s > 0.49 && after.value.force_n[0] - before.value.force_n[0] > 0.49);
    // What was left out came, and what the computer had no room for is lost; nothing comes twice.
    assert!(sensor.losses().late == 0 && sensor.read().unwrap().t_s > after.t_s);
}
