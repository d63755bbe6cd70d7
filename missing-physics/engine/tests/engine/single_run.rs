//! A single run in which one effect dies away within the first rows.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use crate::common::{Curve, mechanism, parameter, recording};
use missing_physics::data::Run;
use missing_physics::diagnosis::{Diagnosis, Verdict};
use missing_physics::engine::{Options, diagnose};
use missing_physics::observer::Silent;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

const SIGMA: f64 = 0.01;

/// A level, a wave over the whole run, and a ringing that lasts for a few hundredths of it.
fn curve(shared: &[f64], _: &[f64], x: f64) -> f64 {
    shared[0] + shared[1] * (9.0 * x).sin() + shared[2] * (-x / 0.03).exp() * (120.0 * x).cos()
}

/// The answer where a smooth effect of a size that no mechanism has stands beside the two.
fn answer(leftover: f64, seed: u64) -> Diagnosis {
    let free = |name: &str| parameter(name, 0.0, [-10.0, 10.0]);
    let mechanisms = vec![mechanism("wave", vec![1]), mechanism("ringing", vec![2])];
    let model = Curve::new(vec![free("level"), free("wave"), free("ringing")], mechanisms, curve);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let x: Vec<f64> = (0..500).map(|i| f64::from(i) / 499.0).collect();
    let measured = |x: &f64| {
        let noise: f64 = StandardNormal.sample(&mut rng);
        curve(&[1.0, 0.5, 2.0], &[], *x) + leftover * (23.0 * x + 1.0).sin() + SIGMA * noise
    };
    let y = x.iter().map(measured).collect();
    let run = Run { label: "1".into(), inputs: vec![x], outputs: vec![y], kind: 0 };
    let options = Options { replicates: 199, seed, ..Options::default() };
    diagnose(&model, &recording("x", vec![run], Some(SIGMA)), &[], &options, &Silent).unwrap()
}

#[test]
fn what_dies_away_early_is_named_beside_a_leftover() {
    let answer = answer(0.05, 1);
    assert_eq!(
        (answer.verdict, &answer.chosen[..]),
        (Verdict::Partly, &["wave".into(), "ringing".into()][..])
    );
    assert!(!answer.leftover.is_empty() && answer.explained_share.is_some_and(|share| share > 0.9));
    // Left out with the whole first fifth, the ringing is not foretold, and that is said.
    let far = answer.remarks.iter().find(|r| r.contains("whole fifths left out")).unwrap();
    assert!(far.starts_with("wave with ringing: "), "{far}");
    for (mechanism, truth) in [("wave", 0.5), ("ringing", 2.0)] {
        let found = answer.mechanisms.iter().find(|m| m.id == mechanism).unwrap();
        let [low, high] = found.parameters[0].ci95;
        assert!(low < truth && truth < high, "{mechanism}: {low} {high}");
    }
}

#[test]
fn what_no_mechanism_does_is_not_named_for_its_closeness_to_what_is_seen() {
    let answer = answer(1.0, 1);
    assert_eq!(answer.verdict, Verdict::Unexplained, "{:?}", answer.chosen);
}
