//! A simulator with chance in it: balls that bounce with a restitution that scatters, seen through statistics.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use crate::common::{mechanism, parameter};
use missing_physics::data::Run;
use missing_physics::diagnosis::{Diagnosis, Verdict};
use missing_physics::engine::{Options, diagnose};
use missing_physics::likelihood::{Likelihood, Scores};
use missing_physics::model::{Parameter, PredictError, Quantity, Spec};
use missing_physics::observer::Silent;
use missing_physics::synthetic::{Simulator, Synthetic, SyntheticError};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, Uniform};

/// Intervals between bounces: t_{i+1} = e_i t_i, e_i = e - slope (v_i - 1) + scatter. Statistics: mean log ratio of the
/// first and of the last four intervals, and the log of the first interval.
#[derive(Debug)]
struct Bounces(Spec, Vec<Quantity>);

const G: f64 = 9.80665;

impl Bounces {
    fn new() -> Self {
        let spec = Spec {
            baseline: "one restitution for every bounce".into(),
            parameters: vec![
                Parameter { scale: 0.05, ..parameter("e", 0.8, [0.3, 0.99]) },
                Parameter { scale: 0.02, ..parameter("slope_s_m", 0.0, [-0.2, 0.2]) },
            ],
            mechanisms: vec![mechanism("velocity-dependent-restitution", vec![1])],
            terms: vec![],
        };
        Self(spec, ["early", "late", "first"].map(|n| Quantity::new(n, "")).to_vec())
    }
}

impl Simulator for Bounces {
    fn spec(&self) -> &Spec {
        &self.0
    }
    fn statistics(&self) -> &[Quantity] {
        &self.1
    }
    fn simulate(
        &self,
        run: &Run,
        shared: &[f64],
        _nuisance: &[f64],
        rng: &mut dyn Rng,
        out: &mut [f64],
    ) -> Result<(), PredictError> {
        let mut speed = (2.0 * G * run.inputs[0][0]).sqrt();
        let mut logs = Vec::new();
        for _ in 0..8 {
            let z: f64 = StandardNormal.sample(rng);
            let e = (shared[0] - shared[1] * (speed - 1.0) + 0.01 * z).clamp(0.05, 1.0);
            logs.push(e.ln());
            speed *= e;
        }
        out[0] = logs[..4].iter().sum::<f64>() / 4.0;
        out[1] = logs[4..].iter().sum::<f64>() / 4.0;
        out[2] = logs[0];
        Ok(())
    }
}

fn observed(slope: f64, seed: u64) -> Vec<(Run, Vec<f64>)> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..8)
        .map(|i| {
            let height = 0.3 + 0.1 * f64::from(i);
            let run = Run { label: format!("{i}"), inputs: vec![vec![height]], outputs: vec![], kind: 0 };
            let mut out = vec![0.0; 3];
            Bounces::new().simulate(&run, &[0.83, slope], &[], &mut rng, &mut out).unwrap();
            (run, out)
        })
        .collect()
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_no_slope_of_the_restitution_is_found_where_there_is_none() {
    let mut alarms = 0;
    for seed in 0..40 {
        let (model, recording) = Synthetic::new(Bounces::new(), &observed(0.0, seed), 200, 9).unwrap();
        let options = Options { replicates: 99, seed, ..Options::default() };
        let answer = diagnose(&model, &recording, &[], &options, &Silent).unwrap();
        alarms += u32::from(answer.verdict != Verdict::Adequate);
    }
    println!("{alarms} alarms in 40 null worlds");
    // More than 7 of 40 happen in 1 of 1,000 at a rate of 5 %.
    assert!(alarms <= 7, "{alarms}");
}

#[test]
fn a_slope_of_the_restitution_is_found() {
    let (model, recording) = Synthetic::new(Bounces::new(), &observed(0.03, 5), 200, 9).unwrap();
    let answer = diagnose(&model, &recording, &[], &Options::default(), &Silent).unwrap();
    assert_eq!((answer.verdict, answer.chosen.len()), (Verdict::Explained, 1));
    let slope = &answer.mechanisms[0].parameters[0];
    assert!(slope.ci95[0] < 0.03 && 0.03 < slope.ci95[1], "{slope:?}");
}

#[test]
fn too_few_draws_are_refused() {
    let error = Synthetic::new(Bounces::new(), &observed(0.0, 1), 20, 9).unwrap_err();
    assert_eq!(error, SyntheticError::TooFewDraws { draws: 20, statistics: 3, expected: 30 });
}

/// Restitutions measured one by one, with a density of their own: heavy-tailed around `e - slope (v - 1)`.
#[derive(Debug)]
struct Heavy(Bounces);

impl Likelihood for Heavy {
    fn spec(&self) -> &Spec {
        &self.0.0
    }
    fn log_density(&self, run: &Run, shared: &[f64]) -> Result<f64, PredictError> {
        // Logistic law of scale 0.01.
        let rows = run.inputs[0].iter().zip(&run.outputs[0]);
        Ok(rows
            .map(|(v, e)| {
                let x = ((e - shared[0] + shared[1] * (v - 1.0)) / 0.01).abs();
                -x - 2.0 * (-x).exp().ln_1p()
            })
            .sum())
    }
    fn draw(&self, run: &mut Run, shared: &[f64], rng: &mut dyn Rng) -> Result<(), PredictError> {
        let law = Uniform::new(1e-12, 1.0).unwrap();
        run.outputs[0] = run.inputs[0]
            .iter()
            .map(|v| {
                let u: f64 = law.sample(rng);
                shared[0] - shared[1] * (v - 1.0) + 0.01 * (u / (1.0 - u)).ln()
            })
            .collect();
        Ok(())
    }
}

/// Runs made by other means: noise from a Laplace law, as heavy in its tails as the logistic one and about as wide.
fn measured(slope: f64, seed: u64) -> Vec<Run> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let law = Uniform::new(1e-9_f64, 1.0).unwrap();
    (0..6)
        .map(|i| {
            let speeds: Vec<f64> = (0..12).map(|k| 3.0 - 0.2 * f64::from(k) + 0.01 * f64::from(i)).collect();
            let out = speeds
                .iter()
                .map(|v| {
                    let laplace = |a: f64, b: f64| (a / b).ln();
                    let noise = laplace(law.sample(&mut rng), law.sample(&mut rng));
                    0.81 - slope * (v - 1.0) + 0.0128 * noise
                })
                .collect();
            Run { label: format!("{i}"), inputs: vec![speeds], outputs: vec![out], kind: 0 }
        })
        .collect()
}

fn heavy(slope: f64, seed: u64) -> Diagnosis {
    let (model, recording) = Scores::put(Heavy(Bounces::new()), &measured(slope, seed), 200, 3).unwrap();
    let options = Options { replicates: 199, seed, ..Options::default() };
    diagnose(&model, &recording, &[], &options, &Silent).unwrap()
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_a_model_with_a_likelihood_finds_nothing_where_there_is_nothing() {
    let alarms = (0..30).filter(|&seed| heavy(0.0, seed).verdict != Verdict::Adequate).count();
    println!("{alarms} alarms in 30 null worlds");
    assert!(alarms <= 6, "{alarms}");
}

#[test]
fn a_model_with_a_likelihood_finds_its_mechanism() {
    let answer = heavy(0.03, 2);
    assert_eq!((answer.verdict, answer.chosen.len()), (Verdict::Explained, 1));
    let slope = &answer.mechanisms[0].parameters[0];
    assert!(slope.ci95[0] < 0.03 && 0.03 < slope.ci95[1], "{slope:?}");
}
