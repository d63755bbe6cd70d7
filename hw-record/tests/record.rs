//! What is recorded, and what is left of it where the program is killed.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use hw_drivers::emulator::{AtiEmulator, AtiFaults, UrEmulator};
use hw_record::{record, source};

/// Numbers of the rows of a file; a last row that is cut is left out.
fn rows(path: &std::path::Path) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(path).unwrap();
    let whole = &text[..=text.rfind('\n').unwrap()];
    whole.lines().skip(1).map(|line| line.split(',').map(|n| n.parse().unwrap()).collect()).collect()
}

#[test]
fn two_devices_are_recorded_on_one_clock_with_gaps_said() {
    let sensor = AtiEmulator::start(1000.0, |t| [t, 0.0, -9.81, 0.0, 0.0, 0.0]).unwrap();
    sensor.fail(AtiFaults { lose_every: 50, ..AtiFaults::default() });
    let robot = UrEmulator::start([0.3, 0.1, 0.4, 0.0, 0.0, 0.0]).unwrap();
    let devices = [format!("ati={}", sensor.address()), format!("ur={}", robot.address())];
    let sources = devices.iter().map(|d| source(d).unwrap()).collect();
    let stop = Arc::new(AtomicBool::new(false));
    let later = Arc::clone(&stop);
    let timer = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(1500));
        later.store(true, Ordering::Relaxed);
    });
    let folder = tempfile::tempdir().unwrap();
    let tallies = record(sources, folder.path(), &stop).unwrap();
    timer.join().unwrap();
    let ati = rows(&folder.path().join("ati.csv"));
    assert_eq!(ati.len() as u64, tallies["ati"].readings);
    assert!(ati.iter().all(|r| r.len() == 8 && (r[4] + 9.81).abs() < 1e-5));
    assert!(ati.windows(2).all(|w| w[1][0] >= w[0][0] && w[1][1] > w[0][1]));
    // At least one in fifty is lost; on a machine that is busy the sensor's stream has pauses as well.
    let tally = &tallies["ati"];
    let span = ati[ati.len() - 1][1] - ati[0][1];
    assert!(tally.missing >= tally.readings / 50 - 1, "{tally}");
    assert!(
        (tally.missing + tally.readings).abs_diff((1000.0 * span).round() as u64 + 1) <= tally.gaps,
        "{tally} in {span} s"
    );
    // The sensor's load tells its own time.
    assert!(ati.iter().all(|r| (r[1] - ati[0][1] - (r[2] - ati[0][2])).abs() < 0.5));
    let ur = rows(&folder.path().join("ur.csv"));
    assert!(ur.len() > 20 && ur.iter().all(|r| r.len() == 20 && (r[2] - 0.1).abs() < 1e-12));
}

/// Killed, it has lost no more than the last second.
#[test]
fn a_recorder_that_is_killed_loses_at_most_the_last_second() {
    let sensor = AtiEmulator::start(1000.0, |t| [t, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_hw-record"))
        .args(["record", "--device", &format!("ati={}", sensor.address()), "--out"])
        .arg(folder.path())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let path = folder.path().join("ati.csv");
    while std::fs::metadata(&path).map_or(0, |m| m.len()) < 40_000 {
        std::thread::sleep(Duration::from_millis(20));
    }
    child.kill().unwrap();
    let made = sensor.records();
    child.wait().unwrap();
    let rows = rows(&path);
    let last = rows.last().unwrap()[1] - rows[0][1];
    // By the sensor's own count of its records, 1000 a second.
    assert!(made as f64 / 1000.0 - last < 1.0, "{made} records, {last} s");
}

#[test]
fn what_is_no_device_is_said() {
    for given in ["ati", "ati=nowhere", "camera=127.0.0.1:1"] {
        assert!(source(given).map(drop).unwrap_err().to_string().contains("KIND=ADDRESS"));
    }
}
