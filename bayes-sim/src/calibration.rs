//! Whether a learned posterior can be believed: ranks, coverage, and tests at one observation.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::c2st::Classifier;
use crate::campaign::Simulator;
use crate::error::Error;
use crate::points::{Points, check_row};
use crate::posterior::ConditionalDensity;
use crate::scaling::mean_sd;
use crate::simulations::Simulations;

/// A generator for row `i` alone, so that results do not depend on threads.
fn generator(seed: u64, i: usize) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(i as u64 + 1);
    rng
}

/// Ranks of simulation-based calibration (Talts et al. 2018, arXiv:1804.06788).
#[derive(Debug, Clone, PartialEq)]
pub struct Ranks {
    /// For each test simulation and parameter: how many of the draws lie below the truth, 0 to `draws`.
    pub ranks: Vec<Vec<usize>>,
    /// Draws from each posterior.
    pub draws: usize,
}

impl Ranks {
    /// For each parameter, the p-value of a chi-squared test of flat ranks in about `sqrt` of the number of simulations bins.
    pub fn p_values(&self) -> Vec<f64> {
        let n = self.ranks.len();
        let bins = ((n as f64).sqrt() as usize).clamp(2, 20).min(self.draws + 1);
        (0..self.ranks.first().map_or(0, Vec::len))
            .map(|j| {
                let mut counts = vec![0.0_f64; bins];
                self.ranks.iter().for_each(|r| counts[r[j] * bins / (self.draws + 1)] += 1.0);
                // Ranks per bin, which do not always divide evenly.
                let statistic: f64 = (0..bins)
                    .map(|b| {
                        let ranks = (0..=self.draws).filter(|r| r * bins / (self.draws + 1) == b).count();
                        let expected = n as f64 * ranks as f64 / (self.draws + 1) as f64;
                        (counts[b] - expected).powi(2) / expected
                    })
                    .sum();
                ChiSquared::new((bins - 1) as f64).map_or(f64::NAN, |c| c.sf(statistic))
            })
            .collect()
    }
}

/// Ranks of the true parameters of test simulations (not those trained on) among `draws` draws of their posteriors.
///
/// # Errors
/// [`Error::Length`], [`Error::NotFinite`] of the density; [`Error::Setting`] for no draw.
pub fn sbc_ranks(
    density: &dyn ConditionalDensity,
    tests: &Simulations,
    draws: usize,
    seed: u64,
) -> Result<Ranks, Error> {
    let ranks = each(tests, draws, seed, |theta, x, rng| {
        let sample = density.sample(x, draws, rng)?;
        Ok((0..theta.len()).map(|j| sample.rows().filter(|s| s[j] < theta[j]).count()).collect())
    })?;
    Ok(Ranks { ranks, draws })
}

/// Looks at each test simulation, in parallel, each with a generator of its own.
fn each<T: Send>(
    tests: &Simulations,
    draws: usize,
    seed: u64,
    look: impl Fn(&[f64], &[f64], &mut ChaCha8Rng) -> Result<T, Error> + Sync,
) -> Result<Vec<T>, Error> {
    if draws == 0 {
        return Err(Error::Setting { name: "draws", value: 0.0, rule: "at least 1" });
    }
    let row = |i| look(tests.theta().row(i), tests.x().row(i), &mut generator(seed, i));
    (0..tests.len()).into_par_iter().map(row).collect()
}

/// How often regions of a given probability hold the truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Coverage {
    /// For each test simulation, the probability of the smallest region that holds the truth; uniform if the posterior is right.
    pub credibility: Vec<f64>,
}

impl Coverage {
    /// Share of the truths within regions of this probability.
    pub fn at(&self, level: f64) -> f64 {
        let inside = self.credibility.iter().filter(|c| **c <= level).count();
        inside as f64 / self.credibility.len().max(1) as f64
    }

    /// Largest difference of coverage and level over all levels (the Kolmogorov-Smirnov statistic).
    pub fn largest_error(&self) -> f64 {
        let mut sorted = self.credibility.clone();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len() as f64;
        let gap = |(i, c): (usize, &f64)| (c - i as f64 / n).abs().max((c - (i + 1) as f64 / n).abs());
        sorted.iter().enumerate().map(gap).fold(0.0, f64::max)
    }

