//! Runs that are not alike in a parameter of the baseline: what is left of them is said as that, and is in the way of no name.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::fmt::Write as _;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use serde_json::Value;

use super::simulated::{answer, answer_in, assert_named, follow};

/// By how much runs differ, in parts of a spread.
const CHANGES: [f64; 6] = [-0.4, 1.2, 0.1, -1.5, 0.9, -0.3];

const MOTOR: &str = r#"
[model]
states = { angle_rad = "rate_rad_s", rate_rad_s = "gain*command_v - damping_per_s*rate_rad_s" }
outputs = { tacho_rad_s = "rate_rad_s" }
inputs = { command_v = "hold" }
[start]
angle_rad = 0.0
rate_rad_s = 0.0
[[parameter]]
name = "gain"
unit = "rad/(s^2 V)"
start = 50.0
[[parameter]]
name = "damping_per_s"
unit = "1/s"
start = 5.0
[[joint]]
name = "shaft"
position = "angle_rad"
velocity = "rate_rad_s"
drive = "command_v"
"#;

/// What a name's run differences are: their values less the mean.
fn differences(answer: &Value, parameter: &str) -> Vec<f64> {
    let all = answer["run_differences"].as_array().unwrap();
    let of = all.iter().find(|d| d["parameter"] == parameter).unwrap();
    let values: Vec<f64> =
        of["by_run"].as_array().unwrap().iter().map(|run| run["value"].as_f64().unwrap()).collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|value| value - mean).collect()
}

fn assert_near(found: &[f64], truth: impl Iterator<Item = f64> + Clone, within: f64) {
    let mean = truth.clone().sum::<f64>() / found.len() as f64;
    for (found, truth) in found.iter().zip(truth) {
        assert!((found - (truth - mean)).abs() < within, "{found}, {}", truth - mean);
    }
}

/// A motor whose supply is another in each run by 3 %, commanded by steps; what rubs is stepped as a set-valued law.
fn motor(friction_rad_s2: f64) -> Value {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut data = String::from("run,t_s,command_v,tacho_rad_s\n");
    for (run, change) in CHANGES.into_iter().enumerate() {
        let (mut rate, mut command) = (0.0_f64, 0.0);
        for i in 0..250 {
            if i % 25 == 0 {
                command = rng.random_range(-6.0..6.0);
            }
            let noise: f64 = StandardNormal.sample(&mut rng);
            writeln!(data, "{run},{:.2},{command:.4},{:.4}", 0.01 * f64::from(i), rate + 0.05 * noise)
                .unwrap();
            for _ in 0..40 {
                let step_s = 0.01 / 40.0;
                let freely = rate + step_s * (60.0 * (1.0 + 0.03 * change) * command - 8.0 * rate);
                let taken = freely.abs().min(step_s * friction_rad_s2);
                rate = freely - freely.signum() * taken;
            }
        }
    }
    answer(MOTOR, &data)
}

#[test]
fn a_supply_that_differs_from_run_to_run_is_said() {
    let answer = motor(0.0);
    assert_eq!(answer["verdict"], "unexplained");
    assert_near(&differences(&answer, "gain_change"), CHANGES.iter().map(|c| 60.0 * 0.03 * c), 0.1);
}

#[test]
fn friction_is_named_where_the_supply_differs_from_run_to_run() {
    let answer = motor(20.0);
    assert_eq!(answer["verdict"], "partly");
    assert_named(&answer, &[("coulomb-friction", 20.0)]);
    assert_near(&differences(&answer, "gain_change"), CHANGES.iter().map(|c| 60.0 * 0.03 * c), 0.1);
}

/// Six drops, each of which gives back another part of the speed by half a hundredth; each impact scatters by a tenth of that.
#[test]
fn balls_that_differ_from_drop_to_drop_are_said() {
    for header in ["", "[rig]\ndrop_height_m = 0.3\n"] {
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        let mut normal = move || -> f64 { StandardNormal.sample(&mut rng) };
        let mut data = String::from("run,bounce,t_s\n");
        for (run, change) in CHANGES.into_iter().enumerate() {
            let (mut speed, mut t) = ((2.0 * 9.806_65 * 0.3_f64).sqrt(), 0.0);
            for bounce in 1..=7 {
                writeln!(data, "{run},{bounce},{:.6}", t + 1e-4 * normal()).unwrap();
                speed *= 0.85 * (1.0 + 0.005 * change) * (5e-4 * normal()).exp();
                t += 2.0 * speed / 9.806_65;
            }
        }
        let answer = answer_in("bounce", header, &data);
        assert_eq!(answer["verdict"], "unexplained");
        assert_near(&differences(&answer, "restitution_change"), CHANGES.iter().map(|c| 0.005 * c), 1e-3);
    }
}

/// Table-tennis balls that are hit, each with a spin of its own.
#[test]
fn drag_is_named_where_each_ball_spins_in_its_own_way() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut data = String::from("run,t_s,x_m,y_m,z_m\n");
    for (run, change) in CHANGES.into_iter().enumerate() {
        let sideways: f64 = rng.random_range(-1.0..1.0);
        let mut x = [0.0, 0.0, 0.3, sideways, 6.0 + sideways, 2.0];
        for i in 0..60 {
            let seen: [f64; 3] = std::array::from_fn(|axis| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                x[axis] + 1e-3 * noise
            });
            let [a, b, c] = seen;
            writeln!(data, "{run},{:.4},{a:.5},{b:.5},{c:.5}", 0.006 * f64::from(i)).unwrap();
            follow(&mut x, 0.006, 4, |[_, _, _, u, v, w]| {
                let drag = 0.15 * (u * u + v * v + w * w).sqrt();
                // The spin is about x, and a little about z.
                let [about_x, about_z] = [0.5 * change, 0.1 * change];
                let lift = [-about_z * v, about_z * u - about_x * w, about_x * v];
                [*u, *v, *w, lift[0] - drag * u, lift[1] - drag * v, lift[2] - drag * w - 9.806_65]
            });
        }
    }
    let answer = answer_in("trajectory", "", &data);
    assert_eq!(answer["verdict"], "partly");
    assert_named(&answer, &[("quadratic-drag", 0.15)]);
    assert_near(&differences(&answer, "lift_change_x_per_s"), CHANGES.iter().map(|c| 0.5 * c), 0.05);
}
