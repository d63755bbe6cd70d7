//! A posterior on a lattice that is zoomed to where it has its mass.

use super::ExactModel;
use crate::features::Features;

/// Points along e and along log10 kappa.
const POINTS: [usize; 2] = [121, 61];
/// Rounds of zooming at most.
const ROUNDS: usize = 30;
/// Points further below the peak than this, in nats, are left out of the next round.
const DEEP: f64 = 18.0;
/// A box that shrinks by less than this factor in both directions is good.
const STILL: f64 = 0.8;

/// The posterior over (e, log10 kappa) on a lattice, flat prior.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactPosterior {
    bounds: [[f64; 2]; 2],
    /// Probability of each cell, e by e.
    mass: Vec<f64>,
    /// Log of the likelihood's integral over the box, per unit of the prior's area.
    ln_scale: f64,
}

/// The exact posterior of drops of one ball in a box of (e, log10 kappa); `None` where no ball in the box can have made them.
///
pub fn exact_posterior(
    model: &ExactModel,
    drops: &[Features],
    bounds: [[f64; 2]; 2],
) -> Option<ExactPosterior> {
    let mut at = bounds;
    let mut scores = vec![0.0; POINTS[0] * POINTS[1]];
    for round in 0..ROUNDS {
        for i in 0..POINTS[0] {
            let row = &mut scores[i * POINTS[1]..(i + 1) * POINTS[1]];
            score(model, drops, node(&at, 0, i), &at, row);
        }
        let top = scores.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let next = around(&scores, top, &at);
        let still = (0..2).all(|k| next[k][1] - next[k][0] > STILL * (at[k][1] - at[k][0]));
        if still || round + 1 == ROUNDS {
            return (top > IMPOSSIBLE).then(|| ExactPosterior::new(at, &scores, top));
        }
        at = next;
    }
    None
}

/// Scores below this are no log likelihoods.
const IMPOSSIBLE: f64 = -1e9;

/// Log likelihoods along log10 kappa at one e. An e that cannot be has a score that rises towards those that can.
fn score(model: &ExactModel, drops: &[Features], e: f64, at: &[[f64; 2]; 2], row: &mut [f64]) {
    let mut off = 0.0;
    for x in drops {
        match model.latent(x, e) {
            Some(latent) if latent.release > 0.0 => {}
            Some(latent) => off += 1e10 * (1.0 + latent.release.abs()),
            None => off += 1e10 * (1e3 + (1.0 - x.time_ratio / e).abs()),
        }
    }
    if off > 0.0 {
        row.fill(-off);
        return;
    }
    for (j, score) in row.iter_mut().enumerate() {
        let log10_kappa = node(at, 1, j);
        *score = drops.iter().map(|x| model.ln_likelihood(x, e, log10_kappa)).sum();
    }
}

/// Middle of a cell.
fn node(at: &[[f64; 2]; 2], k: usize, i: usize) -> f64 {
    at[k][0] + (at[k][1] - at[k][0]) * (i as f64 + 0.5) / POINTS[k] as f64
}

/// The box around all scores near the top, one cell wider on all sides and within the former one.
fn around(scores: &[f64], top: f64, at: &[[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let deep = if top > IMPOSSIBLE { top - DEEP } else { top };
    let (mut low, mut high) = (POINTS, [0, 0]);
    for (n, _) in scores.iter().enumerate().filter(|(_, s)| **s >= deep) {
        for (k, i) in [(0, n / POINTS[1]), (1, n % POINTS[1])] {
            (low[k], high[k]) = (low[k].min(i), high[k].max(i));
        }
    }
    [0, 1].map(|k| {
        let step = (at[k][1] - at[k][0]) / POINTS[k] as f64;
        let edge = |i: f64| (at[k][0] + step * i).clamp(at[k][0], at[k][1]);
        [edge(low[k] as f64 - 1.0), edge(high[k] as f64 + 2.0)]
    })
}

impl ExactPosterior {
    fn new(bounds: [[f64; 2]; 2], scores: &[f64], top: f64) -> Self {
        let mut mass: Vec<f64> =
            scores.iter().map(|s| if *s > IMPOSSIBLE { (s - top).exp() } else { 0.0 }).collect();
        let total: f64 = mass.iter().sum();
        mass.iter_mut().for_each(|m| *m /= total);
        let cell = [0, 1].map(|k| (bounds[k][1] - bounds[k][0]) / POINTS[k] as f64);
        Self { bounds, mass, ln_scale: top + total.ln() + (cell[0] * cell[1]).ln() }
    }

    fn mean_of(&self, f: impl Fn([f64; 2]) -> f64) -> f64 {
        let at = |n: usize| [node(&self.bounds, 0, n / POINTS[1]), node(&self.bounds, 1, n % POINTS[1])];
        self.mass.iter().enumerate().map(|(n, m)| m * f(at(n))).sum()
    }

    /// Means of e and log10 kappa.
    pub fn mean(&self) -> [f64; 2] {
        [0, 1].map(|k| self.mean_of(|t| t[k]))
    }

    /// Standard deviations of e and log10 kappa.
    pub fn sigma(&self) -> [f64; 2] {
        let mean = self.mean();
        [0, 1].map(|k| self.mean_of(|t| (t[k] - mean[k]).powi(2)).sqrt())
    }

    /// Probability that a parameter (0: e, 1: log10 kappa) is below a value.
    pub fn below(&self, parameter: usize, value: f64) -> f64 {
        let [low, high] = self.bounds[parameter];
        let cell = (value - low) / (high - low) * POINTS[parameter] as f64;
        let share = |i: usize| (cell - i as f64).clamp(0.0, 1.0);
        let index = |n: usize| if parameter == 0 { n / POINTS[1] } else { n % POINTS[1] };
        self.mass.iter().enumerate().map(|(n, m)| m * share(index(n))).sum()
    }

    /// Log density at (e, log10 kappa), from the likelihood there and the lattice's integral.
    pub fn ln_density(&self, model: &ExactModel, drops: &[Features], theta: [f64; 2]) -> f64 {
        drops.iter().map(|x| model.ln_likelihood(x, theta[0], theta[1])).sum::<f64>() - self.ln_scale
    }

    /// The peak of a parameter's marginal, to a cell of the lattice.
    pub fn peak(&self, parameter: usize) -> f64 {
        let mut sums = vec![0.0; POINTS[parameter]];
        for (n, m) in self.mass.iter().enumerate() {
            sums[if parameter == 0 { n / POINTS[1] } else { n % POINTS[1] }] += m;
        }
        let best = (0..sums.len()).fold(0, |b, i| if sums[i] > sums[b] { i } else { b });
        node(&self.bounds, parameter, best)
    }
}
