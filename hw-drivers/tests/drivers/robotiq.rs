//! Robotiq grippers by their three lines: contract, dead-man's rule, frames of the manual, faults.
#![cfg(all(feature = "robotiq", feature = "emulator"))]
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::io::{Read, Write};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use hw_drivers::emulator::{RobotiqEmulator, RobotiqFaults, RobotiqProtocol as P};
use hw_drivers::line::tcp;
use hw_drivers::robotiq::{Robotiq, RobotiqSettings};
use hw_traits::gripper::Gripper;
use hw_traits::{Error as _, ErrorKind, conformance};

const ALL: [P; 3] = [P::UrCap, P::Rtu, P::Tcp];

fn connect(emulator: &RobotiqEmulator, protocol: P) -> Robotiq {
    let (address, settings) = (emulator.address(), RobotiqSettings { patience_s: 0.2, ..Default::default() });
    match protocol {
        P::UrCap => Robotiq::by_urcap(address, settings),
        P::Rtu => Robotiq::by_modbus_rtu(tcp(address, 0.2), 9, settings),
        P::Tcp => Robotiq::by_modbus_tcp(address, 9, settings),
    }
    .unwrap()
}

#[test]
fn the_contract_holds_on_each_line_whole_and_in_pieces() {
    let holds = |protocol, in_pieces| {
        let emulator = RobotiqEmulator::start(protocol).unwrap();
        emulator.fail(RobotiqFaults { in_pieces, ..Default::default() });
        let mut gripper = connect(&emulator, protocol);
        let sleep = |_: &mut Robotiq, s| std::thread::sleep(Duration::from_secs_f64(s));
        // A count is 0.37 mm.
        conformance::gripper(&mut gripper, &[0.04, 0.0, 0.085], 0.15, 3.8e-4, sleep).unwrap();
    };
    // Fingers take their time: all of them at once.
    std::thread::scope(|scope| {
        for protocol in ALL {
            for in_pieces in [false, true] {
                scope.spawn(move || holds(protocol, in_pieces));
            }
        }
    });
}

#[test]
fn fingers_that_are_held_up_have_settled() {
    for protocol in ALL {
        let emulator = RobotiqEmulator::start(protocol).unwrap();
        emulator.fail(RobotiqFaults { object_at: 115, ..Default::default() });
        let mut gripper = connect(&emulator, protocol);
        gripper.width_m().unwrap();
        gripper.open_to(0.0, 0.15).unwrap();
        while !gripper.settled().unwrap() {}
        assert!((gripper.width_m().unwrap().value - 0.0425).abs() < 1e-9);
        assert_eq!(emulator.now().2, 0, "the smallest force");
    }
}

#[test]
fn the_dead_mans_rule() {
    for protocol in ALL {
        let emulator = RobotiqEmulator::start(protocol).unwrap();
        let mut gripper = connect(&emulator, protocol);
        assert_eq!(gripper.open_to(0.0, 0.1).unwrap_err().kind(), ErrorKind::Stale);
        gripper.width_m().unwrap();
        assert_eq!(gripper.open_to(0.0, 0.019).unwrap_err().kind(), ErrorKind::OutOfRange);
        gripper.open_to(0.0, 0.020).unwrap();
        // 230 counts at 54 a second: it would take four seconds.
        std::thread::sleep(Duration::from_millis(600));
        let (place, going, _) = emulator.now();
        assert!(place > 0.0 && place < 230.0 && !going, "{place}");
        gripper.width_m().unwrap();
        assert_eq!(gripper.open_to(0.0, 0.1).unwrap_err().kind(), ErrorKind::Stopped);
        gripper.clear();
        gripper.width_m().unwrap();
        gripper.open_to(0.0, 0.020).unwrap();
        drop(gripper);
        std::thread::sleep(Duration::from_millis(20));
        assert!(!emulator.now().1);
    }
}

#[test]
fn a_line_that_is_cut_silent_or_garbled_is_said_and_comes_back() {
    for protocol in ALL {
        let emulator = RobotiqEmulator::start(protocol).unwrap();
        let mut gripper = connect(&emulator, protocol);
        for faults in [
            RobotiqFaults { cut: true, ..Default::default() },
            RobotiqFaults { silent: true, ..Default::default() },
            RobotiqFaults { garbled: true, ..Default::default() },
        ] {
            emulator.fail(faults);
            let error = (0..100).find_map(|_| gripper.width_m().err()).unwrap();
            assert!(matches!(error.kind(), ErrorKind::Link | ErrorKind::Timeout), "{protocol:?}: {error}");
            emulator.fail(RobotiqFaults::default());
            assert!((0..20).any(|_| gripper.width_m().is_ok()), "{protocol:?} {faults:?}");
        }
        emulator.fail(RobotiqFaults { fault: 0x08, ..Default::default() });
        let error = gripper.width_m().unwrap_err();
        assert!(error.to_string().contains("too hot") && error.kind() == ErrorKind::Other, "{error}");
    }
}

/// Answers each question from a list.
struct Script(Arc<Mutex<Vec<Vec<u8>>>>, Vec<u8>, Vec<Vec<u8>>);

impl Read for Script {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        let count = self.1.len().min(bytes.len());
        bytes[..count].copy_from_slice(&self.1[..count]);
        self.1.drain(..count);
        if count == 0 { Err(std::io::ErrorKind::TimedOut.into()) } else { Ok(count) }
    }
}

impl Write for Script {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap().push(bytes.to_vec());
        if !self.2.is_empty() {
            self.1 = self.2.remove(0);
        }
        Ok(bytes.len())
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// The frames that the 2F-85's manual prints, section Modbus RTU communication: clear and set the activation.
#[test]
fn frames_are_those_of_the_manual() {
    let asked = Arc::new(Mutex::new(Vec::new()));
    let log = Arc::clone(&asked);
    let off = vec![0x09, 0x03, 0x06, 0x11, 0, 0, 0, 0, 0];
    let on = vec![0x09, 0x03, 0x06, 0x31, 0, 0, 0, 0, 0];
    let ack = vec![0x09, 0x10, 0x03, 0xE8, 0x00, 0x03, 0x01, 0x30];
    let sum = |mut frame: Vec<u8>| {
        let mut sum = 0xFFFFu16;
        for byte in &frame {
            sum ^= u16::from(*byte);
            for _ in 0..8 {
                sum = if sum & 1 == 1 { sum >> 1 ^ 0xA001 } else { sum >> 1 };
            }
        }
        frame.extend(sum.to_le_bytes());
        frame
    };
    let mut answers = Some(vec![sum(off), ack.clone(), ack, sum(on)]);
    let open = Box::new(move || {
        Ok(Box::new(Script(Arc::clone(&log), Vec::new(), answers.take().unwrap_or_default())) as Box<_>)
    });
    let gripper = Robotiq::by_modbus_rtu(open, 9, RobotiqSettings::default()).unwrap();
    drop(gripper);
    let asked = asked.lock().unwrap();
    assert_eq!(asked[1], [0x09, 0x10, 0x03, 0xE8, 0, 3, 6, 0, 0, 0, 0, 0, 0, 0x73, 0x30]);
    assert_eq!(asked[0][..6], [0x09, 0x03, 0x07, 0xD0, 0, 3]);
    assert_eq!(asked[2][7], 1);
}
