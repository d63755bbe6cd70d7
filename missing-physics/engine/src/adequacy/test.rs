//! Is a model adequate? Several tests with one p-value, calibrated by a parametric bootstrap of the whole fit.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Gamma, Normal};

use crate::adequacy::linearised::{Linearised, Reading};
use crate::diagnosis::TestOutcome;
use crate::fit::gauss_newton::{Fit, NoiseRule};
use crate::model::PredictError;
use crate::problem::{Problem, Selection};

/// What the tests say of a model.
#[derive(Debug, Clone)]
pub(crate) struct Adequacy {
    pub(crate) p_value: f64,
    pub(crate) p_floor: f64,
    pub(crate) tests: Vec<TestOutcome>,
}

/// A test that looks for nothing in particular must be this much surer than one that looks for a listed mechanism.
const UNDIRECTED_WEIGHT: f64 = 3.0;

/// Tests a fitted model against the mechanisms `rivals`, smooth functions of every variable, serial correlation, shifts of
/// runs and of intervals, and the calibrated noise.
pub(crate) fn test(
    problem: &Problem<'_>,
    selection: &Selection,
    fit: &Fit,
    rivals: &[usize],
    rule: &NoiseRule,
    replicates: usize,
    seed: u64,
) -> Result<Adequacy, PredictError> {
    let mut linearised = Linearised::new(problem, selection, fit, rivals, rule)?;
    let observed = residuals(problem, fit)?;
    let truth = linearised.sharpen(&observed);
    // Shapes that such worlds never choose, nor these data under any alternative, need not be tried again for each of them.
    let mut wanted: Vec<usize> = truth.iter().map(|&(shape, _)| shape).chain([0]).collect();
    let pilots: Vec<Reading> = (0..12u64)
        .into_par_iter()
        .map(|k| linearised.read(&draw(problem, &truth, rule, seed ^ 0x5eed, k)))
        .collect();
    for reading in pilots.iter().chain([&linearised.read(&observed)]) {
        wanted.extend(reading.noise.iter().map(|&(s, _)| linearised.in_play()[s]));
    }
    wanted.sort_unstable();
    wanted.dedup();
    linearised.play(&wanted);

    let statistics = |data: &[Vec<Vec<f64>>]| -> Vec<f64> {
        let reading = linearised.read(data);
        let white = linearised.whitened_residual(data, &reading);
        let mut all = reading.gains;
        all.extend(omnibus(problem, &white, rule));
        all
    };
    let seen = statistics(&observed);
    let null: Vec<Vec<f64>> = (0..replicates as u64)
        .into_par_iter()
        .map(|k| statistics(&draw(problem, &truth, rule, seed, k)))
        .collect();
    let tails: Vec<Tail> = (0..seen.len()).map(|t| Tail::new(null.iter().map(|row| row[t]))).collect();
    let directed = linearised.mechanisms;
    let smallest = |row: &[f64]| {
        let weighted = row.iter().zip(&tails).enumerate().map(|(t, (x, tail))| {
            let weight = if t < directed { 1.0 } else { UNDIRECTED_WEIGHT };
            weight * tail.p(*x)
        });
        weighted.fold(f64::INFINITY, f64::min)
    };
    let observed_smallest = smallest(&seen);
    let below = null.iter().filter(|row| smallest(row) <= observed_smallest).count();
    let floor = 1.0 / (replicates as f64 + 1.0);
    let names = linearised.alternatives.iter().map(|a| a.name.clone()).chain(omnibus_names(problem, rule));
    let mut tests: Vec<TestOutcome> = names
        .zip(seen.iter().zip(&tails))
        .map(|(name, (&statistic, tail))| TestOutcome { name, statistic, p_value: tail.p(statistic) })
        .collect();
    tests.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
    Ok(Adequacy { p_value: (below as f64 + 1.0) * floor, p_floor: floor, tests })
}

