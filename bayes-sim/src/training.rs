//! Minibatch Adam with early stopping on held-out simulations and a learning rate that falls at each plateau.

use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::head::{Head, HeadScratch};
use crate::head_batch::BatchScratch;
use crate::learner::Learner;
use crate::network::{Network, Scratch};
use crate::real::Real;

/// How a network is trained. The defaults suit a thousand to some hundred thousand simulations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrainingSettings {
    /// Share of the simulations held out to stop early, between 0 and 0.5.
    pub validation_share: f64,
    /// Simulations a step; none for a 50th of them, between 32 and 256.
    pub batch: Option<usize>,
    /// First step size of Adam (Kingma and Ba 2014, arXiv:1412.6980).
    pub learning_rate: f64,
    /// Steps without a better held-out loss that make a plateau (at least two passes over the simulations).
    pub patience_steps: usize,
    /// Plateaus at which the step size falls, from the best parameters so far; the next one ends.
    pub decays: usize,
    /// Factor by which it falls.
    pub decay: f64,
    /// Most passes over the simulations.
    pub max_epochs: usize,
    /// Decoupled weight decay (Loshchilov and Hutter 2019, arXiv:1711.05101).
    pub weight_decay: f64,
}

impl Default for TrainingSettings {
    fn default() -> Self {
        Self {
            validation_share: 0.1,
            batch: None,
            learning_rate: 1.5e-3,
            patience_steps: 1000,
            decays: 2,
            decay: 0.25,
            max_epochs: 400,
            weight_decay: 1e-3,
        }
    }
}

impl TrainingSettings {
    pub(crate) fn check(&self) -> Result<(), Error> {
        let bad = |name, value, rule| Err(Error::Setting { name, value, rule });
        if !(self.validation_share > 0.0 && self.validation_share <= 0.5) {
            return bad("validation_share", self.validation_share, "above 0, at most 0.5");
        }
        if self.batch == Some(0) {
            return bad("batch", 0.0, "at least 1");
        }
        if !(self.learning_rate > 0.0 && self.learning_rate < 1.0) {
            return bad("learning_rate", self.learning_rate, "between 0 and 1");
        }
        if !(self.decay > 0.0 && self.decay < 1.0) {
            return bad("decay", self.decay, "between 0 and 1");
        }
        if !(0.0..1.0).contains(&self.weight_decay) {
            return bad("weight_decay", self.weight_decay, "at least 0, below 1");
        }
        if self.max_epochs == 0 {
            return bad("max_epochs", 0.0, "at least 1");
        }
        Ok(())
    }
}

/// What training came to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrainingReport {
    /// Mean negative log density of the held-out simulations, in standardised coordinates.
    pub validation_loss: f64,
    /// Passes over the simulations.
    pub epochs: usize,
    /// Whether the most passes were reached before a plateau.
    pub cut_short: bool,
}

/// Inputs and targets as the network sees them, column after column.
#[derive(Debug)]
pub(crate) struct Pairs {
    pub(crate) input_dim: usize,
    pub(crate) inputs: Vec<f64>,
    pub(crate) target_dim: usize,
    pub(crate) targets: Vec<f64>,
}

impl Pairs {
    pub(crate) fn len(&self) -> usize {
        self.targets.len() / self.target_dim
    }

    /// These rows alone.
    pub(crate) fn select(&self, rows: impl Iterator<Item = usize>) -> Self {
        let (input_dim, target_dim) = (self.input_dim, self.target_dim);
        let mut out = Self { input_dim, inputs: Vec::new(), target_dim, targets: Vec::new() };
        for i in rows {
            out.inputs.extend_from_slice(self.input(i));
            out.targets.extend_from_slice(self.target(i));
        }
        out
    }

    /// Both, one after the other.
    pub(crate) fn joined(&self, other: &Self) -> Self {
        Self {
            input_dim: self.input_dim,
            inputs: [self.inputs.as_slice(), &other.inputs].concat(),
            target_dim: self.target_dim,
            targets: [self.targets.as_slice(), &other.targets].concat(),
        }
    }

    pub(crate) fn input(&self, i: usize) -> &[f64] {
        &self.inputs[i * self.input_dim..(i + 1) * self.input_dim]
    }

    pub(crate) fn target(&self, i: usize) -> &[f64] {
        &self.targets[i * self.target_dim..(i + 1) * self.target_dim]
    }
}

/// Log density of each target under the network.
pub(crate) fn ln_densities(network: &Network, head: &Head, pairs: &Pairs) -> Vec<f64> {
    const CHUNK: usize = 256;
    let (mut scratch, mut head_scratch) = (Scratch::default(), HeadScratch::default());
    let mut out = Vec::with_capacity(pairs.len());
    for start in (0..pairs.len()).step_by(CHUNK) {
        let batch = CHUNK.min(pairs.len() - start);
        let inputs = &pairs.inputs[start * pairs.input_dim..(start + batch) * pairs.input_dim];
        network.forward(inputs, batch, &mut scratch);
        for (b, outputs) in scratch.outputs.chunks_exact(head.outputs()).take(batch).enumerate() {
            out.push(-head.loss(outputs, pairs.target(start + b), &mut head_scratch));
        }
    }
    out
}

/// Pairs in the numbers of training.
struct Rows<T> {
    input_dim: usize,
    inputs: Vec<T>,
    target_dim: usize,
    targets: Vec<T>,
}

impl<T: Real> Rows<T> {
    fn of(pairs: &Pairs) -> Self {
        let cast = |values: &[f64]| values.iter().map(|v| T::of(*v)).collect();
        Self {
            input_dim: pairs.input_dim,
            inputs: cast(&pairs.inputs),
            target_dim: pairs.target_dim,
            targets: cast(&pairs.targets),
        }
    }
}

