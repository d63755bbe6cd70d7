//! The noise that a fit's residuals show.

use crate::fit::bordered::Eliminated;
use crate::fit::columns::whitened_columns;
use crate::fit::optimum::Fit;
use crate::linalg::{determined, dot, gram, rank};
use crate::model::PredictError;
use crate::noise::rule::{NoiseRule, NoiseState};
use crate::problem::{Problem, Selection};

/// The likeliest noise of each channel given a fit's residuals (restricted to what the nuisance parameters leave).
pub(crate) fn estimate_noise(
    problem: &Problem<'_>,
    selection: &Selection,
    rule: &NoiseRule,
    shared: &[f64],
    nuisance: &[Vec<f64>],
) -> Result<NoiseState, PredictError> {
    let channels = problem.channels();
    let all = Leftovers::new(problem, selection, shared, nuisance)?;
    let mut state = NoiseState { shape: vec![0; channels], sigma: vec![1.0; channels] };
    for channel in 0..channels {
        let left = all.of(problem, rule, channel, selection);
        let higher = |a: &(f64, f64), b: &(f64, f64)| a.0 > b.0;
        let mut best = (0, (f64::NEG_INFINITY, 1.0));
        for &shape in &rule.allowed {
            let value = left.under(shape);
            if higher(&value, &best.1) {
                best = (shape, value);
            }
        }
        let (shape, (_, sigma)) =
            problem.family.climb(best, |s| rule.admits(s), |shape| left.under(shape), higher);
        state.shape[channel] = shape;
        state.sigma[channel] = sigma;
    }
    Ok(state)
}

/// A shape that the noise of a channel may have, its sigma then, and how probable that is.
pub(crate) struct OpenShape {
    pub(crate) shape: usize,
    pub(crate) sigma: f64,
    pub(crate) weight: f64,
}

/// The shapes of noise that a fit's residuals leave open, by channel, for somebody who prefers no kind.
pub(crate) fn open_shapes(
    problem: &Problem<'_>,
    selection: &Selection,
    rule: &NoiseRule,
    fit: &Fit,
) -> Result<Vec<Vec<OpenShape>>, PredictError> {
    /// Shapes that are less likely than the best by more than this factor are left out.
    const LEAST: f64 = 0.05;
    let all = Leftovers::new(problem, selection, &fit.shared, &fit.nuisance)?;
    let prior = problem.family.indifferent(&rule.allowed);
    let open = |channel: usize| {
        let left = all.of(problem, rule, channel, selection);
        let scored: Vec<(usize, f64, f64)> = rule
            .allowed
            .iter()
            .zip(&prior)
            .map(|(&shape, weight)| {
                let (score, sigma) = left.under(shape);
                (shape, sigma, score - rule.log_prior(problem, shape) + weight.ln())
            })
            .collect();
        let best = scored.iter().map(|s| s.2).fold(f64::NEG_INFINITY, f64::max);
        let weighed = scored.into_iter().map(|(shape, sigma, log)| (shape, sigma, (log - best).exp()));
        let kept: Vec<_> = weighed.filter(|k| k.2 >= LEAST).collect();
        let total: f64 = kept.iter().map(|k| k.2).sum();
        kept.into_iter().map(|(shape, sigma, w)| OpenShape { shape, sigma, weight: w / total }).collect()
    };
    Ok((0..problem.channels()).map(open).collect())
}

/// What a fit leaves in all channels, and the columns of its nuisance parameters, not yet whitened.
struct Leftovers {
    raw: Vec<Vec<Vec<f64>>>,
    nuisance_columns: Vec<Vec<Vec<usize>>>,
}

impl Leftovers {
    fn new(
        problem: &Problem<'_>,
        selection: &Selection,
        shared: &[f64],
        nuisance: &[Vec<f64>],
    ) -> Result<Self, PredictError> {
        let channels = problem.channels();
        let white = NoiseState { shape: vec![0; channels], sigma: vec![1.0; channels] };
        let alone = selection.without_shared();
        let raw =
            problem.by_run(|run| whitened_columns(problem, &alone, &white, run, shared, &nuisance[run]))?;
        let nuisance_columns = (0..nuisance.len())
            .map(|run| channel_columns(problem, run, &raw[run][..selection.nuisance.len()]))
            .collect();
        Ok(Self { raw, nuisance_columns })
    }

