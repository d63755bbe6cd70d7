//! A warning for an observation that no simulation resembles: a network answers there too, and its answer means nothing.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::points::{Points, check_row};
use crate::scaling::InputScaling;

/// Neighbours over which distance is taken.
const NEIGHBOURS: usize = 5;
/// Most reference simulations, and most distances that say what is usual.
const MOST: usize = 2000;

/// What is usual among simulations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Novelty {
    scaling: InputScaling,
    /// Simulations that distances are taken to; files have it as `kept`.
    #[serde(rename = "kept")]
    reference: Points,
    low: Vec<f64>,
    high: Vec<f64>,
    /// Distances of simulations left out, ascending.
    usual: Vec<f64>,
}

/// How an observation compares with the simulations.
#[derive(Debug, Clone, PartialEq)]
pub struct Resemblance {
    /// Share of simulations as far from the others as this observation; small for one that nothing resembles.
    pub p_value: f64,
    /// Features beyond every simulation, with the range seen, in standardised units.
    pub beyond: Vec<usize>,
}

impl Resemblance {
    /// Whether to warn: fewer than one simulation in a hundred is as far out.
    pub fn is_doubtful(&self) -> bool {
        self.p_value < 0.01
    }
}

impl Novelty {
    /// Learns what is usual.
    ///
    /// # Errors
    /// [`Error::TooFew`] below 50 simulations; [`Error::NotFinite`].
    pub fn new(x: &Points, seed: u64) -> Result<Self, Error> {
        x.check_finite("features")?;
        if x.len() < 50 {
            return Err(Error::TooFew { least: 50, got: x.len() });
        }
        let scaling = InputScaling::fit(x);
        let mut order: Vec<usize> = (0..x.len()).collect();
        order.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
        let half = (x.len() / 2).min(MOST);
        let scaled = |indices: &[usize]| {
            let mut values = Vec::with_capacity(indices.len() * x.dim());
            indices.iter().for_each(|&i| scaling.apply(x.row(i), &mut values));
            Points::from_values(x.dim(), values)
        };
        let (reference, left_out) = (scaled(&order[..half])?, scaled(&order[half..2 * half])?);
        let all = scaled(&order)?;
        let extreme = |pick: fn(f64, f64) -> f64, from: f64| -> Vec<f64> {
            (0..x.dim()).map(|j| all.column(j).into_iter().fold(from, pick)).collect()
        };
        let (low, high) = (extreme(f64::min, f64::INFINITY), extreme(f64::max, f64::NEG_INFINITY));
        let mut usual: Vec<f64> = left_out.rows().map(|r| distance(&reference, r)).collect();
        usual.sort_by(f64::total_cmp);
        Ok(Self { scaling, reference, low, high, usual })
    }

    /// Compares an observation with the simulations: its distance to its five nearest, against the same of simulations left out.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::NotFinite`].
    pub fn compare(&self, observation: &[f64]) -> Result<Resemblance, Error> {
        check_row("observation", observation, self.scaling.dim())?;
        let mut z = Vec::with_capacity(observation.len());
        self.scaling.apply(observation, &mut z);
        let far = distance(&self.reference, &z);
        let as_far = self.usual.len() - self.usual.partition_point(|u| *u < far);
        let beyond = (0..z.len()).filter(|&j| z[j] < self.low[j] || z[j] > self.high[j]).collect();
        Ok(Resemblance { p_value: (as_far + 1) as f64 / (self.usual.len() + 1) as f64, beyond })
    }
}

/// Root mean square distance to the nearest.
fn distance(reference: &Points, z: &[f64]) -> f64 {
    let mut nearest = [f64::INFINITY; NEIGHBOURS];
    for row in reference.rows() {
        let mut d: f64 = row.iter().zip(z).map(|(a, b)| (a - b) * (a - b)).sum();
        for n in &mut nearest {
            if d < *n {
                std::mem::swap(&mut d, n);
            }
        }
    }
    (nearest.iter().sum::<f64>() / NEIGHBOURS as f64).sqrt()
}
