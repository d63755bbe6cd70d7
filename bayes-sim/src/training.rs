//! Minibatch Adam with early stopping on held-out simulations and a learning rate that falls at each plateau.

use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::head::{Head, HeadScratch};
use crate::network::{Network, Scratch};

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

/// Adam's moments.
#[derive(Debug)]
pub(crate) struct Adam {
    first: Vec<f64>,
    second: Vec<f64>,
    steps: i32,
}

impl Adam {
    pub(crate) fn new(n: usize) -> Self {
        Self { first: vec![0.0; n], second: vec![0.0; n], steps: 0 }
    }

    /// One step down the gradient.
    pub(crate) fn step(&mut self, params: &mut [f64], gradient: &[f64], rate: f64) {
        const B1: f64 = 0.9;
        const B2: f64 = 0.999;
        self.steps = self.steps.saturating_add(1);
        let rate = rate * (1.0 - B2.powi(self.steps)).sqrt() / (1.0 - B1.powi(self.steps));
        let moments = self.first.iter_mut().zip(&mut self.second);
        for ((p, &g), (m, v)) in params.iter_mut().zip(gradient).zip(moments) {
            *m = B1 * *m + (1.0 - B1) * g;
            *v = B2 * *v + (1.0 - B2) * g * g;
            *p -= rate * *m / (v.sqrt() + 1e-8);
        }
    }
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
            out.push(-head.loss(outputs, pairs.target(start + b), None, &mut head_scratch));
        }
    }
    out
}

fn mean_loss(network: &Network, head: &Head, pairs: &Pairs) -> f64 {
    let ln = ln_densities(network, head, pairs);
    let loss = -ln.iter().sum::<f64>() / ln.len() as f64;
    if loss.is_finite() { loss } else { f64::INFINITY }
}

/// One minibatch's buffers.
#[derive(Default)]
struct Step {
    scratch: Scratch,
    head: HeadScratch,
    inputs: Vec<f64>,
    gradient: Vec<f64>,
}

impl Step {
    /// Gradient of the mean loss of these pairs, its norm at most 5.
    fn gradient(&mut self, network: &Network, head: &Head, pairs: &Pairs, indices: &[usize]) {
        self.inputs.clear();
        indices.iter().for_each(|&i| self.inputs.extend_from_slice(pairs.input(i)));
        network.forward(&self.inputs, indices.len(), &mut self.scratch);
        let (n, share) = (head.outputs(), 1.0 / indices.len() as f64);
        self.scratch.output_gradient.resize(n * indices.len(), 0.0);
        let columns = self.scratch.output_gradient.chunks_exact_mut(n);
        for ((&i, outputs), gradient) in indices.iter().zip(self.scratch.outputs.chunks_exact(n)).zip(columns)
        {
            head.loss(outputs, pairs.target(i), Some(gradient), &mut self.head);
            gradient.iter_mut().for_each(|g| *g *= share);
        }
        self.gradient.resize(network.params.len(), 0.0);
        network.backward(&self.inputs, indices.len(), &mut self.scratch, &mut self.gradient);
        let norm = self.gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
        let factor = if norm.is_finite() { (5.0 / norm).min(1.0) } else { 0.0 };
        self.gradient.iter_mut().for_each(|g| *g = if factor > 0.0 { *g * factor } else { 0.0 });
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
    let weights = network.weight_ranges();
    let mut order: Vec<usize> = (0..pairs.len()).collect();
    let mut adam = Adam::new(network.params.len());
    let mut step = Step::default();
    let mut rate = settings.learning_rate;
    let (mut best, mut best_params) = (mean_loss(network, head, held_out), network.params.clone());
    let (mut waited, mut decays, mut epochs) = (0, 0, 0);
    while epochs < settings.max_epochs {
        order.shuffle(rng);
        // The last, shorter batch is left for another shuffle.
        for indices in order.chunks_exact(batch) {
            step.gradient(network, head, pairs, indices);
            adam.step(&mut network.params, &step.gradient, rate);
            let keep = 1.0 - rate * settings.weight_decay;
            weights.iter().for_each(|r| network.params[r.clone()].iter_mut().for_each(|p| *p *= keep));
        }
        epochs += 1;
        let loss = mean_loss(network, head, held_out);
        waited += 1;
        if loss < best {
            // A gain too small to see does not prolong the wait.
            if loss < best - 1e-4 {
                waited = 0;
            }
            best = loss;
            best_params.copy_from_slice(&network.params);
        }
        if waited >= patience {
            network.params.copy_from_slice(&best_params);
            if decays == settings.decays {
                return TrainingReport { validation_loss: best, epochs, cut_short: false };
            }
            decays += 1;
            rate *= settings.decay;
            adam = Adam::new(network.params.len());
            waited = 0;
        }
    }
    network.params.copy_from_slice(&best_params);
    TrainingReport { validation_loss: best, epochs, cut_short: true }
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
            let mut network = Network::new(shape, 1.0, 1.0, &mut rng);
            let draw = |n: usize, rng: &mut ChaCha8Rng| (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
            let pairs = Pairs {
                input_dim: 3,
                inputs: draw(21, &mut rng),
                target_dim: 2,
                targets: draw(14, &mut rng),
            };
            let mut step = Step::default();
            step.gradient(&network, &head, &pairs, &[0, 1, 2, 3, 4, 5, 6]);
            for i in 0..network.params.len() {
                let kept = network.params[i];
                network.params[i] = kept + 1e-5;
                let up = mean_loss(&network, &head, &pairs);
                network.params[i] = kept - 1e-5;
                let slope = (up - mean_loss(&network, &head, &pairs)) / 2e-5;
                network.params[i] = kept;
                assert!(
                    (slope - step.gradient[i]).abs() < 1e-8 + 1e-6 * slope.abs(),
                    "{slope} {}",
                    step.gradient[i]
                );
            }
        }
    }
}