    /// Mean of coverage less level over all levels: above 0 for posteriors too wide, below for too narrow ones.
    pub fn mean_error(&self) -> f64 {
        0.5 - mean_sd(&self.credibility).0
    }
}

/// Expected coverage of highest-density regions (Hermans et al. 2022, arXiv:2110.06581).
///
/// # Errors
/// As [`sbc_ranks`].
pub fn expected_coverage(
    density: &dyn ConditionalDensity,
    tests: &Simulations,
    draws: usize,
    seed: u64,
) -> Result<Coverage, Error> {
    let credibility = each(tests, draws, seed, |theta, x, rng| {
        let sample = density.sample(x, draws, rng)?;
        let truth = density.ln_density(theta, x)?;
        let above = density.ln_densities(&sample, x)?.iter().filter(|l| **l > truth).count();
        Ok(randomised(above, draws, rng))
    })?;
    Ok(Coverage { credibility })
}

/// A rank among draws as a number in 0..1, uniform for an exact posterior.
fn randomised(rank: usize, draws: usize, rng: &mut ChaCha8Rng) -> f64 {
    (rank as f64 + rng.random::<f64>()) / (draws + 1) as f64
}

/// Tests of accuracy with random points: coverage of balls about a random point of the prior (Lemos et al. 2023,
/// arXiv:2302.03026), in coordinates scaled by the prior's draws. Needs no density.
///
/// # Errors
/// As [`sbc_ranks`].
pub fn tarp(
    density: &dyn ConditionalDensity,
    tests: &Simulations,
    draws: usize,
    seed: u64,
) -> Result<Coverage, Error> {
    let prior = density.prior();
    let scales: Vec<f64> = (0..prior.dim())
        .map(|j| {
            let column: Vec<f64> = tests.theta().rows().map(|t| prior.coordinates(t)[j]).collect();
            mean_sd(&column).1.max(f64::MIN_POSITIVE)
        })
        .collect();
    let credibility = each(tests, draws, seed, |theta, x, rng| {
        let centre = prior.coordinates(&prior.sample(rng));
        let distance = |t: &[f64]| -> f64 {
            let u = prior.coordinates(t);
            (0..u.len()).map(|j| ((u[j] - centre[j]) / scales[j]).powi(2)).sum()
        };
        let sample = density.sample(x, draws, rng)?;
        let truth = distance(theta);
        let nearer = sample.rows().filter(|s| distance(s) < truth).count();
        Ok(randomised(nearer, draws, rng))
    })?;
    Ok(Coverage { credibility })
}

/// What a local test says of the posterior at one observation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalC2st {
    /// Mean squared deviation of the classifier's probability from one half at the observation; 0 for a perfect posterior.
    pub statistic: f64,
    /// Share of classifiers trained on nothing to tell that deviate as much.
    pub p_value: f64,
}