/// Measured less predicted, `[run][channel]`, measured rows only.
pub(crate) fn residuals(problem: &Problem<'_>, fit: &Fit) -> Result<Vec<Vec<Vec<f64>>>, PredictError> {
    problem
        .recording
        .runs
        .iter()
        .enumerate()
        .map(|(run, data)| {
            let n = data.len();
            let mut out = vec![0.0; n * problem.channels()];
            problem.model.predict(data, &fit.shared, &fit.nuisance[run], &mut out)?;
            Ok((0..problem.channels())
                .map(|c| {
                    problem.rows[run].valid[c].iter().map(|&i| data.outputs[c][i] - out[c * n + i]).collect()
                })
                .collect())
        })
        .collect()
}

/// Noise alone, `[run][channel]`: what the residual of a true model looks like before the model is fitted.
pub(crate) fn draw(
    problem: &Problem<'_>,
    noise: &[(usize, f64)],
    rule: &NoiseRule,
    seed: u64,
    stream: u64,
) -> Vec<Vec<Vec<f64>>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream + 1);
    let factors: Vec<f64> = rule
        .fixed_sigma
        .iter()
        .zip(&rule.uncertainty)
        .map(|(fixed, uncertainty)| {
            let z: f64 = StandardNormal.sample(&mut rng);
            if fixed.is_some() { (uncertainty * z).exp() } else { 1.0 }
        })
        .collect();
    // One world for all runs; drawn from the stream's number, so that a model without any draws what it always drew.
    let world = stream as usize;
    (0..problem.rows.len())
        .map(|run| {
            let errors = problem.model.extensions().errors;
            let worlds = errors.map_or(&[][..], |errors| errors.null_samples(&problem.recording.runs[run]));
            let copies = worlds.get(world.checked_rem(worlds.len()).unwrap_or(0));
            let copy = copies.and_then(|c| c.get(rng.random_range(0..c.len().max(1))));
            (0..problem.channels())
                .map(|c| {
                    let valid = &problem.rows[run].valid[c];
                    let mut column: Vec<f64> = match copy {
                        Some(copy) => valid.iter().map(|&i| copy[c][i]).collect(),
                        None => valid.iter().map(|_| StandardNormal.sample(&mut rng)).collect(),
                    };
                    problem.whitener(run, c, noise[c].0).colour(&mut column);
                    column.iter_mut().for_each(|v| *v *= noise[c].1 * factors[c]);
                    column
                })
                .collect()
        })
        .collect()
}

fn omnibus_names(problem: &Problem<'_>, rule: &NoiseRule) -> Vec<String> {
    let mut names = Vec::new();
    for (c, channel) in problem.recording.channels.iter().enumerate() {
        let name = &channel.name;
        names.push(format!("{name}: neighbouring rows (8 lags)"));
        names.push(format!("{name}: neighbouring rows (24 lags)"));
        names.push(format!("{name}: shifts between runs"));
        names.push(format!("{name}: shifts of intervals of rows"));
        if rule.fixed_sigma[c].is_some() {
            names.push(format!("{name}: size against the known noise"));
        }
    }
    names
}

fn omnibus(problem: &Problem<'_>, white: &[Vec<Vec<f64>>], rule: &NoiseRule) -> Vec<f64> {
    let mut statistics = Vec::new();
    for c in 0..problem.channels() {
        let runs: Vec<&[f64]> = white.iter().map(|row| row[c].as_slice()).collect();
        let total: f64 = runs.iter().flat_map(|r| r.iter()).map(|v| v * v).sum();
        let rows: usize = runs.iter().map(|r| r.len()).sum();
        for lags in [8, 24] {
            statistics.push(portmanteau(&runs, total, rows, lags));
        }
        statistics.push(
            runs.iter()
                .filter(|r| !r.is_empty())
                .map(|r| r.iter().sum::<f64>().powi(2) / r.len() as f64)
                .sum(),
        );
        statistics.push(scan(&runs));
        if rule.fixed_sigma[c].is_some() {
            statistics.push(total / rows.max(1) as f64);
        }
    }
    statistics
}

