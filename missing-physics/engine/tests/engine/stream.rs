//! Runs that arrive one by one: no more false alarms than promised, changes found, named and dated.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use crate::common::{Curve, mechanism, parameter, recording};
use missing_physics::data::{Recording, Run};
use missing_physics::engine::stream::{Look, Watch, What};
use missing_physics::model::{Parameter, Scope, UNBOUNDED};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A line with an offset of each run's own; a bend is the mechanism.
fn model() -> Curve {
    let nuisance = Parameter { scope: Scope::PerRun, ..parameter("offset", 0.0, UNBOUNDED) };
    let parameters = vec![parameter("slope", 1.0, UNBOUNDED), parameter("bend", 0.0, UNBOUNDED), nuisance];
    Curve::new(parameters, vec![mechanism("bend", vec![1])], |p, nuisance, x| {
        nuisance[0] + p[0] * x + p[1] * x * x
    })
}

const ROWS: usize = 16;

/// A run with a slope and a bend; its offset is anything.
fn run(number: usize, sigma: f64, slope: f64, bend: f64, rng: &mut ChaCha8Rng) -> Run {
    let mut normal = || -> f64 { StandardNormal.sample(rng) };
    let offset = 50.0 * normal();
    let x: Vec<f64> = (0..ROWS).map(|i| i as f64 / (ROWS - 1) as f64).collect();
    let y = x.iter().map(|x| offset + slope * x + bend * x * x + sigma * normal()).collect();
    Run { label: format!("{number}"), inputs: vec![x], outputs: vec![y], kind: 0 }
}

fn reference(sigma: f64, rng: &mut ChaCha8Rng) -> Recording {
    recording("x", (0..5).map(|k| run(k, sigma, 2.0, 0.0, rng)).collect(), None)
}

/// The last look of a day of runs with slopes and bends, of which it is stopped at an alarm.
fn day(seed: u64, sigma: f64, runs: impl Iterator<Item = (f64, f64)>) -> Option<Look> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let model = model();
    let mut watch = Watch::new(&model, &reference(sigma, &mut rng), 0.05).unwrap();
    let mut last = None;
    for (k, (slope, bend)) in runs.enumerate() {
        let look = watch.add(&run(5 + k, sigma, slope, bend, &mut rng)).unwrap();
        let alarm = look.alarm.is_some();
        last = Some(look);
        if alarm {
            break;
        }
    }
    last
}

/// 400 days of 30 runs, looked at after each: with a rate of 5 % more than 30 alarms have a probability of 0.6 %.
#[test]
fn looking_after_each_run_keeps_the_false_alarms() {
    let alarms = (0..400)
        .filter(|seed| day(*seed, 0.3, [(2.0, 0.0); 30].into_iter()).unwrap().alarm.is_some())
        .count();
    assert!(alarms <= 30, "{alarms} of 400");
}

/// Nothing assumes a size of the noise: in other units the evidence is the same, within the scale that the model gives its offsets.
#[test]
fn evidence_has_no_unit() {
    let values = [1e-3, 1.0, 3.0].map(|scale| {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let model = model();
        let mut all: Vec<Run> =
            (0..12).map(|k| run(k, 0.3, 2.0, if k > 8 { 1.5 } else { 0.0 }, &mut rng)).collect();
        all.iter_mut().for_each(|run| run.outputs[0].iter_mut().for_each(|y| *y *= scale));
        let mut watch = Watch::new(&model, &recording("x", all[..5].to_vec(), None), 0.05).unwrap();
        all[5..].iter().map(|run| watch.add(run).unwrap().e_value.ln()).last().unwrap()
    });
    assert!(values.iter().all(|v| (v - values[1]).abs() < 0.05 * values[1].abs()), "{values:?}");
}

#[test]
fn a_parameter_that_changes_is_named_and_dated() {
    let slopes = (0..40).map(|k| (if k < 12 { 2.0 } else { 3.0 }, 0.0));
    let look = day(1, 0.3, slopes).unwrap();
    let alarm = look.alarm.unwrap();
    let changed = look.changed.unwrap();
    // The first changed run is number 17.
    assert!((17..25).contains(&alarm) && changed.between.0 <= 17 && 17 <= changed.between.1, "{changed:?}");
    let What::Parameter { name, before, .. } = &changed.what[0].0 else { unreachable!("{changed:?}") };
    assert!(name == "slope" && (before - 2.0).abs() < 0.5);
    let (by, error) = changed.by[0];
    assert!((by - 1.0).abs() < 4.0 * error && error < 0.5, "{by} +- {error}");
}

#[test]
fn a_mechanism_that_begins_is_named() {
    let bends = (0..40).map(|k| (2.0, if k < 10 { 0.0 } else { 6.0 }));
    let look = day(2, 0.3, bends).unwrap();
    let changed = look.changed.unwrap();
    assert!((15..20).contains(&look.alarm.unwrap()));
    let bend =
        changed.what.iter().find(|(what, _)| matches!(what, What::Mechanism { id, .. } if id == "bend"));
    let slope = changed.what.iter().find(|(what, _)| matches!(what, What::Parameter { .. }));
    assert!(bend.unwrap().1 > slope.unwrap().1, "{changed:?}");
}

#[test]
fn a_run_that_is_not_sound_leaves_the_watch_as_it_was() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let model = model();
    let mut watch = Watch::new(&model, &reference(0.3, &mut rng), 0.05).unwrap();
    let good = run(5, 0.3, 2.0, 0.0, &mut rng);
    let mut bad = good.clone();
    bad.inputs[0][3] = f64::NAN;
    let before = watch.add(&good).unwrap();
    assert!(watch.add(&bad).is_err());
    assert_eq!(watch.add(&run(6, 0.3, 2.0, 0.0, &mut rng)).unwrap().run, before.run + 1);
    assert!(Watch::new(&model, &reference(0.3, &mut rng), 0.7).is_err());
}
