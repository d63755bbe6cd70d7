//! Readings that were taken as they changed, each at a moment of its own.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::f64::consts::PI;
use std::fmt::Write as _;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

use super::simulated::{answer, answer_in, interval};

const FLYWHEEL: &str = r#"
[model]
states = { angle_rad = "rate_rad_s", rate_rad_s = "-damping_per_s*rate_rad_s" }
outputs = { wheel_rad = "angle_rad" }
[[parameter]]
name = "damping_per_s"
unit = "1/s"
start = 0.1
[[joint]]
name = "flywheel"
position = "angle_rad"
velocity = "rate_rad_s"
"#;

/// Three magnets on a flywheel that coasts in the air, by the closed form of quadratic damping: a third of a turn between two ticks is no error of
/// an encoder's.
#[test]
fn the_damping_of_a_wheel_is_found_from_the_times_of_its_ticks() {
    let (mut rng, coefficient) = (ChaCha8Rng::seed_from_u64(3), 1.2e-3_f64);
    let mut data = String::from("run,t_s,wheel_rad\n");
    for run in 0..4 {
        let rate_rad_s: f64 = rng.random_range(80.0..95.0);
        for tick in 0..90 {
            let angle_rad = f64::from(tick) * 2.0 * PI / 3.0;
            let noise: f64 = StandardNormal.sample(&mut rng);
            let t_s = ((coefficient * angle_rad).exp() - 1.0) / (coefficient * rate_rad_s) + 1e-5 * noise;
            writeln!(data, "{run},{t_s:.6},{angle_rad:.6}").unwrap();
        }
    }
    let answer = answer(FLYWHEEL, &data);
    let names = format!("{}{}", answer["chosen"], answer["confused_with"]);
    assert!(names.contains("quadratic-damping"), "{}: {names}", answer["verdict"]);
    let found = interval(&answer, "quadratic-damping");
    assert!(found.contains(&coefficient) && found.end - found.start < 0.2 * coefficient, "{found:?}");
}

/// A drum that coasts for 240 turns, one tick a turn, by the closed form of viscous and dry friction: what rows so far apart cannot show, and a spring
/// that would be wound up so often, are not asked for.
#[test]
fn a_drum_that_turns_many_times_between_its_rows_rubs() {
    let (mut rng, level, damping) = (ChaCha8Rng::seed_from_u64(5), 0.011_f64, 1e-3_f64);
    let mut data = String::from("run,t_s,wheel_rad\n");
    for run in 0..3 {
        let rate_rad_s: f64 = rng.random_range(7.0..8.0);
        let limit = level / damping;
        let angle_rad =
            |t_s: f64| (rate_rad_s + limit) * (1.0 - (-damping * t_s).exp()) / damping - limit * t_s;
        let rest_s = (1.0 + rate_rad_s / limit).ln() / damping;
        for turn in 0..240 {
            let wanted = f64::from(turn) * 2.0 * PI;
            let [mut before, mut after] = [0.0, rest_s];
            for _ in 0..60 {
                let middle = 0.5 * (before + after);
                if angle_rad(middle) < wanted { before = middle } else { after = middle }
            }
            let noise: f64 = StandardNormal.sample(&mut rng);
            writeln!(data, "{run},{:.6},{wanted:.6}", (before + 1e-4 * noise).max(0.0)).unwrap();
        }
    }
    let answer = answer(&format!("{FLYWHEEL}turns = true\n"), &data);
    // A wheel that never turns back does not tell dry friction from a constant force.
    let names = format!("{}{}", answer["chosen"], answer["confused_with"]);
    assert!(
        names.contains("coulomb-friction") && names.contains("constant-force"),
        "{}: {names}",
        answer["verdict"]
    );
    let found = interval(&answer, "coulomb-friction");
    assert!(found.contains(&level) && found.end - found.start < 0.02 * level, "{found:?}");
    let known: Vec<&str> =
        answer["mechanisms"].as_array().unwrap().iter().map(|m| m["id"].as_str().unwrap()).collect();
    for none in ["cogging", "hysteresis", "stiffness", "cubic-stiffness"] {
        assert!(!known.contains(&none), "{known:?}");
    }
}

/// A fence of bars that falls through a light gate.
#[test]
fn the_bars_of_a_fence_are_where_they_are() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let mut data = String::from("run,t_s,z_m\n");
    for run in 0..5 {
        let speed: f64 = rng.random_range(0.3..0.8);
        for bar in 0..12 {
            let fallen = 0.05 * f64::from(bar);
            let noise: f64 = StandardNormal.sample(&mut rng);
            let t_s = ((speed * speed + 2.0 * 9.806_65 * fallen).sqrt() - speed) / 9.806_65 + 5e-5 * noise;
            writeln!(data, "{run},{:.6},{:.2}", t_s.max(0.0), -fallen).unwrap();
        }
    }
    let answer = answer_in("trajectory", "", &data);
    assert_eq!(answer["verdict"], "adequate");
    let sigma = answer["noise"][0]["sigma"].as_f64().unwrap();
    assert!(sigma < 3e-4, "{sigma}");
}