/// Ljung and Box 1978 (doi:10.1093/biomet/65.2.297), correlations pooled over runs.
fn portmanteau(runs: &[&[f64]], total: f64, rows: usize, lags: usize) -> f64 {
    let n = rows as f64;
    (1..=lags)
        .map(|lag| {
            let pairs: usize = runs.iter().map(|r| r.len().saturating_sub(lag)).sum();
            if pairs < 4 || total <= 0.0 {
                return 0.0;
            }
            let sum: f64 =
                runs.iter().map(|r| r.iter().zip(r.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>()).sum();
            n * n * (sum / total).powi(2) / pairs as f64
        })
        .sum()
}

/// The largest standardised sum over an interval of relative position that all runs share.
fn scan(runs: &[&[f64]]) -> f64 {
    const BINS: usize = 16;
    let mut sums = [0.0; BINS + 1];
    let mut counts = [0.0; BINS + 1];
    for run in runs {
        for (i, v) in run.iter().enumerate() {
            let bin = i * BINS / run.len();
            sums[bin + 1] += v;
            counts[bin + 1] += 1.0;
        }
    }
    for i in 0..BINS {
        sums[i + 1] += sums[i];
        counts[i + 1] += counts[i];
    }
    let mut best: f64 = 0.0;
    for i in 0..BINS {
        for j in i + 1..=BINS {
            let n: f64 = counts[j] - counts[i];
            if n > 0.0 {
                best = best.max((sums[j] - sums[i]).abs() / n.sqrt());
            }
        }
    }
    best
}

/// The upper tail of a statistic's null distribution: a gamma law with its mean and variance, or the normal law that it becomes.
///
/// It only puts the tests on one scale; the p-value of all of them together is counted, not read from this law.
enum Tail {
    /// It does not vary.
    Constant,
    Gamma(Gamma),
    Normal(Normal),
}

/// From this shape on a gamma law is a normal one: its skewness is 0.02, and its tail, a series, takes time with the root of the shape.
/// Rounding alone varies by so little that the series would not end.
const NORMAL_SHAPE: f64 = 1e4;

impl Tail {
    fn new(values: impl Iterator<Item = f64>) -> Self {
        let values: Vec<f64> = values.filter(|v| v.is_finite()).collect();
        let n = values.len().max(1) as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
        if !(mean > 1e-9 && variance > 1e-18) {
            return Self::Constant;
        }
        let shape = mean * mean / variance;
        if shape < NORMAL_SHAPE {
            Gamma::new(shape, mean / variance).map_or(Self::Constant, Self::Gamma)
        } else {
            Normal::new(mean, variance.sqrt()).map_or(Self::Constant, Self::Normal)
        }
    }

    fn p(&self, value: f64) -> f64 {
        if !(value > 0.0 && value.is_finite()) {
            return 1.0;
        }
        match self {
            Self::Constant => 1.0,
            Self::Gamma(law) => law.sf(value).clamp(1e-300, 1.0),
            Self::Normal(law) => law.sf(value).clamp(1e-300, 1.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A statistic that varies by rounding alone (three rows, one of them a thousand times too deep) once took minutes.
    #[test]
    fn a_tail_takes_no_time_however_little_a_statistic_varies() {
        let begin = std::time::Instant::now();
        for spread in [1e-3, 1e-6, 1e-9, 1e-12] {
            let tail = Tail::new((0..999).map(|k| 1e3 * (1.0 + spread * f64::from(k % 7 - 3))));
            for value in [1.0, 999.0, 1e3, 1e3 * (1.0 + 4.0 * spread), 1e9] {
                assert!((0.0..=1.0).contains(&tail.p(value)));
            }
            assert!(tail.p(999.0) > 0.3 && tail.p(1e9) < 1e-9, "{spread}");
        }
        assert!(begin.elapsed().as_secs() < 20, "{:?}", begin.elapsed());
    }

    /// On both sides of the shape where the laws meet, the tail is the same to a skewness of 0.02.
    #[test]
    fn the_two_laws_meet() {
        let of =
            |spread: f64| Tail::new((0..1000).map(|k| 1.0 + spread * if k % 2 == 0 { 1.0 } else { -1.0 }));
        let [gamma, normal] = [of(0.01002), of(0.00998)];
        assert!(matches!(gamma, Tail::Gamma(_)) && matches!(normal, Tail::Normal(_)));
        for value in [0.98, 0.99, 1.0, 1.01, 1.02] {
            approx::assert_abs_diff_eq!(gamma.p(value), normal.p(value), epsilon = 0.006);
        }
    }
}
