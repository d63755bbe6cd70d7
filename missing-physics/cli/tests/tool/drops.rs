//! Drops of a few impacts in which nothing is hidden.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use std::fmt::Write as _;

use missing_physics::engine::{Options, diagnose};
use missing_physics::observer::Silent;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use worlds::physics::bounce::BounceWorld;

use super::simulated::{answer_in, interval};

fn p_value(world: &BounceWorld, seed: u64, replicates: usize) -> f64 {
    let folder = tempfile::tempdir().unwrap();
    let [header, data] = world.files(seed);
    std::fs::write(folder.path().join("recording.toml"), header).unwrap();
    std::fs::write(folder.path().join("data.csv"), data).unwrap();
    let (_, loaded) = missing_physics_domains::load(folder.path()).unwrap();
    let options = Options { seed, replicates, ..Options::default() };
    diagnose(&*loaded.model, &loaded.recording, &[], &options, &Silent).unwrap().p_value
}

/// A restitution that scatters by a hundredth from impact to impact moves all later impacts of its drop: that is no physics that is
/// missing. Seven or more alarms of 40 at 5 % come by chance in one of three hundred such tests.
#[test]
fn a_restitution_that_scatters_is_noise() {
    let world = BounceWorld {
        runs: 8,
        impacts: 6,
        placed: false,
        noise_known: false,
        restitution_scatter: 0.01,
        ..BounceWorld::drops()
    };
    let p: Vec<f64> = (0..40).map(|seed| p_value(&world, 900 + seed, 99)).collect();
    let alarms = p.iter().filter(|p| **p <= 0.05).count();
    println!("{alarms} of {}", p.len());
    assert!(alarms < 7, "{alarms} of {}", p.len());
}

/// Thirty drops of a ball that is slowed by the air and gives back a part of its speed that wanders by half a hundredth, alike by a half at impacts that
/// follow each other; times are marked to a third of a millisecond.
fn wandering(k_per_m: f64, seed: u64) -> serde_json::Value {
    let (g, mut rng) = (9.806_65_f64, ChaCha8Rng::seed_from_u64(seed));
    let mut normal = move || -> f64 { StandardNormal.sample(&mut rng) };
    let mut data = String::from("run,bounce,t_s\n");
    for run in 0..30 {
        let (mut speed, mut t, mut wanders) = (1.5 + 0.05 * f64::from(run % 10), 0.0, 0.005 * normal());
        for bounce in 0..8 {
            writeln!(data, "{run},{bounce},{:.6}", t + 3e-4 * normal()).unwrap();
            speed *= 0.9 * f64::exp(wanders);
            wanders = 0.5 * wanders + 0.75_f64.sqrt() * 0.005 * normal();
            // Up and down again with quadratic drag, in closed form.
            let u = speed * (k_per_m / g).sqrt();
            t += (u.atan() + u.asinh()) / (k_per_m * g).sqrt();
            speed /= (1.0 + u * u).sqrt();
        }
    }
    answer_in("bounce", "", &data)
}

/// Of 20 recordings, five or more at 5 % come by chance in one of four hundred such tests.
#[test]
fn a_restitution_that_wanders_is_noise() {
    let p: Vec<f64> = (0..20).map(|seed| wandering(1e-9, 30 + seed)["p_value"].as_f64().unwrap()).collect();
    let alarms = p.iter().filter(|p| **p <= 0.05).count();
    println!("{alarms} of {}", p.len());
    assert!(alarms < 5, "{p:?}");
}

#[test]
fn drag_is_found_where_a_restitution_wanders() {
    let answers: Vec<serde_json::Value> = (0..10).map(|seed| wandering(0.12, 60 + seed)).collect();
    let named = answers.iter().filter(|answer| {
        let names = format!("{}{}", answer["chosen"], answer["confused_with"]);
        names.contains("air-drag") && interval(answer, "air-drag").contains(&0.12)
    });
    let named = named.count();
    println!("{named} of 10");
    assert!(named >= 9, "{named}");
}

/// A single drop of six impacts makes null worlds enough to be judged by. Of 15 in which nothing is hidden, two or more at 1 % come by chance in
/// one of a hundred such tests.
#[test]
fn a_single_drop_is_doubted_no_more_often_than_promised() {
    single_drops_are_doubted_less_often_than(15, [4, 2]);
}

/// Of 60 three or more at 1 % come by chance in one of forty such tests.
#[test]
#[ignore = "long: .ci/run --long"]
fn long_single_drops_are_doubted_no_more_often_than_promised() {
    single_drops_are_doubted_less_often_than(60, [9, 3]);
}

fn single_drops_are_doubted_less_often_than(worlds: u64, at_levels: [usize; 2]) {
    let world = BounceWorld { runs: 1, noise_known: false, ..BounceWorld::drops() };
    let p: Vec<f64> = (0..worlds).map(|seed| p_value(&world, 1900 + seed, 199)).collect();
    let [five, one] = [0.05, 0.01].map(|level| p.iter().filter(|p| **p <= level).count());
    println!("{five} at 5 %, {one} at 1 % of {}", p.len());
    assert!(five < at_levels[0] && one < at_levels[1], "{five} at 5 %, {one} at 1 % of {}", p.len());
}

/// What a sheet of paper falls like, by the closed form of quadratic drag: its terminal speed is half a metre a second.
#[test]
fn a_light_thing_that_falls_has_its_drag() {
    let (g, k) = (9.80665_f64, 40.0);
    let mut data = String::from("run,t_s,z_m\n");
    for run in 1..=3 {
        for i in 0..40 {
            let (t, noise) = (0.02 * f64::from(i), f64::from((i * 7919 + run * 104_729) % 13) - 6.0);
            let z = 1.0 - ((g * k).sqrt() * t).cosh().ln() / k + 1e-4 * noise;
            data += &format!("{run},{t:.3},{z:.6}\n");
        }
    }
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("recording.toml"),
        "format = 1\ndomain = \"trajectory\"\ndata = \"data.csv\"\n",
    )
    .unwrap();
    std::fs::write(folder.path().join("data.csv"), data).unwrap();
    let (_, loaded) = missing_physics_domains::load(folder.path()).unwrap();
    let options = Options { replicates: 199, ..Options::default() };
    let answer = diagnose(&*loaded.model, &loaded.recording, &[], &options, &Silent).unwrap();
    assert_eq!(answer.chosen, ["quadratic-drag"]);
    let drag = &answer.mechanisms.iter().find(|m| m.id == "quadratic-drag").unwrap().parameters[0];
    assert!((drag.value - k).abs() < 0.05 * k, "{drag:?}");
}
