//! A likelihood with many tops: the highest is found, and an interval reaches to those that are as likely.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test stops where it fails")]

use missing_physics::data::{Recording, Run};
use missing_physics::engine::{Options, diagnose};
use missing_physics::model::{Mechanism, Model, Parameter, PredictError, Quantity, Scope, Spec};
use missing_physics::observer::Silent;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// A slope that comes with a ripple of its own: `y = a t + 0.03 sin(60 a)`, one top every 0.1 of a.
struct Rippled(Spec);

fn rippled(a: f64, t: f64) -> f64 {
    a * t + 0.03 * (60.0 * a).sin()
}

impl Rippled {
    fn new() -> Self {
        let slope = Parameter {
            name: "slope".into(),
            unit: String::new(),
            scope: Scope::Shared,
            start: 0.0,
            lower: 0.0,
            upper: 10.0,
            scale: 1.0,
        };
        let mechanism = Mechanism { id: "slope".into(), parameters: vec![0], ..Mechanism::default() };
        Self(Spec { parameters: vec![slope], mechanisms: vec![mechanism], ..Spec::default() })
    }
}

impl Model for Rippled {
    fn spec(&self) -> &Spec {
        &self.0
    }

    fn predict(&self, run: &Run, shared: &[f64], _: &[f64], out: &mut [f64]) -> Result<(), PredictError> {
        out.iter_mut().zip(&run.inputs[0]).for_each(|(y, t)| *y = rippled(shared[0], *t));
        Ok(())
    }

    /// The plain slope: a top or two off.
    fn starts(&self, _: usize, runs: &[Run], _: &[Vec<Vec<f64>>]) -> Vec<Vec<(usize, f64)>> {
        let sum = |f: fn(f64, f64) -> f64| -> f64 {
            runs.iter().flat_map(|r| r.inputs[0].iter().zip(&r.outputs[0])).map(|(t, y)| f(*t, *y)).sum()
        };
        vec![vec![(0, sum(|t, y| t * y) / sum(|t, _| t * t))]]
    }
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
    Recording {
        channels: vec![Quantity::new("y", "m")],
        variables: vec![Quantity::new("t_s", "s")],
        noise_along: Some(0),
        calibration: vec![Some(0.1)],
        resolution: vec![0.0],
        runs: vec![run("1", &mut rng), run("2", &mut rng)],
    }
}

#[test]
fn the_interval_holds_the_truth_on_whichever_top_it_is() {
    let model = Rippled::new();
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
