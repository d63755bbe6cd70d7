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
use crate::network::{Activation, Network, Scratch, Shape};
use crate::points::Points;
use crate::scaling::mean_sd;
use crate::training::Adam;

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
        let mut out = Self { network: Network::glorot(shape, 6.0, rng) };
        let mut order = train.to_vec();
        let (mut adam, mut scratch) = (Adam::new(out.network.params.len()), Scratch::default());
        let mut gradient = vec![0.0; out.network.params.len()];
        let (mut best, mut waited) = (f64::INFINITY, 0);
        for _ in 0..MOST_EPOCHS {
            order.shuffle(rng);
            let mut sum = 0.0;
            for batch in order.chunks(200.min(train.len())) {
                sum += out.step(rows, batch, &mut scratch, &mut gradient, &mut adam) * batch.len() as f64;
            }
            let loss = sum / train.len() as f64;
            waited = if loss > best - TOLERANCE { waited + 1 } else { 0 };
            best = best.min(loss);
            if waited > PATIENCE {
                break;
            }
        }
        out
    }

    /// One step on a batch; its loss before.
    fn step(
        &mut self,
        rows: &[(Vec<f64>, f64)],
        batch: &[usize],
        scratch: &mut Scratch,
        gradient: &mut [f64],
        adam: &mut Adam,
    ) -> f64 {
        let n = batch.len() as f64;
        let inputs: Vec<f64> = batch.iter().flat_map(|&i| &rows[i].0).copied().collect();
        self.network.forward(&inputs, batch.len(), scratch);
        let mut loss = 0.0;
        scratch.output_gradient.clear();
        for (&i, &logit) in batch.iter().zip(&scratch.outputs) {
            let label = rows[i].1;
            // ln(1 + e^l) - label l, without overflow.
            loss += logit.max(0.0) + (-logit.abs()).exp().ln_1p() - label * logit;
            scratch.output_gradient.push((1.0 / (1.0 + (-logit).exp()) - label) / n);
        }
        self.network.backward(&inputs, batch.len(), scratch, gradient);
        let mut squares = 0.0;
        for range in self.network.weight_ranges() {
            for (g, w) in gradient[range.clone()].iter_mut().zip(&self.network.params[range]) {
                squares += w * w;
                *g += ALPHA * w / n;
            }
        }
        adam.step(&mut self.network.params, gradient, RATE);
        (loss + 0.5 * ALPHA * squares) / n
    }

    /// Log odds of label 1.
    pub(crate) fn logit(&self, x: &[f64]) -> f64 {
        let mut scratch = Scratch::default();
        self.network.forward(x, 1, &mut scratch);
        scratch.outputs[0]
    }
}
