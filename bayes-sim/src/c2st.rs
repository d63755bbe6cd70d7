//! The classifier two-sample test: how often a network tells two samples apart; 0.5 for equal ones (Lopez-Paz and Oquab 2017,
//! arXiv:1610.06545).
//!
//! The network and its training are those of scikit-learn's `MLPClassifier` with the settings of the benchmark sbibm: two rectified
//! layers of `10 dim` units, Adam, five folds, columns standardised by the first sample.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::error::Error;
use crate::learner::Learner;
use crate::network::{Activation, Network, Scratch, Shape};
use crate::points::Points;
use crate::scaling::mean_sd;

const FOLDS: usize = 5;
const MOST_EPOCHS: usize = 10_000;
const RATE: f64 = 1e-3;
/// Penalty of the squared weights.
const ALPHA: f64 = 1e-4;
/// A loss has to fall by this much, at least once in so many passes.
const TOLERANCE: f64 = 1e-4;
const PATIENCE: usize = 10;

/// Held-out accuracy with which the classifier tells two samples apart: 0.5 for equal distributions, 1 for separate ones.
/// Standardised by `reference`. Deterministic in the seed, on any number of threads.
///
/// # Errors
/// [`Error::Length`] for samples of different dimension; [`Error::TooFew`] below 50 points; [`Error::NotFinite`].
pub fn c2st(reference: &Points, other: &Points, seed: u64) -> Result<f64, Error> {
    if reference.dim() != other.dim() {
        return Err(Error::Length { what: "point", expected: reference.dim(), got: other.dim() });
    }
    for sample in [reference, other] {
        sample.check_finite("sample")?;
        if sample.len() < 50 {
            return Err(Error::TooFew { least: 50, got: sample.len() });
        }
    }
    let d = reference.dim();
    let scales: Vec<(f64, f64)> = (0..d)
        .map(|j| {
            let (mean, sd) = mean_sd(&reference.column(j));
            let n = reference.len() as f64;
            (mean, if sd > 0.0 { sd * (n / (n - 1.0)).sqrt() } else { 1.0 })
        })
        .collect();
    let mut rows: Vec<(Vec<f64>, f64)> = Vec::with_capacity(reference.len() + other.len());
    for (sample, label) in [(reference, 0.0), (other, 1.0)] {
        rows.extend(
            sample.rows().map(|r| (r.iter().zip(&scales).map(|(v, (m, s))| (v - m) / s).collect(), label)),
        );
    }
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    let accuracies: Vec<f64> = (0..FOLDS)
        .into_par_iter()
        .map(|fold| {
            let bounds = [fold, fold + 1].map(|f| f * order.len() / FOLDS);
            let test = &order[bounds[0]..bounds[1]];
            let train: Vec<usize> = order[..bounds[0]].iter().chain(&order[bounds[1]..]).copied().collect();
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(fold as u64 + 1);
            let classifier = Classifier::fit(&rows, &train, &mut rng);
            let right =
                test.iter().filter(|&&i| (classifier.logit(&rows[i].0) > 0.0) == (rows[i].1 > 0.5)).count();
            right as f64 / test.len() as f64
        })
        .collect();
    Ok(accuracies.iter().sum::<f64>() / FOLDS as f64)
}

/// A network with one logistic output.
pub(crate) struct Classifier {
    network: Network,
}

impl Classifier {
    /// Trains on these rows, each with its label, 0 or 1.
    pub(crate) fn fit(rows: &[(Vec<f64>, f64)], train: &[usize], rng: &mut ChaCha8Rng) -> Self {
        let d = rows[0].0.len();
        let shape = Shape {
            inputs: d,
            hidden: vec![10 * d, 10 * d],
            outputs: 1,
            body: true,
            linear: vec![],
            activation: Activation::Relu,
        };
        let mut network = Network::glorot(shape, 6.0, rng);
        let mut learner = Learner::<f32>::new(&network);
        let mut order = train.to_vec();
        let mut inputs = Vec::new();
        let (mut best, mut waited) = (f64::INFINITY, 0);
        for _ in 0..MOST_EPOCHS {
            order.shuffle(rng);
            let mut sum = 0.0;
            for batch in order.chunks(200.min(train.len())) {
                inputs.clear();
                inputs.extend(batch.iter().flat_map(|&i| rows[i].0.iter().map(|v| *v as f32)));
                sum += step(&mut learner, &inputs, batch.iter().map(|&i| rows[i].1));
            }
            let loss = sum / train.len() as f64;
            waited = if loss > best - TOLERANCE { waited + 1 } else { 0 };
            best = best.min(loss);
            if waited > PATIENCE {
                break;
            }
        }
        learner.write(&mut network);
        Self { network }
    }

    /// Log odds of label 1.
    pub(crate) fn logit(&self, x: &[f64]) -> f64 {
        let mut scratch = Scratch::default();
        self.network.forward(x, 1, &mut scratch);
        scratch.outputs[0]
    }
}

/// One step on a batch; the sum of its losses before.
fn step(learner: &mut Learner<f32>, inputs: &[f32], labels: impl ExactSizeIterator<Item = f64>) -> f64 {
    let batch = labels.len();
    let n = batch as f64;
    learner.forward(inputs, batch);
    let mut loss = 0.0;
    learner.output_gradient.clear();
    for (label, logit) in labels.zip(&learner.outputs) {
        let logit = f64::from(*logit);
        // ln(1 + e^l) - label l, without overflow.
        let odds = (-logit.abs()).exp();
        loss += logit.max(0.0) + odds.ln_1p() - label * logit;
        let share = if logit > 0.0 { 1.0 / (1.0 + odds) } else { odds / (1.0 + odds) };
        learner.output_gradient.push(((share - label) / n) as f32);
    }
    learner.backward(inputs, batch);
    let squares = learner.penalise(ALPHA / n);
    learner.step(RATE, 0.0);
    loss + 0.5 * ALPHA * squares
}
