//! Drops of a few impacts in which nothing is hidden.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use missing_physics::engine::{Options, diagnose};
use missing_physics::observer::Silent;
use worlds::physics::bounce::BounceWorld;

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

/// A single drop of six impacts makes null worlds enough to be judged by. Of 60 in which nothing is hidden, three or more at 1 % come by chance in
/// one of forty such tests.
#[test]
fn a_single_drop_is_doubted_no_more_often_than_promised() {
    let world = BounceWorld { runs: 1, noise_known: false, ..BounceWorld::drops() };
    let p: Vec<f64> = (0..60).map(|seed| p_value(&world, 1900 + seed, 399)).collect();
    let [five, one] = [0.05, 0.01].map(|level| p.iter().filter(|p| **p <= level).count());
    println!("{five} at 5 %, {one} at 1 % of {}", p.len());
    assert!(five < 9 && one < 3, "{five} at 5 %, {one} at 1 % of {}", p.len());
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
