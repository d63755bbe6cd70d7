//! Pendulums that are driven hard enough to turn over: a fit of whole runs settles on motions that turn over once more or once less.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::process::Command;

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, Normal};

/// Of each run: two frequencies of the torque in Hz, its amplitude in N m, two phases in rad, and the angle from which the joint is let go.
const RUNS: [[[f64; 6]; 4]; 2] = [
    [
        [0.28, 0.81, 2.63, 0.55, 3.60, 0.23],
        [0.44, 1.07, 2.89, 1.83, 2.97, 0.29],
        [0.27, 1.03, 1.75, 3.13, 5.17, 0.36],
        [0.24, 1.24, 1.31, 1.26, 2.77, 0.30],
    ],
    [
        [0.48, 0.96, 2.95, 0.49, 3.64, -0.12],
        [0.30, 0.64, 2.51, 3.98, 5.14, 0.38],
        [0.33, 1.20, 1.74, 1.18, 1.56, 0.06],
        [0.35, 0.95, 1.28, 4.75, 3.54, 0.45],
    ],
];
/// Dry friction in parts of the inertia, rad/s^2.
const FRICTION: f64 = 0.35 / 0.12;
const STEP_S: f64 = 0.01;
const SUBSTEPS: usize = 400;

/// Rows of a joint with dry friction: small steps, in each of which friction takes away speed until there is none (Moreau's time stepping).
fn rows(runs: &[[f64; 6]]) -> String {
    let noise = Normal::new(0.0, 2e-3).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut text = String::from("run,t_s,angle_rad,torque_nm\n");
    for (run, &[slow, fast, amplitude, first, second, angle]) in runs.iter().enumerate() {
        let (mut q, mut w) = (angle, 0.0_f64);
        let dt = STEP_S / SUBSTEPS as f64;
        for i in 0..600 {
            let t = STEP_S * i as f64;
            let torque = amplitude * ((TAU * slow * t + first).sin() + 0.6 * (TAU * fast * t + second).sin());
            let reading = q + noise.sample(&mut rng);
            writeln!(text, "{run},{t:.3},{reading:.6},{torque:.5}").unwrap();
            for _ in 0..SUBSTEPS {
                let before = w;
                let free = w + dt * (torque / 0.12 - 30.0 * q.sin() - 1.2 * w);
                w = free.signum() * (free.abs() - dt * FRICTION).max(0.0);
                q += 0.5 * dt * (before + w);
            }
        }
    }
    text
}

const HEADER: &str = r#"
format = 1
domain = "motion"
data = "data.csv"
[model]
states = { angle_rad = "rate_rad_s", rate_rad_s = "torque_nm/inertia_kg_m2 - weight_per_s2*sin(angle_rad) - damping_per_s*rate_rad_s" }
outputs = { angle_rad = "angle_rad" }
inputs = { torque_nm = "hold" }
[[parameter]]
name = "inertia_kg_m2"
unit = "kg m^2"
start = 0.1
lower = 0.01
upper = 1.0
[[parameter]]
name = "weight_per_s2"
unit = "1/s^2"
start = 28.0
lower = 1.0
upper = 100.0
[[parameter]]
name = "damping_per_s"
unit = "1/s"
start = 1.0
lower = 0.0
upper = 20.0
[[joint]]
name = "arm"
position = "angle_rad"
velocity = "rate_rad_s"
drive = "torque_nm"
turns = true
"#;

#[test]
fn dry_friction_is_found_in_pendulums_that_turn_over() {
    for runs in &RUNS {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("recording.toml"), HEADER).unwrap();
        std::fs::write(folder.path().join("data.csv"), rows(runs)).unwrap();
        let tool = env!("CARGO_BIN_EXE_missing-physics");
        let output =
            Command::new(tool).args(["diagnose", "--json", "-"]).arg(folder.path()).output().unwrap();
        let answer: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(answer["chosen"], serde_json::json!(["coulomb-friction"]), "{}", answer["verdict"]);
        let level =
            answer["mechanisms"].as_array().unwrap().iter().find(|m| m["id"] == "coulomb-friction").unwrap()
                ["parameters"][0]
                .clone();
        let [low, high] = [0, 1].map(|end| level["ci95"][end].as_f64().unwrap());
        assert!((low..high).contains(&FRICTION), "{level}");
    }
}
