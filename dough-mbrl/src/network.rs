//! Dynamics as an ensemble of small networks (Chua et al. 2018, arXiv:1805.12114): one hidden layer, each trained on its own draw of
//! the rolls, their spread and what they leave being the uncertainty.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::dynamics::{Action, LearnError, Prediction, Roll, State};
use crate::predictor::{Predictor, Refit, enough, finite, nearest_m, row};
use crate::ridge::standards;

const HIDDEN: usize = 16;
const INPUTS: usize = 5;
/// Weights of a network: hidden ones with a bias each, the outputs' with a bias, and a line past the hidden layer.
const SIZE: usize = HIDDEN * (INPUTS + 1) + 3 * (HIDDEN + 1) + 3 * INPUTS;
const MEMBERS: usize = 5;
const EPOCHS: usize = 600;
const EPOCHS_AGAIN: usize = 120;
const RATE: f64 = 0.01;
const DECAY: f64 = 1e-4;

/// One network with Adam's moments (Kingma and Ba 2015, arXiv:1412.6980).
#[derive(Debug, Clone)]
struct Member {
    weights: Vec<f64>,
    first: Vec<f64>,
    second: Vec<f64>,
    steps: i32,
    /// How often each roll counts for it.
    draws: Vec<f64>,
}

/// An ensemble of networks.
#[derive(Debug, Clone)]
pub struct Ensemble {
    members: Vec<Member>,
    rolls: Vec<(Roll, f64)>,
    mean: [f64; INPUTS],
    per_scale: [f64; INPUTS],
    change: [[f64; 2]; 3],
    /// Sigma of what the mean network leaves, in units of the change's.
    sigma: [f64; 3],
    rng: ChaCha8Rng,
    trained: bool,
}

/// Output of a network; its hidden values are left behind for the gradient.
fn forward(w: &[f64], x: &[f64; INPUTS], hidden: &mut [f64; HIDDEN]) -> [f64; 3] {
    let (first, rest) = w.split_at(HIDDEN * (INPUTS + 1));
    let (second, line) = rest.split_at(3 * (HIDDEN + 1));
    for (h, w) in hidden.iter_mut().zip(first.chunks_exact(INPUTS + 1)) {
        *h = (w[INPUTS] + (0..INPUTS).map(|k| w[k] * x[k]).sum::<f64>()).tanh();
    }
    std::array::from_fn(|d| {
        let (s, l) = (&second[d * (HIDDEN + 1)..], &line[d * INPUTS..]);
        s[HIDDEN]
            + (0..HIDDEN).map(|k| s[k] * hidden[k]).sum::<f64>()
            + (0..INPUTS).map(|k| l[k] * x[k]).sum::<f64>()
    })
}

/// Adds the gradient of half the squared error, given the errors of the outputs.
fn backward(w: &[f64], x: &[f64; INPUTS], hidden: &[f64; HIDDEN], error: &[f64; 3], gradient: &mut [f64]) {
    let begin = HIDDEN * (INPUTS + 1);
    let line = begin + 3 * (HIDDEN + 1);
    for d in 0..3 {
        let at = begin + d * (HIDDEN + 1);
        (0..HIDDEN).for_each(|k| gradient[at + k] += error[d] * hidden[k]);
        gradient[at + HIDDEN] += error[d];
        (0..INPUTS).for_each(|k| gradient[line + d * INPUTS + k] += error[d] * x[k]);
    }
    for h in 0..HIDDEN {
        let back: f64 = (0..3).map(|d| error[d] * w[begin + d * (HIDDEN + 1) + h]).sum();
        let slope = back * (1.0 - hidden[h] * hidden[h]);
        let at = h * (INPUTS + 1);
        (0..INPUTS).for_each(|k| gradient[at + k] += slope * x[k]);
        gradient[at + INPUTS] += slope;
    }
}

impl Member {
    fn new(rng: &mut ChaCha8Rng) -> Self {
        let mut normal = |sigma: f64| -> f64 {
            let z: f64 = StandardNormal.sample(rng);
            sigma * z
        };
        let weights = (0..SIZE).map(|_| normal(0.3)).collect();
        Self { weights, first: vec![0.0; SIZE], second: vec![0.0; SIZE], steps: 0, draws: Vec::new() }
    }

    fn train(&mut self, data: &[([f64; INPUTS], [f64; 3], f64)], epochs: usize) {
        let total: f64 = data.iter().zip(&self.draws).map(|(d, n)| d.2 * n).sum::<f64>().max(1e-9);
        let mut gradient = vec![0.0; SIZE];
        let mut hidden = [0.0; HIDDEN];
        for epoch in 0..epochs {
            gradient.iter_mut().zip(&self.weights).for_each(|(g, w)| *g = DECAY * w);
            for ((x, y, weight), count) in data.iter().zip(&self.draws) {
                if *count > 0.0 {
                    let out = forward(&self.weights, x, &mut hidden);
                    let error = std::array::from_fn(|d| weight * count * (out[d] - y[d]) / total);
                    backward(&self.weights, x, &hidden, &error, &mut gradient);
                }
            }
            self.steps += 1;
            let rate = RATE * (1.0 - 0.9 * epoch as f64 / epochs as f64);
            let (a, b) = (1.0 - 0.9_f64.powi(self.steps), 1.0 - 0.999_f64.powi(self.steps));
            for (k, g) in gradient.iter().enumerate() {
                self.first[k] += 0.1 * (g - self.first[k]);
                self.second[k] += 0.001 * (g * g - self.second[k]);
                self.weights[k] -= rate * self.first[k] / a / ((self.second[k] / b).sqrt() + 1e-8);
            }
        }
    }
}

