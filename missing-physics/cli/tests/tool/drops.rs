//! Drops of a few impacts in which nothing is hidden.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use missing_physics::engine::{Options, diagnose};
use missing_physics::observer::Silent;
use worlds::physics::bounce::BounceWorld;

fn p_value(world: &BounceWorld, seed: u64) -> f64 {
    let folder = tempfile::tempdir().unwrap();
    let [header, data] = world.files(seed);
    std::fs::write(folder.path().join("recording.toml"), header).unwrap();
    std::fs::write(folder.path().join("data.csv"), data).unwrap();
    let (_, loaded) = missing_physics_domains::load(folder.path()).unwrap();
    let options = Options { seed, replicates: 99, ..Options::default() };
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
    let p: Vec<f64> = (0..40).map(|seed| p_value(&world, 900 + seed)).collect();
    let alarms = p.iter().filter(|p| **p <= 0.05).count();
    println!("{alarms} of {}", p.len());
    assert!(alarms < 7, "{alarms} of {}", p.len());
}
