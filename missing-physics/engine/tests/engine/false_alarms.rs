//! The promised rate of false alarms, on worlds in which nothing is wrong.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use crate::common::{Ball, World, mechanism, parameter};
use missing_physics::data::{Recording, Run};
use missing_physics::diagnosis::Verdict;
use missing_physics::engine::{Options, diagnose};
use missing_physics::model::{Model, PredictError, Quantity, Spec};
use missing_physics::observer::Silent;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use statrs::distribution::{Binomial, DiscreteCDF};

const WORLDS: u64 = 300;

/// Counts p-values at or below a level and compares the count with the binomial law of that level, at 1 in 1,000.
fn holds(world: World) {
    holds_in(world, WORLDS);
}

fn holds_in(world: World, worlds: u64) {
    holds_of(&Ball::default(), |seed| world.draw(1000 + seed), worlds);
}

/// The same of a model, and of worlds by seed.
fn holds_of(model: &dyn Model, world: impl Fn(u64) -> Recording, worlds: u64) {
    let options = Options { replicates: 199, ..Options::default() };
    let p: Vec<f64> = (0..worlds)
        .map(|seed| {
            let options = Options { seed, ..options.clone() };
            let answer = diagnose(model, &world(seed), &[], &options, &Silent).unwrap();
            assert_eq!(answer.verdict == Verdict::Adequate, answer.p_value > 0.05);
            answer.p_value
        })
        .collect();
    for level in [0.01, 0.05, 0.2, 0.5] {
        let alarms = p.iter().filter(|p| **p <= level + 1e-12).count() as u64;
        let law = Binomial::new(level, worlds).unwrap();
        println!("level {level}: {alarms} alarms in {worlds} worlds");
        assert!(law.cdf(alarms) > 5e-4, "too few alarms at {level}: {alarms}");
        assert!(alarms == 0 || law.sf(alarms - 1) > 5e-4, "too many alarms at {level}: {alarms}");
    }
}

#[test]
fn white_noise() {
    holds(World::NULL);
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_coloured_noise() {
    holds(World { phi: 0.7, ..World::NULL });
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_quantised_noise() {
    holds(World { digit: 0.01, ..World::NULL });
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_faintly_coloured_noise() {
    holds(World { phi: 0.3, ..World::NULL });
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_one_reading_in_a_hundred_is_wild() {
    holds(World { wild: 0.01, ..World::NULL });
}

/// So many rows show a correlation to a hundredth: it must be met that well, and lies between round numbers.
#[test]
#[ignore = "long: .ci/run --long"]
fn long_many_rows_of_coloured_noise() {
    holds_in(World { rows: 1000, phi: 0.5, ..World::NULL }, 40);
}

/// The least rows that are accepted, and some more: one run of a free fall with two unknowns and an unknown noise.
#[test]
fn one_run_of_a_few_rows() {
    one_run_of([4, 6]);
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_one_run_of_some_more_rows() {
    one_run_of([5, 8, 12]);
}

fn one_run_of(numbers_of_rows: impl IntoIterator<Item = usize>) {
    for rows in numbers_of_rows {
        println!("{rows} rows");
        holds(World { runs: 1, rows, ..World::NULL });
    }
}

/// Two sensors: a level, and a wave that eight mechanisms act on, each of them a wave of another length.
struct TwoSensors(Spec);

impl TwoSensors {
    const MECHANISMS: usize = 8;

    fn new() -> Self {
        let sizes = (0..Self::MECHANISMS).map(|k| parameter(&format!("size_{k}"), 0.0, [-10.0, 10.0]));
        let baseline = ["level", "wave"].map(|name| parameter(name, 0.5, [-10.0, 10.0]));
        Self(Spec {
            baseline: "a level and a wave".into(),
            parameters: baseline.into_iter().chain(sizes).collect(),
            mechanisms: (0..Self::MECHANISMS).map(|k| mechanism(&format!("wave-{k}"), vec![2 + k])).collect(),
            ..Spec::default()
        })
    }
}

impl Model for TwoSensors {
    fn spec(&self) -> &Spec {
        &self.0
    }

    fn predict(&self, run: &Run, shared: &[f64], _: &[f64], out: &mut [f64]) -> Result<(), PredictError> {
        let (level, wave) = out.split_at_mut(run.len());
        level.fill(shared[0]);
        for (wave, t) in wave.iter_mut().zip(&run.inputs[0]) {
            let sizes = shared[2..].iter().zip(2..);
            *wave = shared[1] * t.cos() + sizes.map(|(size, k)| size * (f64::from(k) * t).cos()).sum::<f64>();
        }
        Ok(())
    }
}

/// A sensor of which mechanisms, or curves, take away all that a few rows leave, beside another one that has rows to spare; both print many
/// digits.
#[test]
fn a_few_rows_of_a_sensor_that_all_mechanisms_act_on() {
    all_mechanisms_act_on_rows_of_a_sensor([7]);
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_some_more_rows_of_a_sensor_that_all_mechanisms_act_on() {
    all_mechanisms_act_on_rows_of_a_sensor([8, 9, 12]);
}

fn all_mechanisms_act_on_rows_of_a_sensor(numbers_of_rows: impl IntoIterator<Item = usize>) {
    let digits = 1e-7_f64;
    let world = |seed: u64, rows: usize| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let times: Vec<f64> = (0..rows).map(|i| 2.0 * i as f64 / (rows - 1) as f64).collect();
        let mut read = |v: f64| {
            let noise: f64 = StandardNormal.sample(&mut rng);
            ((v + 1e-3 * noise) / digits).round() * digits
        };
        let level = times.iter().map(|_| read(0.7)).collect();
        let wave = times.iter().map(|t| read(0.3 * t.cos())).collect();
        Recording {
            channels: vec![Quantity::new("level", ""), Quantity::new("wave", "")],
            variables: vec![Quantity::new("t_s", "s")],
            runs: vec![Run { label: "1".into(), inputs: vec![times], outputs: vec![level, wave], kind: 0 }],
            noise_along: Some(0),
            calibration: vec![None, None],
            resolution: vec![digits, digits],
        }
    };
    for rows in numbers_of_rows {
        println!("{rows} rows");
        holds_of(&TwoSensors::new(), |seed| world(seed, rows), WORLDS);
    }
}