impl Ensemble {
    /// Learns from rolls; the seed makes first weights and draws.
    ///
    /// # Errors
    /// [`LearnError`].
    pub fn learn(rolls: &[Roll], seed: u64) -> Result<Self, LearnError> {
        enough(rolls, 20, 1)?;
        let (mean, per_scale) = standards(rolls);
        let n = rolls.len() as f64;
        let change = [0, 1, 2].map(|k| {
            let of = |r: &Roll| r.next[k] - r.state[k];
            let mean = rolls.iter().map(of).sum::<f64>() / n;
            [mean, (rolls.iter().map(|r| (of(r) - mean).powi(2)).sum::<f64>() / n).sqrt().max(1e-9)]
        });
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let members = (0..MEMBERS).map(|_| Member::new(&mut rng)).collect();
        let mut ensemble = Self {
            members,
            rolls: Vec::new(),
            mean,
            per_scale,
            change,
            sigma: [0.0; 3],
            rng,
            trained: false,
        };
        rolls.iter().try_for_each(|r| ensemble.add(r, 1.0))?;
        ensemble.refit()?;
        Ok(ensemble)
    }

    fn input(&self, state: &State, action: &Action) -> [f64; INPUTS] {
        let x = row(state, action);
        std::array::from_fn(|k| (x[k] - self.mean[k]) * self.per_scale[k])
    }

    /// Mean and variance of the members' outputs, standardised.
    fn spread(&self, x: &[f64; INPUTS]) -> [[f64; 2]; 3] {
        let mut hidden = [0.0; HIDDEN];
        let (mut sum, mut squares) = ([0.0; 3], [0.0; 3]);
        for member in &self.members {
            let out = forward(&member.weights, x, &mut hidden);
            (0..3).for_each(|d| {
                sum[d] += out[d];
                squares[d] += out[d] * out[d];
            });
        }
        let n = self.members.len() as f64;
        std::array::from_fn(|d| {
            let mean = sum[d] / n;
            [mean, (squares[d] / n - mean * mean).max(0.0) * n / (n - 1.0)]
        })
    }
}

impl Predictor for Ensemble {
    fn next(&self, state: &State, action: &Action) -> State {
        let spread = self.spread(&self.input(state, action));
        std::array::from_fn(|k| state[k] + self.change[k][0] + self.change[k][1] * spread[k][0])
    }

    fn predict(&self, state: &State, action: &Action) -> [Prediction; 3] {
        let spread = self.spread(&self.input(state, action));
        std::array::from_fn(|k| {
            let [mean, scale] = self.change[k];
            Prediction {
                mean: state[k] + mean + scale * spread[k][0],
                sigma: scale * (spread[k][1] + self.sigma[k].powi(2)).sqrt(),
            }
        })
    }
}

/// A refit goes on from the weights that there are.
impl Refit for Ensemble {
    fn add(&mut self, roll: &Roll, weight: f64) -> Result<(), LearnError> {
        if !(finite(roll) && weight > 0.0 && weight.is_finite()) {
            return Err(LearnError::Undetermined { degree: 1 });
        }
        self.rolls.push((*roll, weight));
        for member in &mut self.members {
            // The bootstrap roll by roll: a Poisson number of one (Oza 2005, doi:10.1109/ICSMC.2005.1571498).
            let (mut count, mut product) = (0.0, self.rng.random::<f64>());
            while product > (-1.0_f64).exp() {
                count += 1.0;
                product *= self.rng.random::<f64>();
            }
            member.draws.push(count);
        }
        Ok(())
    }

    fn refit(&mut self) -> Result<(), LearnError> {
        let data: Vec<_> = self
            .rolls
            .iter()
            .map(|(r, w)| {
                let y =
                    std::array::from_fn(|k| (r.next[k] - r.state[k] - self.change[k][0]) / self.change[k][1]);
                (self.input(&r.state, &r.action), y, *w)
            })
            .collect();
        let epochs = if self.trained { EPOCHS_AGAIN } else { EPOCHS };
        let before = self.members.clone();
        self.members.iter_mut().for_each(|m| m.train(&data, epochs));
        let sigma = [0, 1, 2].map(|k| {
            let off = data.iter().map(|(x, y, w)| w * (self.spread(x)[k][0] - y[k]).powi(2)).sum::<f64>();
            (off / data.iter().map(|d| d.2).sum::<f64>()).sqrt()
        });
        if !sigma.iter().all(|s| s.is_finite()) {
            self.members = before;
            return Err(LearnError::Undetermined { degree: 1 });
        }
        (self.sigma, self.trained) = (sigma, true);
        Ok(())
    }

    fn distance_m(&self, state: &State) -> f64 {
        let states: Vec<State> = self.rolls.iter().map(|(r, _)| r.state).collect();
        nearest_m(&states, state)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradients_are_those_of_differences() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let member = Member::new(&mut rng);
        let (x, y) = ([0.3, -1.0, 0.7, 0.2, -0.4], [0.5, -0.2, 0.1]);
        let cost = |w: &[f64]| {
            let out = forward(w, &x, &mut [0.0; HIDDEN]);
            0.5 * (0..3).map(|d| (out[d] - y[d]) * (out[d] - y[d])).sum::<f64>()
        };
        let mut hidden = [0.0; HIDDEN];
        let out = forward(&member.weights, &x, &mut hidden);
        let error = [0, 1, 2].map(|d| out[d] - y[d]);
        let mut gradient = vec![0.0; SIZE];
        backward(&member.weights, &x, &hidden, &error, &mut gradient);
        for k in 0..SIZE {
            let moved = |step: f64| {
                let mut w = member.weights.clone();
                w[k] += step;
                cost(&w)
            };
            let numeric = (moved(1e-5) - moved(-1e-5)) / 2e-5;
            approx::assert_abs_diff_eq!(gradient[k], numeric, epsilon = 1e-8);
        }
    }
}
