//! What is recorded, and what is left of it where the program is killed.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::collections::BTreeMap;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use hw_drivers::depth_folder::DepthFolder;
use hw_drivers::emulator::{
    AtiEmulator, AtiFaults, DconEmulator, DynamixelEmulator, RobotiqEmulator, RobotiqProtocol, UrEmulator,
};
use hw_drivers::wav::WavMicrophones;
use hw_record::{record, source};
use hw_traits::camera::DepthCamera as _;
use hw_traits::microphones::Microphones as _;
use hw_traits::picture::Intrinsics;

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

/// How many messages of each topic an MCAP file holds, up to where it is cut, and the last `t_s` of a topic.
fn messages(path: &std::path::Path) -> (BTreeMap<String, usize>, BTreeMap<String, f64>) {
    let bytes = std::fs::read(path).unwrap();
    let (mut counts, mut last, mut topics) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
    let reader =
        mcap::read::ChunkFlattener::new_with_options(&bytes, mcap::read::Options::IgnoreEndMagic.into());
    for record in reader.unwrap().map_while(Result::ok) {
        match record {
            mcap::records::Record::Channel(channel) => drop(topics.insert(channel.id, channel.topic)),
            mcap::records::Record::Message { header, data } => {
                let topic: &String = &topics[&header.channel_id];
                let message: serde_json::Value = serde_json::from_slice(&data).unwrap();
                *counts.entry(topic.clone()).or_insert(0) += 1;
                last.insert(topic.clone(), message["t_s"].as_f64().unwrap());
            }
            _ => {}
        }
    }
    (counts, last)
}

/// Killed, it has lost no more than the last second, as a folder and as an MCAP file.
#[test]
fn a_recorder_that_is_killed_loses_at_most_the_last_second() {
    for name in ["out", "out.mcap"] {
        let sensor = AtiEmulator::start(1000.0, |t| [t, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join(name);
        let mut child = Command::new(env!("CARGO_BIN_EXE_hw-record"))
            .args(["record", "--device", &format!("ati={}", sensor.address()), "--out"])
            .arg(&out)
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let path = if name == "out" { out.join("ati.csv") } else { out };
        while std::fs::metadata(&path).map_or(0, |m| m.len()) < 200_000 {
            std::thread::sleep(Duration::from_millis(20));
        }
        // SIGKILL: nothing of it runs any more.
        child.kill().unwrap();
        let made = sensor.records() as f64 / 1000.0;
        child.wait().unwrap();
        let kept = if name == "out" {
            let rows = rows(&path);
            rows.last().unwrap()[1] - rows[0][1]
        } else {
            messages(&path).0["ati"] as f64 / 1000.0
        };
        // By the sensor's own count of its records, 1000 a second.
        assert!(kept > 0.3 && made - kept < 1.0, "{name}: {made} s, {kept} s");
    }
}

/// Sound and depth pictures, a servo, a gauge and a gripper, as files: all that is read can be read again.
fn everything(folder: &std::path::Path, out: &std::path::Path) -> BTreeMap<String, hw_record::Tally> {
    let servo = DynamixelEmulator::start().unwrap();
    let air = DconEmulator::start().unwrap();
    let gripper = RobotiqEmulator::start(RobotiqProtocol::UrCap).unwrap();
    let spec = hound::WavSpec {
        channels: 2,
        sample_rate: 8000,
        bits_per_sample: 16,
        sample_format: hound::SampleFormat::Int,
    };
    let mut wav = hound::WavWriter::create(folder.join("in.wav"), spec).unwrap();
    (0..8000i16).for_each(|k| wav.write_sample(k).unwrap());
    wav.finalize().unwrap();
    let pictures = folder.join("pictures");
    std::fs::create_dir_all(&pictures).unwrap();
    for t in ["1.500000", "1.600000"] {
        let file = std::fs::File::create(pictures.join(format!("{t}.png"))).unwrap();
        let mut encoder = png::Encoder::new(file, 2, 2);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Sixteen);
        encoder.write_header().unwrap().write_image_data(&[0, 0, 1, 0, 2, 0, 255, 255]).unwrap();
    }
    let devices = [
        format!("elbow:dynamixel={}?id=1", servo.address()),
        format!("dcon={}?module=1&channel=0&pa=200000", air.address()),
        format!("robotiq={}", gripper.address()),
        format!("wav={}", folder.join("in.wav").display()),
        format!("depth={}?fx=600&fy=600&cx=1&cy=1", pictures.display()),
    ];
    let sources = devices.iter().map(|d| source(d).unwrap()).collect();
    let stop = Arc::new(AtomicBool::new(false));
    let later = Arc::clone(&stop);
    std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(1200));
        later.store(true, Ordering::Relaxed);
    });
    record(sources, out, &stop).unwrap()
}

#[test]
fn every_kind_of_device_is_recorded_to_a_folder_that_drivers_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let tallies = everything(folder.path(), &out);
    assert!(tallies.values().all(|t| t.readings >= 2), "{tallies:?}");
    for (name, columns) in [("elbow", 5), ("dcon", 3), ("robotiq", 3), ("wav", 4)] {
        let rows = rows(&out.join(format!("{name}.csv")));
        assert!(rows.len() > 5 && rows.iter().all(|r| r.len() == columns), "{name}: {rows:?}");
    }
    // Half a second of sound, sample by sample, and the pictures.
    let mut heard = WavMicrophones::open(out.join("wav.wav")).unwrap();
    let mut samples = vec![0.0; 8000];
    heard.read(&mut samples).unwrap();
    assert!((0..8000).all(|k| (f64::from(samples[k]) - k as f64 / 32_768.0).abs() < 1e-6));
    let pinhole = Intrinsics { fx: 600.0, fy: 600.0, cx: 1.0, cy: 1.0 };
    let mut seen = DepthFolder::new(out.join("depth"), pinhole, 0.001, 0.1).unwrap();
    for t_s in [1.5, 1.6] {
        let picture = seen.depth_m().unwrap();
        assert!((picture.t_s - t_s).abs() < 1e-9 && picture.value.data()[0].is_nan());
        assert_eq!(picture.value.data()[1..], [0.256, 0.512, 65.535]);
    }
}

#[test]
fn every_kind_of_device_is_recorded_to_an_mcap_file() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.mcap");
    let tallies = everything(folder.path(), &out);
    let (counts, last) = messages(&out);
    for (name, tally) in &tallies {
        assert_eq!(counts[name] as u64, tally.readings, "{name}");
    }
    assert!((last["depth"] - 1.6).abs() < 1e-9 && (last["wav"] - 0.45).abs() < 1e-9, "{last:?}");
    // It has its end: a reader that insists on it is content.
    let bytes = std::fs::read(&out).unwrap();
    assert!(mcap::Summary::read(&bytes).unwrap().is_some());
}

#[test]
fn what_is_no_device_is_said() {
    for given in ["ati", "ati=nowhere", "camera=127.0.0.1:1", "../up:wav=x", "dynamixel=127.0.0.1:1?id"] {
        assert!(source(given).map(drop).unwrap_err().to_string().contains("KIND=ADDRESS"), "{given}");
    }
    let missing = source("depth=.?fx=1").map(drop).unwrap_err().to_string();
    assert!(missing.contains("fy="), "{missing}");
}