/// Local classifier two-sample test (Linhart, Gramfort and Rodrigues 2023, arXiv:2306.03580): a classifier learns to tell true
/// parameters from drawn ones, both beside their observation, and is asked at the observation of interest. `null_trials`
/// classifiers on shuffled labels say what is chance; 100 takes a minute for a thousand simulations.
///
/// # Errors
/// As [`sbc_ranks`]; [`Error::Setting`] for no trial.
pub fn local_c2st(
    density: &dyn ConditionalDensity,
    tests: &Simulations,
    observation: &[f64],
    null_trials: usize,
    seed: u64,
) -> Result<LocalC2st, Error> {
    const DRAWS: usize = 1000;
    if null_trials == 0 {
        return Err(Error::Setting { name: "null_trials", value: 0.0, rule: "at least 1" });
    }
    check_row("observation", observation, density.x_dim())?;
    let mut rows: Vec<(Vec<f64>, f64)> = Vec::with_capacity(2 * tests.len());
    for i in 0..tests.len() {
        let (theta, x) = (tests.theta().row(i), tests.x().row(i));
        let drawn = density.sample(x, 1, &mut generator(seed, i))?;
        rows.push((theta.iter().chain(x).copied().collect(), 0.0));
        rows.push((drawn.row(0).iter().chain(x).copied().collect(), 1.0));
    }
    let at = density.sample(observation, DRAWS, &mut generator(seed, tests.len()))?;
    let mut asked: Vec<Vec<f64>> =
        at.rows().map(|t| t.iter().chain(observation).copied().collect()).collect();
    let width = rows[0].0.len();
    for j in 0..width {
        let column: Vec<f64> = rows.iter().map(|r| r.0[j]).collect();
        let (mean, sd) = mean_sd(&column);
        let scale = if sd > 0.0 { sd } else { 1.0 };
        rows.iter_mut().map(|r| &mut r.0).chain(&mut asked).for_each(|r| r[j] = (r[j] - mean) / scale);
    }
    let indices: Vec<usize> = (0..rows.len()).collect();
    let statistic = |rows: &[(Vec<f64>, f64)], rng: &mut ChaCha8Rng| {
        let classifier = Classifier::fit(rows, &indices, rng);
        let off = asked.iter().map(|a| (1.0 / (1.0 + (-classifier.logit(a)).exp()) - 0.5).powi(2));
        off.sum::<f64>() / DRAWS as f64
    };
    let seen = statistic(&rows, &mut generator(seed, tests.len() + 1));
    let as_large: usize = (0..null_trials)
        .into_par_iter()
        .map(|trial| {
            let mut rng = generator(seed, tests.len() + 2 + trial);
            let mut shuffled = rows.clone();
            // A pair of one observation swaps its labels or does not.
            for pair in shuffled.chunks_exact_mut(2) {
                let swap = f64::from(u8::from(rng.random::<bool>()));
                (pair[0].1, pair[1].1) = (swap, 1.0 - swap);
            }
            usize::from(statistic(&shuffled, &mut rng) >= seen)
        })
        .sum();
    Ok(LocalC2st { statistic: seen, p_value: (as_large + 1) as f64 / (null_trials + 1) as f64 })
}

/// Where an observation lies among simulations from its posterior.
#[derive(Debug, Clone, PartialEq)]
pub struct PredictiveCheck {
    /// For each feature, the share of simulations below the observation; near 0 or 1 where the model cannot reach it.
    pub below: Vec<f64>,
    /// Two-sided p-value of the worst feature, multiplied by the number of features (Bonferroni), at most 1.
    pub p_value: f64,
    /// Simulations that failed and were left out.
    pub failures: usize,
}

/// Posterior predictive check: simulates with `draws` parameters of the posterior and compares every feature.
///
/// # Errors
/// As [`sbc_ranks`]; [`Error::TooFew`] if fewer than 20 simulations succeed.
pub fn predictive_check(
    density: &dyn ConditionalDensity,
    simulator: &dyn Simulator,
    observation: &[f64],
    draws: usize,
    seed: u64,
) -> Result<PredictiveCheck, Error> {
    check_row("observation", observation, density.x_dim())?;
    let theta = density.sample(observation, draws, &mut generator(seed, 0))?;
    let simulated: Vec<Option<Vec<f64>>> = (0..draws)
        .into_par_iter()
        .map(|i| simulator.simulate(theta.row(i), &mut generator(seed, i + 1)).ok())
        .collect();
    let good: Points = Points::from_rows(observation.len(), simulated.iter().flatten().map(Vec::as_slice))?;
    if good.len() < 20 {
        return Err(Error::TooFew { least: 20, got: good.len() });
    }
    let n = good.len() as f64;
    let below: Vec<f64> = (0..observation.len())
        .map(|j| {
            // Equal values count half: a feature that is a count has many.
            let at = |s: &[f64]| {
                if s[j] < observation[j] {
                    1.0
                } else if s[j] == observation[j] {
                    0.5
                } else {
                    0.0
                }
            };
            (good.rows().map(at).sum::<f64>() + 0.5) / (n + 1.0)
        })
        .collect();
    let worst = below.iter().map(|b| 2.0 * b.min(1.0 - b)).fold(1.0, f64::min);
    Ok(PredictiveCheck {
        p_value: (worst * below.len() as f64).min(1.0),
        below,
        failures: draws - good.len(),
    })
}
