//! An arm of more joints than three, each of which rubs.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::f64::consts::TAU;
use std::fmt::Write as _;

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, Normal};

use super::simulated::{answer, assert_named};

const JOINTS: usize = 4;
/// Gains in 1/(kg m^2) and dampings in 1/s of the joints.
const GAINS: [f64; JOINTS] = [9.2, 12.1, 10.4, 8.7];
const DAMPINGS: [f64; JOINTS] = [1.3, 1.8, 1.1, 1.6];
/// What a joint's speed beyond its neighbour's takes away of it, 1/s.
const BELT: f64 = 0.6;
/// Dry friction in rad/s^2.
const FRICTION: [f64; JOINTS] = [2.1, 2.9, 1.7, 2.4];
/// Base frequencies of the torques of the runs in Hz.
const RUNS: [f64; 2] = [0.5, 0.8];
const ROWS: usize = 200;
const STEP_S: f64 = 0.01;
const SUBSTEPS: usize = 400;

/// Rows of the joints: small steps, in each of which friction takes away speed until there is none (Moreau's time stepping).
fn rows() -> String {
    let noise = Normal::new(0.0, 2e-4).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut text = header();
    let dt = STEP_S / SUBSTEPS as f64;
    for (run, slow) in RUNS.iter().enumerate() {
        let (mut angle, mut speed) = ([0.0; JOINTS], [0.0_f64; JOINTS]);
        for i in 0..ROWS {
            let t = STEP_S * i as f64;
            let torque: [f64; JOINTS] = std::array::from_fn(|j| {
                let phase = TAU * slow * (1.0 + 0.17 * j as f64) * t;
                0.8 * (phase + j as f64).sin() + 0.35 * (2.3 * phase + 2.0 * j as f64).sin()
            });
            let cells = torque.iter().copied().chain(angle.map(|angle| angle + noise.sample(&mut rng)));
            text += &cells.fold(format!("{run},{t:.2}"), |row, cell| row + &format!(",{cell:.6}"));
            text.push('\n');
            for _ in 0..SUBSTEPS {
                let before = speed;
                for j in 0..JOINTS {
                    let neighbours = [j.checked_sub(1), (j + 1 < JOINTS).then_some(j + 1)];
                    let slip: f64 =
                        neighbours.into_iter().flatten().map(|other| before[j] - before[other]).sum();
                    let free =
                        before[j] + dt * (GAINS[j] * torque[j] - DAMPINGS[j] * before[j] - BELT * slip);
                    speed[j] = free.signum() * (free.abs() - dt * FRICTION[j]).max(0.0);
                    angle[j] += 0.5 * dt * (before[j] + speed[j]);
                }
            }
        }
    }
    text
}

fn header() -> String {
    let columns = |name: &str| {
        (1..=JOINTS).fold(String::new(), |all, j| all + "," + &name.replace('#', &j.to_string()))
    };
    format!("run,t_s{}{}\n", columns("torque#_n_m"), columns("encoder#_rad"))
}

/// The equations without the friction.
fn machine() -> String {
    let mut states = Vec::new();
    let mut text = String::new();
    for j in 1..=JOINTS {
        let mut rate = format!("gain{j}*torque{j}_n_m - damping{j}*speed{j}_rad_s");
        for other in [j - 1, j + 1].into_iter().filter(|other| (1..=JOINTS).contains(other)) {
            write!(rate, " - belt*(speed{j}_rad_s - speed{other}_rad_s)").unwrap();
        }
        states.push(format!("angle{j}_rad = \"speed{j}_rad_s\", speed{j}_rad_s = \"{rate}\""));
    }
    let each = |item: &str| (1..=JOINTS).map(|j| item.replace('#', &j.to_string())).collect::<Vec<_>>();
    text += &format!("[model]\nstates = {{ {} }}\n", states.join(", "));
    text += &format!("outputs = {{ {} }}\n", each("encoder#_rad = \"angle#_rad\"").join(", "));
    text += &format!("inputs = {{ {} }}\n", each("torque#_n_m = \"hold\"").join(", "));
    text += "[[parameter]]\nname = \"belt\"\nunit = \"1/s\"\nstart = 0.5\n";
    let gain = "[[parameter]]\nname = \"gain#\"\nunit = \"1/(kg m^2)\"\nstart = 10.0\n";
    let damping = "[[parameter]]\nname = \"damping#\"\nunit = \"1/s\"\nstart = 1.5\n";
    let joint = "[[joint]]\nname = \"j#\"\nposition = \"angle#_rad\"\nvelocity = \"speed#_rad_s\"\ndrive = \"torque#_n_m\"\n";
    text += &each(&format!("{gain}{damping}{joint}")).concat();
    text += &format!("[start]\n{}", each("angle#_rad = 0.0\nspeed#_rad_s = 0.0\n").concat());
    text
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_friction_is_named_in_each_joint_of_an_arm_that_rubs() {
    let answer = answer(&machine(), &rows());
    let names: Vec<String> = (1..=JOINTS).map(|j| format!("coulomb-friction@j{j}")).collect();
    let truth: Vec<(&str, f64)> = names.iter().map(String::as_str).zip(FRICTION).collect();
    assert_named(&answer, &truth);
    assert_eq!(answer["verdict"], "explained");
}
