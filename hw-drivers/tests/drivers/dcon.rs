//! A chamber of air behind analogue modules: contracts, dead-man's rule, the module's own watch, what goes wrong on a line.
#![cfg(all(feature = "dcon", feature = "emulator"))]
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::time::Duration;

use hw_drivers::dcon::{Gauge, GaugeSettings, Outlet, Pneumatics, PneumaticsSettings};
use hw_drivers::emulator::{DconEmulator, DconFaults};
use hw_drivers::line::tcp;
use hw_traits::pneumatics::{Pressure, Valve};
use hw_traits::{Error as _, ErrorKind, conformance};

const SETTINGS: PneumaticsSettings = PneumaticsSettings {
    input: (1, 0),
    sensor: ([0.0, 10.0], 2e5),
    output: (2, 0),
    outlet: Outlet::Valve([0.0, 5.0, 10.0]),
    largest_pa: 5e4,
    timeout_s: 0.1,
    patience_s: 0.2,
};

fn chamber(emulator: &DconEmulator) -> Pneumatics {
    Pneumatics::new(tcp(emulator.address(), 0.1), SETTINGS).unwrap()
}

#[test]
fn the_contracts_hold_whole_and_in_pieces() {
    for in_pieces in [false, true] {
        let emulator = DconEmulator::start().unwrap();
        emulator.fail(DconFaults { in_pieces, ..Default::default() });
        let mut chamber = chamber(&emulator);
        conformance::pressure(&mut chamber, 5).unwrap();
        conformance::valve(&mut chamber, |c| assert!(c.pressure_pa().is_ok())).unwrap();
        drop(chamber);
        // The sensor alone, which sets nothing.
        let (volts, _) = emulator.now();
        let PneumaticsSettings { input, sensor, timeout_s, .. } = SETTINGS;
        let alone = GaugeSettings { input, sensor, timeout_s };
        let mut gauge = Gauge::new(tcp(emulator.address(), 0.1), alone).unwrap();
        conformance::pressure(&mut gauge, 5).unwrap();
        assert_eq!(emulator.now().0, volts);
    }
}

#[test]
fn the_dead_mans_rule() {
    let emulator = DconEmulator::start().unwrap();
    let mut chamber = chamber(&emulator);
    assert_eq!(chamber.open(0.5).unwrap_err().kind(), ErrorKind::Stale);
    chamber.pressure_pa().unwrap();
    chamber.open(0.1).unwrap();
    assert_eq!(emulator.now().0, 5.5);
    std::thread::sleep(Duration::from_millis(600));
    let (volts, pressure) = emulator.now();
    assert!(volts == 5.0 && pressure > 0.0, "{volts} {pressure}");
    chamber.pressure_pa().unwrap();
    assert_eq!(chamber.open(0.1).unwrap_err().kind(), ErrorKind::Stopped);
    chamber.clear();
    // A pressure that is too large closes.
    chamber.pressure_pa().unwrap();
    chamber.open(1.0).unwrap();
    let error = (0..10_000).find_map(|_| chamber.pressure_pa().err()).unwrap();
    assert!(error.kind() == ErrorKind::Stopped && emulator.now().0 == 5.0, "{error}");
    // A command of the other kind of outlet is none.
    assert_eq!(chamber.regulate(1e4).unwrap_err().kind(), ErrorKind::OutOfRange);
}

#[test]
fn the_modules_own_watch_closes_where_the_line_is_gone() {
    let emulator = DconEmulator::start().unwrap();
    let mut chamber = chamber(&emulator);
    chamber.pressure_pa().unwrap();
    chamber.open(0.2).unwrap();
    std::mem::forget(chamber);
    emulator.fail(DconFaults { cut: true, ..Default::default() });
    std::thread::sleep(Duration::from_millis(500));
    assert_eq!(emulator.now().0, 5.0);
}

/// The module's watch wants to hear from its host also while the valve is closed and nobody asks.
#[test]
fn a_chamber_that_rests_takes_the_next_command() {
    let emulator = DconEmulator::start().unwrap();
    let mut chamber = chamber(&emulator);
    for _ in 0..2 {
        std::thread::sleep(Duration::from_millis(500));
        chamber.pressure_pa().unwrap();
        chamber.open(0.1).unwrap();
        chamber.open(0.0).unwrap();
        chamber.pressure_pa().unwrap();
    }
}

#[test]
fn a_regulator_takes_pressures_up_to_the_limit() {
    let emulator = DconEmulator::start().unwrap();
    let settings = PneumaticsSettings { outlet: Outlet::Regulator([0.0, 10.0], 1e5), ..SETTINGS };
    let mut regulator = Pneumatics::new(tcp(emulator.address(), 0.1), settings).unwrap();
    regulator.pressure_pa().unwrap();
    regulator.regulate(4e4).unwrap();
    assert_eq!(emulator.now().0, 4.0);
    for wrong in [-1.0, 5.1e4, f64::NAN] {
        assert_eq!(regulator.regulate(wrong).unwrap_err().kind(), ErrorKind::OutOfRange);
    }
}

#[test]
fn a_line_that_is_cut_silent_or_refuses_is_said_and_comes_back() {
    let emulator = DconEmulator::start().unwrap();
    let mut chamber = chamber(&emulator);
    for (faults, kinds) in [
        (DconFaults { cut: true, ..Default::default() }, vec![ErrorKind::Link, ErrorKind::Timeout]),
        (DconFaults { silent: true, ..Default::default() }, vec![ErrorKind::Timeout]),
        (DconFaults { refuse: true, ..Default::default() }, vec![ErrorKind::Link]),
    ] {
        emulator.fail(faults);
        let error = (0..100).find_map(|_| chamber.pressure_pa().err()).unwrap();
        assert!(kinds.contains(&error.kind()), "{error}");
        emulator.fail(DconFaults::default());
        assert!((0..20).any(|_| chamber.pressure_pa().is_ok()));
    }
}
