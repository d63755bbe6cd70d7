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