/// A network that learns, and one minibatch's buffers.
struct Student<'a, T> {
    learner: Learner<T>,
    head: &'a Head,
    scratch: BatchScratch<T>,
    inputs: Vec<T>,
    targets: Vec<T>,
}

impl<'a, T: Real> Student<'a, T> {
    fn new(network: &Network, head: &'a Head) -> Self {
        let (learner, scratch) = (Learner::new(network), BatchScratch::new(head));
        Self { learner, head, scratch, inputs: Vec::new(), targets: Vec::new() }
    }

    /// Gradient of the mean loss of these rows.
    fn gradient(&mut self, rows: &Rows<T>, indices: &[usize]) {
        let (p, t) = (rows.input_dim, rows.target_dim);
        self.inputs.clear();
        self.targets.clear();
        for &i in indices {
            self.inputs.extend_from_slice(&rows.inputs[i * p..(i + 1) * p]);
            self.targets.extend_from_slice(&rows.targets[i * t..(i + 1) * t]);
        }
        let learner = &mut self.learner;
        learner.forward(&self.inputs, indices.len());
        learner.output_gradient.resize(learner.outputs.len(), T::ZERO);
        let gradient = Some(learner.output_gradient.as_mut_slice());
        self.head.batch_loss(&learner.outputs, &self.targets, gradient, &mut self.scratch);
        learner.backward(&self.inputs, indices.len());
    }

    fn mean_loss(&mut self, rows: &Rows<T>) -> f64 {
        const CHUNK: usize = 256;
        let (p, t) = (rows.input_dim, rows.target_dim);
        let mut total = 0.0;
        for (inputs, targets) in rows.inputs.chunks(CHUNK * p).zip(rows.targets.chunks(CHUNK * t)) {
            self.learner.forward(inputs, targets.len() / t);
            total += self.head.batch_loss(&self.learner.outputs, targets, None, &mut self.scratch);
        }
        let loss = total * t as f64 / rows.targets.len() as f64;
        if loss.is_finite() { loss } else { f64::INFINITY }
    }
}

/// Trains in place; leaves the parameters of the best held-out loss.
pub(crate) fn train(
    network: &mut Network,
    head: &Head,
    pairs: &Pairs,
    held_out: &Pairs,
    settings: &TrainingSettings,
    rng: &mut ChaCha8Rng,
) -> TrainingReport {
    let batch = settings.batch.unwrap_or((pairs.len() / 50).clamp(32, 256)).min(pairs.len());
    let steps_per_epoch = pairs.len() / batch;
    let patience = settings.patience_steps.div_ceil(steps_per_epoch).max(2);
    let [rows, tests] = [pairs, held_out].map(Rows::<f32>::of);
    let mut student = Student::new(network, head);
    let mut order: Vec<usize> = (0..pairs.len()).collect();
    let mut rate = settings.learning_rate;
    let (mut best, mut best_params) = (student.mean_loss(&tests), student.learner.params.clone());
    let (mut waited, mut decays, mut epochs, mut cut_short) = (0, 0, 0, true);
    while epochs < settings.max_epochs {
        order.shuffle(rng);
        // The last, shorter batch is left for another shuffle.
        for indices in order.chunks_exact(batch) {
            student.gradient(&rows, indices);
            student.learner.clip(5.0);
            student.learner.step(rate, settings.weight_decay);
        }
        epochs += 1;
        let loss = student.mean_loss(&tests);
        waited += 1;
        if loss < best {
            // A gain too small to see does not prolong the wait.
            if loss < best - 1e-4 {
                waited = 0;
            }
            best = loss;
            best_params.copy_from_slice(&student.learner.params);
        }
        if waited >= patience {
            if decays == settings.decays {
                cut_short = false;
                break;
            }
            student.learner.params.copy_from_slice(&best_params);
            student.learner.restart();
            decays += 1;
            rate *= settings.decay;
            waited = 0;
        }
    }
    student.learner.params.copy_from_slice(&best_params);
    student.learner.write(network);
    TrainingReport { validation_loss: best, epochs, cut_short }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::{Activation, Shape};
    use rand::{RngExt, SeedableRng};

    /// The whole chain, network and head, against central differences.
    #[test]
    fn gradients_of_a_network_agree_with_differences() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for hidden in [vec![], vec![5], vec![4, 6]] {
            let head = Head { dim: 2, components: 2, cut: None };
            let shape = Shape {
                inputs: 3,
                hidden,
                outputs: head.outputs(),
                body: true,
                linear: head.mean_rows(),
                activation: Activation::Isrlu,
            };
            let network = Network::new(shape, 1.0, 1.0, &mut rng);
            let draw = |n: usize, rng: &mut ChaCha8Rng| (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
            let pairs = Pairs {
                input_dim: 3,
                inputs: draw(21, &mut rng),
                target_dim: 2,
                targets: draw(14, &mut rng),
            };
            let rows = Rows::<f64>::of(&pairs);
            let mut student = Student::new(&network, &head);
            let reference = -ln_densities(&network, &head, &pairs).iter().sum::<f64>() / 7.0;
            assert!((student.mean_loss(&rows) - reference).abs() < 1e-12);
            student.gradient(&rows, &[0, 1, 2, 3, 4, 5, 6]);
            let gradient = student.learner.gradient.clone();
            for (i, g) in gradient.iter().enumerate() {
                let before = student.learner.params[i];
                student.learner.params[i] = before + 1e-5;
                let up = student.mean_loss(&rows);
                student.learner.params[i] = before - 1e-5;
                let slope = (up - student.mean_loss(&rows)) / 2e-5;
                student.learner.params[i] = before;
                assert!((slope - g).abs() < 1e-8 + 1e-6 * slope.abs(), "{slope} {g}");
            }
        }
    }
}