    fn of<'a>(
        &'a self,
        problem: &'a Problem<'a>,
        rule: &'a NoiseRule,
        channel: usize,
        selection: &'a Selection,
    ) -> Left<'a> {
        Left { problem, rule, raw: &self.raw, nuisance_columns: &self.nuisance_columns, channel, selection }
    }
}

/// What a fit leaves in one channel: residuals and nuisance parameters' columns, not yet whitened.
struct Left<'a> {
    problem: &'a Problem<'a>,
    rule: &'a NoiseRule,
    raw: &'a [Vec<Vec<f64>>],
    nuisance_columns: &'a [Vec<Vec<usize>>],
    channel: usize,
    selection: &'a Selection,
}

impl Left<'_> {
    /// Log likelihood with the prior's weight, and sigma, under a shape of noise.
    fn under(&self, shape: usize) -> (f64, f64) {
        let Self { problem, rule, channel, .. } = *self;
        let of_noise = problem.family.shape(shape);
        if !rule.may_have(channel, &of_noise) {
            return (f64::NEG_INFINITY, 1.0);
        }
        let mut sums = Sums::default();
        for (run, columns) in self.raw.iter().enumerate() {
            let start: usize = (0..channel).map(|c| problem.rows[run].valid[c].len()).sum();
            let end = start + problem.rows[run].valid[channel].len();
            let whitener = problem.whitener(run, channel, shape);
            let mine = &self.nuisance_columns[run][channel];
            let n_nuisance = mine.len();
            let raw = mine.iter().copied().chain([columns.len() - 1]);
            let mut whitened: Vec<Vec<f64>> = raw.map(|k| columns[k][start..end].to_vec()).collect();
            whitener.whiten_all(&mut whitened);
            // The nuisance parameters are fitted anew under each shape: what they were under another one is no evidence.
            let normal = gram(&whitened);
            let block = normal.view((0, 0), (n_nuisance, n_nuisance)).into_owned();
            let residual = (0..n_nuisance).map(|i| normal[(n_nuisance, i)]).collect();
            let run = Eliminated::new(block, rank::CHANNEL, std::iter::once(residual));
            sums.squares += (normal[(n_nuisance, n_nuisance)] - run.explained()).max(0.0);
            sums.log_determinant += whitener.log_determinant + run.log_determinant();
            sums.used += run.rank();
            sums.rows += end - start;
        }
        let total: usize = (0..problem.channels()).map(|c| problem.count(c)).sum();
        let share = sums.rows as f64 / total.max(1) as f64;
        let freedom =
            (sums.rows as f64 - sums.used as f64 - share * self.selection.shared.len() as f64).max(1.0);
        let sigma = rule.sigma(channel, &of_noise, (sums.squares / freedom).sqrt());
        let score = rule.log_prior(problem, shape)
            - freedom * sigma.ln()
            - 0.5 * sums.log_determinant
            - 0.5 * sums.squares / (sigma * sigma);
        (score, sigma)
    }
}

/// For each channel, which of a run's nuisance columns (all channels one after the other) it determines.
fn channel_columns(problem: &Problem<'_>, run: usize, columns: &[Vec<f64>]) -> Vec<Vec<usize>> {
    let mut start = 0;
    let squares: Vec<Vec<f64>> = problem.rows[run]
        .valid
        .iter()
        .map(|rows| {
            let part = start..start + rows.len();
            start = part.end;
            columns.iter().map(|c| dot(&c[part.clone()], &c[part.clone()])).collect()
        })
        .collect();
    let largest: Vec<f64> =
        (0..columns.len()).map(|k| squares.iter().map(|s| s[k]).fold(0.0, f64::max)).collect();
    squares.iter().map(|here| determined(here, &largest)).collect()
}

#[derive(Default)]
struct Sums {
    squares: f64,
    log_determinant: f64,
    used: usize,
    rows: usize,
}
