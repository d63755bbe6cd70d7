//! What is proposed next.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use crate::common::{Curve, mechanism, parameter, recording};
use missing_physics::data::Run;
use missing_physics::engine::{Options, diagnose};
use missing_physics::model::{Experiment, Parameter, Scope};
use missing_physics::observer::Silent;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

fn run(inputs: Vec<f64>, outputs: Vec<f64>) -> Run {
    Run { label: "1".into(), inputs: vec![inputs], outputs: vec![outputs], kind: 0 }
}

fn experiment(words: &str, x: Vec<f64>) -> Experiment {
    let nothing = vec![0.0; x.len()];
    Experiment {
        action: vec![("x".into(), x[0])],
        words: words.into(),
        runs: vec![run(x, nothing)],
        nuisance: vec![vec![0.0]],
    }
}

/// Rows at one x alone do not tell a slope from an offset that each run has of its own; nor do more of them.
#[test]
fn the_same_again_is_not_proposed_where_it_cannot_tell() {
    const ROWS: usize = 30;
    let slope = parameter("slope", 0.0, [-10.0, 10.0]);
    let offset = Parameter { scope: Scope::PerRun, ..parameter("offset", 0.0, [-10.0, 10.0]) };
    let mechanisms = vec![mechanism("slope", vec![0]), mechanism("offset", vec![1])];
    let model =
        Curve::new(vec![slope, offset], mechanisms, |shared, nuisance, x| nuisance[0] + shared[0] * x);
    let (mut rng, noise) = (ChaCha8Rng::seed_from_u64(3), Normal::new(0.0, 0.1).unwrap());
    let readings = (0..ROWS).map(|_| 1.0 + noise.sample(&mut rng)).collect();
    let recording = recording("x", vec![run(vec![1.0; ROWS], readings)], Some(0.1));
    let options = Options { replicates: 99, ..Options::default() };
    let ask = |list: &[Experiment]| diagnose(&model, &recording, list, &options, &Silent).unwrap();

    let again = experiment("again", vec![1.0; ROWS]);
    let answer = ask(std::slice::from_ref(&again));
    assert_eq!(answer.verdict.word(), "ambiguous");
    assert!(answer.next_experiment.is_none(), "{:?}", answer.next_experiment);
    let other = experiment("elsewhere", (0..ROWS).map(|row| row as f64 / 10.0).collect());
    assert_eq!(ask(&[again, other]).next_experiment.unwrap().words, "elsewhere");
}
