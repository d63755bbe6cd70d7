//! A likelihood with many tops: the highest is found, and an interval reaches to those that are as likely.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test stops where it fails")]

use crate::common::{Curve, mechanism, parameter, recording};
use missing_physics::data::{Recording, Run};
use missing_physics::engine::{Options, diagnose};
use missing_physics::observer::Silent;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// A slope that comes with a ripple of its own: one top every 0.1 of it.
fn rippled(slope: f64, t: f64) -> f64 {
    slope * t + 0.03 * (60.0 * slope).sin()
}

/// The plain slope: a top or two off.
fn plain_slope(runs: &[Run]) -> Vec<Vec<(usize, f64)>> {
    let sum = |f: fn(f64, f64) -> f64| -> f64 {
        runs.iter().flat_map(|r| r.inputs[0].iter().zip(&r.outputs[0])).map(|(t, y)| f(*t, *y)).sum()
    };
    vec![vec![(0, sum(|t, y| t * y) / sum(|t, _| t * t))]]
}

fn draw(slope: f64, seed: u64) -> Recording {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let noise = Normal::new(0.0, 0.1).unwrap();
    let times: Vec<f64> = (0..30).map(|i| f64::from(i) / 29.0).collect();
    let run = |label: &str, rng: &mut ChaCha8Rng| Run {
        label: label.into(),
        inputs: vec![times.clone()],
        outputs: vec![times.iter().map(|t| rippled(slope, *t) + noise.sample(rng)).collect()],
        kind: 0,
    };
    recording("t_s", vec![run("1", &mut rng), run("2", &mut rng)], Some(0.1))
}

#[test]
fn the_interval_holds_the_truth_on_whichever_top_it_is() {
    let slope = parameter("slope", 0.0, [0.0, 10.0]);
    let model = Curve::new(vec![slope], vec![mechanism("slope", vec![0])], |s, _, t| rippled(s[0], t))
        .from(plain_slope);
    let options = Options { replicates: 199, ..Options::default() };
    let worlds = 60;
    let held = (0..worlds)
        .filter(|&seed| {
            let slope = 0.5 + 0.013 * seed as f64;
            let answer = diagnose(&model, &draw(slope, seed), &[], &options, &Silent).unwrap();
            let interval = answer.mechanisms[0].parameters[0].ci95;
            answer.chosen == ["slope"] && (interval[0]..=interval[1]).contains(&slope)
        })
        .count();
    println!("{held} of {worlds} intervals hold");
    // The 0.5 % point of a binomial law of 60 trials at 95 %.
    assert!(held >= 52, "{held} of {worlds}");
}
