//! A clock that is off, over drops from a known height.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use missing_physics::engine::{Options, diagnose};
use missing_physics::observer::Silent;
use worlds::physics::bounce::{BounceWorld, Effects};

/// Times that are all 2 % too long make balls seem to come faster than they can have fallen: not because they come aslant, though
/// where they come from is fitted with the rest.
#[test]
fn a_clock_is_not_taken_for_balls_that_come_aslant() {
    let rate = 0.02;
    let effects = Effects { clock_rate: rate, ..Effects::default() };
    let world =
        BounceWorld { height_known: true, noise: [3e-5, 5e-4], effects, runs: 15, ..BounceWorld::drops() };
    for seed in [500, 501] {
        let folder = tempfile::tempdir().unwrap();
        let [header, data] = world.files(seed);
        std::fs::write(folder.path().join("recording.toml"), header).unwrap();
        std::fs::write(folder.path().join("data.csv"), data).unwrap();
        let (_, loaded) = missing_physics_domains::load(folder.path()).unwrap();
        let options = Options { replicates: 49, ..Options::default() };
        let answer =
            diagnose(&*loaded.model, &loaded.recording, &loaded.experiments, &options, &Silent).unwrap();
        assert!(answer.chosen.iter().any(|id| id == "clock-rate"), "{:?}", answer.chosen);
        let found = answer.mechanisms.iter().find(|m| m.id == "clock-rate").unwrap();
        let value = &found.parameters[0];
        let sigma = (value.ci95[1] - value.ci95[0]) / 3.92;
        assert!(sigma < 1e-3 && (value.value - rate).abs() < 4.0 * sigma, "{} +- {sigma}", value.value);
    }
}
