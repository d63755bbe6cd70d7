//! Truncated sequential rounds for one observation (TSNPE; Deistler, Goncalves and Macke 2022, arXiv:2210.04815).
//!
//! Every round draws from the prior, cut to where the posterior so far is not negligible. Within what is left all rounds' draws
//! follow the prior, so that training needs no correction and all simulations are used.

use std::path::Path;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::autoregressive::{Autoregressive, AutoregressiveSettings};
use crate::campaign::Simulator;
use crate::error::Error;
use crate::mdn::{Mdn, MdnSettings};
use crate::mdrff::{Mdrff, MdrffSettings};
use crate::mixture::{cumulative, pick};
use crate::points::{Points, check_row};
use crate::posterior::ConditionalDensity;
use crate::prior::Prior;
use crate::save::Saved;
use crate::simulations::Simulations;

/// Settings that know how to train what they are settings of.
pub trait Trainer {
    /// The density that is trained.
    type Density: ConditionalDensity + Saved;

    /// Trains it.
    ///
    /// # Errors
    /// As the density's `train`.
    fn train(&self, prior: &Prior, simulations: &Simulations, seed: u64) -> Result<Self::Density, Error>;
}

impl Trainer for MdnSettings {
    type Density = Mdn;

    fn train(&self, prior: &Prior, simulations: &Simulations, seed: u64) -> Result<Mdn, Error> {
        Mdn::train(prior, simulations, self, seed)
    }
}

impl Trainer for MdrffSettings {
    type Density = Mdrff;

    fn train(&self, prior: &Prior, simulations: &Simulations, seed: u64) -> Result<Mdrff, Error> {
        Mdrff::train(prior, simulations, self, seed)
    }
}

impl Trainer for AutoregressiveSettings {
    type Density = Autoregressive;

    fn train(&self, prior: &Prior, simulations: &Simulations, seed: u64) -> Result<Autoregressive, Error> {
        Autoregressive::train(prior, simulations, self, seed)
    }
}

/// All that a sequence of rounds has come to; it can be saved after any round and goes on from there with the same bits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(bound = "D: Serialize + serde::de::DeserializeOwned")]
pub struct Rounds<D> {
    prior: Prior,
    observation: Vec<f64>,
    seed: u64,
    theta: Points,
    x: Points,
    log: Vec<RoundReport>,
    density: Option<D>,
}

/// What one round did.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RoundReport {
    /// Simulations that succeeded.
    pub simulations: usize,
    /// Simulations that failed.
    pub failures: usize,
    /// Share of the prior (of the box about the posterior's draws, where that is smaller) that was still drawn from.
    pub acceptance: f64,
    /// Whether every draw was a direct one; otherwise some were resampled from the posterior by weights.
    pub exact: bool,
}

/// Mass of the posterior so far that a round may cut off.
const CUT_OFF: f64 = 1e-4;
/// Posterior draws that say where it is.
const SCOUTS: usize = 5000;
/// Direct draws for each that is wanted, before resampling.
const TRIES: usize = 200;

impl<D> Saved for Rounds<D>
where
    D: Saved,
{
    const KIND: &'static str = "rounds";
}

impl<D: ConditionalDensity + Saved> Rounds<D> {
    /// Rounds for one observation, none run yet.
    ///
    /// # Errors
    /// [`Error::NotFinite`], [`Error::Length`] for an observation without numbers or with NaN.
    pub fn new(prior: Prior, observation: Vec<f64>, seed: u64) -> Result<Self, Error> {
        check_row("observation", &observation, observation.len().max(1))?;
        let (theta, x) = (Points::new(prior.dim()), Points::new(observation.len()));
        Ok(Self { prior, observation, seed, theta, x, log: Vec::new(), density: None })
    }

    /// What each round did.
    pub fn log(&self) -> &[RoundReport] {
        &self.log
    }

    /// The density after the last round; none before the first.
    pub fn density(&self) -> Option<&D> {
        self.density.as_ref()
    }

