//! Parameters of a run that stand at a bound.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use crate::common::{Ball, World};
use missing_physics::data::Recording;
use missing_physics::diagnosis::Verdict;
use missing_physics::engine::{Options, diagnose};
use missing_physics::observer::Silent;

/// Balls thrown from the floor: noise would have half of the runs begin below it.
fn from_the_floor(world: World, seed: u64) -> Recording {
    let exact = World { sigma: 0.0, ..world }.draw(seed);
    let mut recording = world.draw(seed);
    for (run, exact) in recording.runs.iter_mut().zip(&exact.runs) {
        run.outputs[0].iter_mut().for_each(|z| *z -= exact.outputs[0][0]);
    }
    recording
}

#[test]
fn runs_that_begin_at_a_bound_are_fitted_and_judged_as_others() {
    let model = Ball::over_floor();
    let options = Options { replicates: 199, ..Options::default() };
    let world = World { runs: 8, sigma: 0.02, ..World::NULL };
    let mut alarms = 0;
    for seed in 0..12 {
        let null = diagnose(&model, &from_the_floor(world, seed), &[], &options, &Silent).unwrap();
        alarms += usize::from(null.verdict != Verdict::Adequate);
        let dragged = World { linear_drag: 0.3, ..world };
        let answer = diagnose(&model, &from_the_floor(dragged, seed), &[], &options, &Silent).unwrap();
        assert_eq!(answer.chosen, ["linear-drag"], "seed {seed}");
        for words in null.undetermined.iter().chain(&answer.undetermined) {
            assert!(!words.contains("converge"), "seed {seed}: {words}");
        }
    }
    assert!(alarms <= 3, "{alarms} alarms in 12 worlds at 5 %");
}
