//! A parameter at whose values predictions jump: the likelihood is a stair.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use crate::common::{mechanism, parameter, recording};
use missing_physics::data::{Recording, Run};
use missing_physics::engine::{Options, diagnose};
use missing_physics::model::{Extensions, Model, MultimodalModel, PredictError, Spec};
use missing_physics::observer::Silent;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

/// Readings of 1 at forces from a threshold on, of 0 below, with a slope to follow that is short beside the distance of rows.
struct Threshold {
    spec: Spec,
    forces: Vec<f64>,
}

const ROWS: usize = 40;
const WIDTH: f64 = 0.1 / ROWS as f64;

impl Model for Threshold {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn predict(&self, run: &Run, shared: &[f64], _: &[f64], out: &mut [f64]) -> Result<(), PredictError> {
        let grip = |force: f64| 1.0 / (1.0 + ((shared[0] - force) / WIDTH).exp());
        out.iter_mut().zip(&run.inputs[0]).for_each(|(y, force)| *y = grip(*force));
        Ok(())
    }

    fn extensions(&self) -> Extensions<'_> {
        Extensions { modes: Some(self), ..Extensions::default() }
    }
}

impl MultimodalModel for Threshold {
    fn starts(&self, _: usize, _: &[Run], _: &[Vec<Vec<f64>>]) -> Vec<Vec<(usize, f64)>> {
        self.forces.windows(2).map(|w| vec![(0, 0.5 * (w[0] + w[1]))]).collect()
    }

    fn jumps(&self, _: usize) -> &[f64] {
        &self.forces
    }
}

fn forces() -> Vec<f64> {
    (0..=ROWS).map(|row| row as f64 / ROWS as f64).collect()
}

fn world(seed: u64) -> (f64, Recording) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let threshold = rng.random_range(0.3..0.7);
    let run = |label: usize| {
        let forces = forces();
        let noise = |_: &f64| -> f64 { StandardNormal.sample(&mut rng) };
        let noise: Vec<f64> = forces.iter().map(noise).collect();
        let reading = |(force, noise): (&f64, &f64)| f64::from(*force >= threshold) + 0.6 * noise;
        let outputs = vec![forces.iter().zip(&noise).map(reading).collect()];
        Run { label: label.to_string(), inputs: vec![forces], outputs, kind: 0 }
    };
    (threshold, recording("force", (0..2).map(run).collect(), Some(0.6)))
}

/// One row is hardly more than its noise, so that several treads are likely.
#[test]
fn the_interval_of_a_threshold_is_of_whole_treads_and_holds_it() {
    const WORLDS: u64 = 100;
    let (mut named, mut held, mut width) = (0, 0, 0.0);
    for seed in 0..WORLDS {
        let (threshold, recording) = world(seed);
        let spec = Spec {
            parameters: vec![parameter("threshold", 0.0, [0.0, 1.0])],
            mechanisms: vec![mechanism("slip", vec![0])],
            ..Spec::default()
        };
        let model = Threshold { spec, forces: forces() };
        let options = Options { replicates: 99, seed, ..Options::default() };
        let answer = diagnose(&model, &recording, &[], &options, &Silent).unwrap();
        if answer.chosen != ["slip"] {
            continue;
        }
        let slip = answer.mechanisms.iter().find(|m| m.id == "slip").unwrap();
        let [low, high] = slip.parameters[0].ci95;
        assert!([low, high].iter().all(|end| forces().contains(end)), "{low} to {high}");
        named += 1;
        width += high - low;
        held += u32::from(low <= threshold && threshold <= high);
    }
    println!("{held} of {named}, {:.3} wide on average", width / f64::from(named));
    assert!(named >= 80 && f64::from(held) >= 0.9 * f64::from(named), "{held} of {named}");
    assert!(width / f64::from(named) < 0.3, "{width}");
}