    /// One more round: `count` draws, simulated in parallel, and a density trained on all so far.
    ///
    /// # Errors
    /// [`Error::Length`] for a simulator of other features; those of the density's training.
    pub fn round(
        &mut self,
        simulator: &dyn Simulator,
        count: usize,
        trainer: &impl Trainer<Density = D>,
    ) -> Result<&D, Error> {
        if simulator.x_dim() != self.observation.len() {
            return Err(Error::Length {
                what: "features",
                expected: self.observation.len(),
                got: simulator.x_dim(),
            });
        }
        let number = self.log.len() as u64;
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(number << 32);
        let (draws, acceptance, exact) = self.propose(count, &mut rng)?;
        let outcomes: Vec<Option<Vec<f64>>> = (0..draws.len())
            .into_par_iter()
            .map(|i| {
                let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
                rng.set_stream((number << 32) + 1 + i as u64);
                let x = simulator.simulate(draws.row(i), &mut rng).ok()?;
                (x.len() == self.observation.len() && x.iter().all(|v| v.is_finite())).then_some(x)
            })
            .collect();
        let failures = outcomes.iter().filter(|o| o.is_none()).count();
        let (mut theta, mut x) = (self.theta.clone(), self.x.clone());
        for (t, outcome) in draws.rows().zip(outcomes) {
            if let Some(features) = outcome {
                theta.push(t)?;
                x.push(&features)?;
            }
        }
        let simulations = Simulations::new(theta.clone(), x.clone())?;
        let density = trainer.train(&self.prior, &simulations, self.seed.wrapping_add(number))?;
        (self.theta, self.x) = (theta, x);
        self.log.push(RoundReport { simulations: count - failures, failures, acceptance, exact });
        Ok(self.density.insert(density))
    }

    /// Draws of the prior, cut to where the density is at least as high, relative to the prior, as at all but a share of
    /// [`CUT_OFF`] of its own draws.
    fn propose(&self, count: usize, rng: &mut ChaCha8Rng) -> Result<(Points, f64, bool), Error> {
        let d = self.prior.dim();
        let mut out = Points::new(d);
        let Some(density) = &self.density else {
            for _ in 0..count {
                out.push(&self.prior.sample(rng))?;
            }
            return Ok((out, 1.0, true));
        };
        let scouts = density.sample(&self.observation, SCOUTS, rng)?;
        let relative = self.relative(density, &scouts)?;
        let mut sorted = relative.clone();
        sorted.sort_by(f64::total_cmp);
        let threshold = sorted[(CUT_OFF * SCOUTS as f64) as usize];
        let window = window(&self.prior, &scouts);
        let mut tries = 0;
        while out.len() < count && tries < TRIES * count {
            let mut candidates = Points::new(d);
            for _ in 0..count {
                if let Some(theta) = self.prior.sample_within(&window, rng) {
                    candidates.push(&theta)?;
                }
            }
            tries += count;
            for (t, r) in candidates.rows().zip(self.relative(density, &candidates)?) {
                if r >= threshold && out.len() < count {
                    out.push(t)?;
                }
            }
        }
        let acceptance = out.len() as f64 / tries.max(1) as f64;
        let exact = out.len() == count;
        if !exact {
            // Draws of the posterior, weighted back to the prior.
            let top = relative.iter().fold(f64::INFINITY, |m, r| m.min(*r));
            let sums = cumulative(relative.iter().map(|r| (top - r.max(threshold)).exp()));
            while out.len() < count {
                out.push(scouts.row(pick(&sums, rng)))?;
            }
        }
        Ok((out, acceptance, exact))
    }

    /// `ln` of density over prior.
    fn relative(&self, density: &D, theta: &Points) -> Result<Vec<f64>, Error> {
        let ln = density.ln_densities(theta, &self.observation)?;
        theta.rows().zip(ln).map(|(t, l)| Ok(l - self.prior.ln_density(t)?)).collect()
    }
}

/// The range of the draws in each coordinate, a tenth wider on either side.
fn window(prior: &Prior, scouts: &Points) -> Vec<[f64; 2]> {
    let mut out = vec![[f64::INFINITY, f64::NEG_INFINITY]; prior.dim()];
    for t in scouts.rows() {
        for (range, u) in out.iter_mut().zip(prior.coordinates(t)) {
            *range = [range[0].min(u), range[1].max(u)];
        }
    }
    for (range, bounds) in out.iter_mut().zip(prior.bounds()) {
        let margin = 0.1 * (range[1] - range[0]);
        *range = [(range[0] - margin).max(bounds[0]), (range[1] + margin).min(bounds[1])];
    }
    out
}

impl<D: ConditionalDensity + Saved> Rounds<D> {
    /// Goes on from a file, or begins if there is none; the file has to be of the same prior, observation and seed.
    ///
    /// # Errors
    /// [`Error::Mismatch`] for a file of other rounds; [`Error::Io`], [`Error::Format`]; those of [`Rounds::new`].
    pub fn resume(path: &Path, prior: Prior, observation: Vec<f64>, seed: u64) -> Result<Self, Error> {
        let fresh = Self::new(prior, observation, seed)?;
        if !path.exists() {
            return Ok(fresh);
        }
        let found = Self::load(path)?;
        let what = |r: &Self| format!("{:?}, {:?}, seed {}", r.prior, r.observation, r.seed);
        if what(&found) != what(&fresh) {
            return Err(Error::Mismatch { what: "rounds", left: what(&found), right: what(&fresh) });
        }
        Ok(found)
    }
}
