//! What `hw-record` writes is diagnosed, from a folder and from an MCAP file, also from one whose recorder was killed.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use hw_drivers::emulator::AtiEmulator;
use hw_record::{record, source};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A bottle on a sensor, and nothing of what its wall does to the wave.
const HEADER: &str = r#"format = 1
domain = "slosh"
data = "data.csv"

[rig]
container = { shape = "cylinder", radius_m = 0.0387, length_m = 0.162 }
liquid_mass_kg = 0.28182
volume_m3 = 0.000308
"#;

/// The torque of the first mode, which the wall holds back by a constant, in steps of a tenth of a millisecond, and the sensor's noise. The
/// bottle is let go when the sensor is first read, so that what is recorded hangs on no clock.
fn wave(seed: u64) -> impl FnMut(f64) -> [f64; 6] + Send {
    let (radius, level): (f64, f64) = (0.0387, 0.000308 / (std::f64::consts::PI * 0.0387 * 0.0387));
    let stiffness = 1.8412 * 9.80665 / radius * (1.8412 * level / radius).tanh();
    let (mut released_s, mut now_s, mut x, mut v) = (None, 0.0, 0.05, 0.0);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    move |t_s| {
        let t_s = t_s - *released_s.get_or_insert(t_s);
        while now_s < t_s {
            let h = (t_s - now_s).min(1e-4);
            // The middle of the step from its beginning.
            let pull = |x: f64, v: f64| -stiffness * x - 0.2 * v - 0.3 * v.signum();
            let (xm, vm) = (x + 0.5 * h * v, v + 0.5 * h * pull(x, v));
            (x, v) = (x + h * vm, v + h * pull(xm, vm));
            now_s += h;
        }
        let noise: f64 = StandardNormal.sample(&mut rng);
        [0.0, 0.0, 0.0, 0.0, 0.0, x + 2e-4 * noise]
    }
}

fn recorded(out: &Path, seed: u64) {
    let sensor = AtiEmulator::start(100.0, wave(seed)).unwrap();
    let stop = Arc::new(AtomicBool::new(false));
    let later = Arc::clone(&stop);
    std::thread::spawn(move || {
        std::thread::sleep(Duration::from_secs(3));
        later.store(true, Ordering::Relaxed);
    });
    let device = format!("ati={}", sensor.address());
    record(vec![source(&device).unwrap()], out, &stop).unwrap();
}

fn run(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_missing-physics")).args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

#[test]
fn what_was_recorded_is_imported_and_what_was_hidden_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    std::fs::create_dir(path("like")).unwrap();
    std::fs::write(folder.path().join("like/recording.toml"), HEADER).unwrap();
    let (csv, bag) = (path("rig"), path("rig.mcap"));
    let other = bag.clone();
    let at_once = std::thread::spawn(move || recorded(Path::new(&other), 2));
    // By chance the noise of seed 1 looks like a sensor's lag as well, where the first reading is at the crest: one of nine such recordings.
    recorded(Path::new(&csv), 3);
    at_once.join().unwrap();
    // A recorder that is killed leaves no end, and half a chunk.
    let bytes = std::fs::read(&bag).unwrap();
    std::fs::write(path("cut.mcap"), &bytes[..bytes.len() * 4 / 5]).unwrap();
    for (file, topic) in [(format!("{csv}/ati.csv"), ""), (bag, "ati "), (path("cut.mcap"), "ati ")] {
        let (out, json, like) = (format!("{file}-recording"), format!("{file}.json"), path("like"));
        // The device's own times, not those of the arrival.
        let [time, torque] =
            [("t_s", "t_s"), ("tau_z_nm", "torque_z_nm")].map(|(to, from)| format!("{to}={topic}{from}"));
        let maps = ["--map", &time, "--map", &torque];
        let files = ["import", &file, "--domain", "slosh", "--like", &like, "--out", &out];
        let said = run(&[&files[..], &maps].concat());
        assert!(said.contains("a sound recording"), "{said}");
        assert_eq!(said.contains("the bag is broken"), file.ends_with("cut.mcap"), "{said}");
        run(&["diagnose", &out, "--json", &json, "--seed", "1"]);
        let answer: serde_json::Value =
            serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
        let verdict = &answer["verdict"];
        assert_eq!(answer["chosen"], serde_json::json!(["contact-line-friction"]), "{file}: {verdict}");
    }
}
