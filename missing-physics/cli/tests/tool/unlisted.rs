//! Machines under laws that nobody has listed: the law is found where it acts, in the equations or in a reading.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use std::fmt::Write as _;

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, Normal};
use serde_json::Value;

use super::simulated::{answer, follow};

const ARM: &str = r#"
[model]
states = { angle_rad = "rate_rad_s", rate_rad_s = "-stiffness_per_s2*angle_rad - damping_per_s*rate_rad_s" }
outputs = { encoder_rad = "angle_rad" }
[[parameter]]
name = "stiffness_per_s2"
unit = "1/s^2"
start = 28.0
[[parameter]]
name = "damping_per_s"
unit = "1/s"
start = 0.2
[[joint]]
name = "arm"
position = "angle_rad"
velocity = "rate_rad_s"
turns = true
"#;

/// What is said of an arm that swings, as far as `reach` says, under a further deceleration, and of which an encoder reads so much more.
fn diagnosed(reach: f64, deceleration: impl Fn(f64, f64) -> f64, more: impl Fn(f64) -> f64) -> Value {
    let noise = Normal::new(0.0, 2e-3).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut data = String::from("run,t_s,encoder_rad\n");
    for (run, begins) in [[1.0, 0.0], [0.5, 0.0], [-0.75, 2.0]].into_iter().enumerate() {
        let mut x = begins.map(|part| reach * part);
        for i in 0..300 {
            let encoder = x[0] + more(x[0]) + noise.sample(&mut rng);
            writeln!(data, "{run},{:.2},{encoder:.5}", 0.02 * f64::from(i)).unwrap();
            follow(&mut x, 0.02, 8, |[x, v]| [*v, -30.0 * x - 0.3 * v - deceleration(*x, *v)]);
        }
    }
    answer(ARM, &data)
}

/// The coefficient of a term of an answer's law, whose 95 % interval holds the truth.
fn assert_coefficient(answer: &Value, term: &str, truth: f64) {
    let coefficients = answer["law"]["coefficients"].as_array().unwrap();
    let name = format!("coefficient of {term}");
    let of = coefficients.iter().find(|c| c["name"].as_str().unwrap().starts_with(&name));
    let interval = &of.unwrap_or_else(|| panic!("{}", answer["law"]))["ci95"];
    let [low, high] = [0, 1].map(|end| interval[end].as_f64().unwrap());
    assert!((low..high).contains(&truth), "{term}: {truth}, {interval}");
    assert!(high - low < 0.2 * truth.abs(), "{term}: {interval}");
}

/// Damping that grows with the deflection (van der Pol) is imitated to 98 % by one that grows with the speed, which the report says, and no more.
#[test]
fn damping_by_the_deflection_is_a_law_and_no_cubic_damping() {
    let answer = diagnosed(1.2, |x, v| 0.8 * x * x * v, |_| 0.0);
    assert_eq!(answer["verdict"], "unexplained");
    assert!(answer["chosen"].as_array().unwrap().is_empty());
    assert_eq!(answer["closest"]["ids"], serde_json::json!(["cubic-damping"]));
    assert_eq!(answer["law"]["coefficients"].as_array().unwrap().len(), 1, "{}", answer["law"]);
    assert_eq!(answer["law"]["adds_to"]["name"], "der(rate_rad_s)");
    assert_coefficient(&answer, "angle_rad^2*rate_rad_s", -0.8);
}

/// An encoder whose disc sits beside the shaft's middle reads a wave of the angle more: that is a law of the reading, and no force.
#[test]
fn an_eccentric_encoder_is_a_law_of_its_reading() {
    let answer = diagnosed(3.0, |_, _| 0.0, |x| 0.03 * (x + 0.9).sin());
    assert_eq!(answer["verdict"], "unexplained");
    assert_eq!(answer["law"]["adds_to"]["name"], "encoder_rad");
    assert_coefficient(&answer, "cos(angle_rad)", 0.03 * 0.9_f64.sin());
}
