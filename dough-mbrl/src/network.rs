//! Dynamics as an ensemble of small networks (Chua et al. 2018, arXiv:1805.12114): one hidden layer, each trained on its own draw of
//! the rolls, their spread and residuals being the uncertainty.

use bayes_sim::perceptron::{DescentSettings, Perceptron, PredictionScratch};
use bayes_sim::points::Points;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::predictor::{LearnError, Prediction, Predictor, Refit, enough, finite, nearest_m, row};
use crate::ridge::standards;
use crate::roll::{Action, Roll, State};

const INPUTS: usize = 5;
const HIDDEN: usize = 16;
const MEMBERS: usize = 5;
/// Passes over the rolls when they are first learned, and at each refit.
const EPOCHS: usize = 600;
const REFIT_EPOCHS: usize = 120;

/// One network, and how often each roll counts for it.
#[derive(Debug, Clone)]
struct Member {
    network: Perceptron,
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
    /// Sigma of the mean network's residuals, in units of the change's.
    sigma: [f64; 3],
    rng: ChaCha8Rng,
    trained: bool,
}

const UNDETERMINED: LearnError = LearnError::Undetermined { degree: 1 };

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
        let members = (0..MEMBERS)
            .map(|_| {
                let network = Perceptron::new(INPUTS, HIDDEN, 3, &mut rng).map_err(|_| UNDETERMINED)?;
                Ok(Member { network, draws: Vec::new() })
            })
            .collect::<Result<_, LearnError>>()?;
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
    fn spread(&self, x: &[f64]) -> [[f64; 2]; 3] {
        let mut scratch = PredictionScratch::default();
        let (mut sum, mut squares) = ([0.0; 3], [0.0; 3]);
        for member in &self.members {
            let out = member.network.predict(x, &mut scratch);
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
            return Err(UNDETERMINED);
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
        let (mut inputs, mut targets) = (Points::new(INPUTS), Points::new(3));
        for (roll, _) in &self.rolls {
            let target: [f64; 3] = std::array::from_fn(|k| {
                (roll.next[k] - roll.state[k] - self.change[k][0]) / self.change[k][1]
            });
            inputs.push(&self.input(&roll.state, &roll.action)).map_err(|_| UNDETERMINED)?;
            targets.push(&target).map_err(|_| UNDETERMINED)?;
        }
        let epochs = if self.trained { REFIT_EPOCHS } else { EPOCHS };
        let settings = DescentSettings { epochs, ..DescentSettings::default() };
        let before = self.members.clone();
        let trained = self.members.iter_mut().try_for_each(|member| {
            let weights: Vec<f64> = self.rolls.iter().zip(&member.draws).map(|((_, w), n)| w * n).collect();
            member.network.train(&inputs, &targets, &weights, &settings)
        });
        let total: f64 = self.rolls.iter().map(|(_, weight)| weight).sum();
        let mut squares = [0.0; 3];
        for ((x, y), (_, weight)) in inputs.rows().zip(targets.rows()).zip(&self.rolls) {
            let spread = self.spread(x);
            (0..3).for_each(|k| squares[k] += weight * (spread[k][0] - y[k]).powi(2));
        }
        let sigma = squares.map(|square| (square / total).sqrt());
        if trained.is_err() || !sigma.iter().all(|s| s.is_finite()) {
            self.members = before;
            return Err(UNDETERMINED);
        }
        (self.sigma, self.trained) = (sigma, true);
        Ok(())
    }

    fn distance_m(&self, state: &State) -> f64 {
        let states: Vec<State> = self.rolls.iter().map(|(r, _)| r.state).collect();
        nearest_m(&states, state)
    }
}
