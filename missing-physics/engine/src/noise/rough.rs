//! Noise as it is on the scale of a few rows: what varies more slowly may be something that a model lacks.

use nalgebra::{DMatrix, DVector};

use crate::fit::bordered::Eliminated;
use crate::fit::optimum::Fit;
use crate::fit::prediction::residuals;
use crate::linalg::{gram, legendre, rank};
use crate::model::PredictError;
use crate::noise::process::{Shape, Whitener};
use crate::noise::rule::NoiseRule;
use crate::problem::Problem;
use crate::statistics::median;

/// Rows of a window, and the fewest that show a correlation.
const WINDOW: [usize; 2] = [64, 24];
/// Rows of a window for each smooth function that is taken away from it.
const ROWS_OF_A_FUNCTION: usize = 8;
/// Windows that are looked at, at most.
const WINDOWS: usize = 64;
/// The longest correlation of rough noise: in rows, and as a part of a run.
const LONGEST: (f64, f64) = (2.8, 1.0 / 16.0);
/// Lags at which rough noise, once whitened, is not correlated by more than so much, and standard errors beyond that.
const LAGS: usize = 6;
const WHITE: (f64, f64) = (0.1, 2.5);

/// Noise on the scale of a few rows, by channel.
///
/// Beside noise whose neighbours are correlated many rows tell as much of what is slow as fewer rows with white noise of a larger sigma do.
#[derive(Debug, Clone)]
pub(crate) struct RoughNoise {
    /// Sigma of a reading.
    pub(crate) sigma: Vec<f64>,
    /// How rows are correlated.
    shape: Vec<Shape>,
}

impl RoughNoise {
    /// White noise.
    pub(crate) fn white(sigma: Vec<f64>) -> Self {
        Self { shape: vec![Shape::WHITE; sigma.len()], sigma }
    }

    /// What a fit leaves: of each channel the likeliest shape with a short correlation once everything smooth is taken away from windows of a
    /// few dozen rows, and its sigma; `white` is the channels' sigma where that shape is white.
    ///
    /// # Errors
    /// Where the model predicts nothing.
    pub(crate) fn new(
        problem: &Problem<'_>,
        rule: &NoiseRule,
        fit: &Fit,
        white: &[f64],
    ) -> Result<Self, PredictError> {
        let left = residuals(problem, fit)?;
        let mut noise = Self::white(white.to_vec());
        for channel in 0..problem.channels() {
            // Errors that accumulate are slow.
            if problem.family.shape(fit.noise.shape[channel]).accumulated > 0.0 {
                continue;
            }
            let windows = Windows::new(problem, channel, &left);
            if let Some((shape, sigma)) = windows.and_then(|windows| windows.likeliest(problem, rule)) {
                noise.shape[channel] = shape;
                noise.sigma[channel] = rule.fixed_sigma[channel].unwrap_or(sigma.max(rule.floor[channel]));
            }
        }
        Ok(noise)
    }

    /// Sigma of the white noise beside which slow effects are known as well as beside this noise.
    pub(crate) fn slow(&self) -> Vec<f64> {
        let slow = |(sigma, shape): (&f64, &Shape)| sigma * shape.of_means()[0].sqrt();
        self.sigma.iter().zip(&self.shape).map(slow).collect()
    }

    /// Rows with such white noise that tell as much as the rows of a channel do: the sum of squares that the noise leaves, in units of it.
    pub(crate) fn rows(&self, channel: usize, rows: usize) -> f64 {
        rows as f64 * self.block(channel, 1)
    }

    /// The square that the noise leaves of the mean of a block of so many neighbouring rows, times that number.
    pub(crate) fn block(&self, channel: usize, rows: usize) -> f64 {
        let shape = &self.shape[channel];
        shape.of_mean(rows) / shape.of_means()[0]
    }

    /// The same of all channels, row by row.
    pub(crate) fn all_rows(&self, problem: &Problem<'_>) -> f64 {
        (0..problem.channels()).map(|c| self.rows(c, problem.count(c))).sum()
    }

    /// Standard deviation of such a sum of squares.
    pub(crate) fn spread(&self, channel: usize, rows: f64) -> f64 {
        self.spread_of_blocks(channel, rows, 1)
    }

    fn spread_of_blocks(&self, channel: usize, blocks: f64, block: usize) -> f64 {
        let shape = &self.shape[channel];
        let [mean, squares] = shape.of_means();
        // Blocks are less correlated with each other the longer they are.
        let wider = 1.0 + (squares - 1.0) / block as f64;
        (2.0 * blocks * wider).sqrt() * shape.of_mean(block) / mean
    }

    /// The same of all channels, in blocks of so many rows.
    pub(crate) fn whole_spread(&self, problem: &Problem<'_>, block: usize) -> f64 {
        let blocks = |channel: usize| (problem.count(channel) as f64 / block as f64).ceil();
        let variance = |channel: usize| self.spread_of_blocks(channel, blocks(channel), block).powi(2);
        (0..problem.channels()).map(variance).sum::<f64>().sqrt()
    }
}

/// A few dozen rows of a run.
struct Window {
    /// Where they are along the noise variable, and by number.
    positions: [Vec<f64>; 2],
    /// Smooth functions and, last, what a fit leaves.
    columns: Vec<Vec<f64>>,
}

impl Window {
    fn whitener(&self, problem: &Problem<'_>, shape: Shape) -> Whitener {
        let [along, numbers] = &self.positions;
        if shape.by_row {
            Whitener::new(numbers, 1.0, shape)
        } else {
            Whitener::new(along, problem.step, shape)
        }
    }
}

struct Windows {
    all: Vec<Window>,
    longest: f64,
}

impl Windows {
    /// Windows of a channel, evenly spread over all runs; none where the runs are too short.
    fn new(problem: &Problem<'_>, channel: usize, left: &[Vec<Vec<f64>>]) -> Option<Self> {
        let [most, fewest] = WINDOW;
        let places = |(run, residual): (usize, &Vec<Vec<f64>>)| {
            let rows = residual[channel].len();
            let (count, length) = ((rows / most).max(usize::from(rows >= fewest)), rows.min(most));
            (0..count).map(move |i| (run, i * rows / count, length)).collect::<Vec<_>>()
        };
        let places: Vec<(usize, usize, usize)> = left.iter().enumerate().flat_map(places).collect();
        let of_place = |&(run, from, length): &(usize, usize, usize)| {
            let (rows, part) = (&problem.rows[run], from..from + length);
            let along = rows.positions[channel][part.clone()].to_vec();
            let numbers = rows.valid[channel][part.clone()].iter().map(|&i| i as f64).collect();
            let x: Vec<f64> = (0..length).map(|i| 2.0 * i as f64 / (length - 1) as f64 - 1.0).collect();
            let mut columns = legendre(&x, length / ROWS_OF_A_FUNCTION - 1);
            columns.push(left[run][channel][part].to_vec());
            Window { positions: [along, numbers], columns }
        };
        let stride = places.len().div_ceil(WINDOWS).max(1);
        let all: Vec<Window> = places.iter().step_by(stride).map(of_place).collect();
        let mean = problem.count(channel) as f64 / left.len().max(1) as f64;
        (!all.is_empty()).then_some(Self { all, longest: LONGEST.0.min(LONGEST.1 * mean) })
    }

    /// The likeliest shape and its sigma; none where that is white, correlated over many rows, or does not whiten what is left: then
    /// it is no noise of this kind.
    fn likeliest(&self, problem: &Problem<'_>, rule: &NoiseRule) -> Option<(Shape, f64)> {
        let accumulates = |shape: &Shape| shape.accumulated > 0.0;
        let score = |shape: usize| self.under(problem, rule, shape);
        let higher = |a: &(f64, f64), b: &(f64, f64)| a.0 > b.0;
        let mut best = (0, score(0));
        let others = rule.allowed.iter().filter(|s| **s > 0 && !accumulates(&problem.family.shape(**s)));
        for &shape in others {
            let value = score(shape);
            if higher(&value, &best.1) {
                best = (shape, value);
            }
        }
        let (number, (_, sigma)) = problem.family.climb(best, |s| !accumulates(s), score, higher);
        let shape = problem.family.shape(number);
        let rough = number > 0 && shape.length_steps <= self.longest && self.whitens(problem, shape);
        rough.then_some((shape, sigma))
    }

    /// Whether a shape leaves neighbours in the windows that are hardly correlated.
    fn whitens(&self, problem: &Problem<'_>, shape: Shape) -> bool {
        let (mut lagged, mut rows) = ([0.0; LAGS], 0.0);
        for window in &self.all {
            let mut columns = window.columns.clone();
            window.whitener(problem, shape).whiten_all(&mut columns);
            let n = columns.len() - 1;
            let length = columns[n].len();
            let residual = DVector::from_column_slice(&columns[n]);
            let smooth = DMatrix::from_fn(length, n, |i, j| columns[j][i]).qr().q();
            let left = &residual - &smooth * (smooth.transpose() * &residual);
            let variance = left.norm_squared() / (length - n) as f64;
            for (lag, sum) in (1..).zip(&mut lagged) {
                let product = |v: &[f64]| v.iter().zip(&v[lag..]).map(|(a, b)| a * b).sum::<f64>();
                // What is smooth in white noise was taken away with the rest.
                let taken: f64 = (0..n).map(|j| product(smooth.column(j).as_slice())).sum();
                *sum += product(left.as_slice()) / variance + taken;
            }
            rows += length as f64;
        }
        let most = WHITE.0 + WHITE.1 / f64::sqrt(rows);
        lagged.iter().all(|sum| (sum / rows).abs() <= most)
    }

    /// Log likelihood with the prior's weight, each window's sigma free, and the median sigma.
    fn under(&self, problem: &Problem<'_>, rule: &NoiseRule, number: usize) -> (f64, f64) {
        let shape = problem.family.shape(number);
        let (mut score, mut sigmas) = (rule.log_prior(problem, number), Vec::with_capacity(self.all.len()));
        for window in &self.all {
            let whitener = window.whitener(problem, shape);
            let mut columns = window.columns.clone();
            whitener.whiten_all(&mut columns);
            let normal = gram(&columns);
            let n = columns.len() - 1;
            let block = normal.view((0, 0), (n, n)).into_owned();
            let residual = (0..n).map(|i| normal[(n, i)]).collect();
            let smooth = Eliminated::new(block, rank::CHANNEL, std::iter::once(residual));
            let freedom = columns[n].len().saturating_sub(smooth.rank()) as f64;
            let variance = (normal[(n, n)] - smooth.explained()).max(f64::MIN_POSITIVE) / freedom;
            score -= 0.5 * (freedom * variance.ln() + whitener.log_determinant + smooth.log_determinant());
            // The median of a chi-squared number is below its mean.
            sigmas.push(variance.sqrt() / (1.0 - 2.0 / (9.0 * freedom)).powf(1.5));
        }
        (score, median(&mut sigmas).unwrap_or(0.0))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

    use rand::SeedableRng as _;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution as _, StandardNormal};

    use super::*;
    use crate::data::{Recording, Run};
    use crate::fit::gauss_newton::solve;
    use crate::model::{Model, Quantity, Spec};
    use crate::noise::rule::{NoiseState, noise_rule};

    /// A model that predicts nothing but zero.
    struct Nothing(Spec);

    impl Model for Nothing {
        fn spec(&self) -> &Spec {
            &self.0
        }

        fn predict(&self, _: &Run, _: &[f64], _: &[f64], out: &mut [f64]) -> Result<(), PredictError> {
            out.fill(0.0);
            Ok(())
        }
    }

    /// Six runs of autoregressive noise of unit variance around a slow wave, and what is found of it: how much less a mean is known, and sigma.
    fn found(rows: usize, correlation: f64, wave: f64, seed: u64) -> (f64, f64) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut run = |number: usize| {
            let mut now: f64 = StandardNormal.sample(&mut rng);
            let mut of_row = |row: usize| {
                let new: f64 = StandardNormal.sample(&mut rng);
                now = correlation * now + (1.0 - correlation * correlation).sqrt() * new;
                now + wave * (row as f64 / 40.0).sin()
            };
            let column = (0..rows).map(&mut of_row).collect();
            let positions = (0..rows).map(|i| i as f64).collect();
            Run { label: number.to_string(), inputs: vec![positions], outputs: vec![column], kind: 0 }
        };
        let recording = Recording {
            channels: vec![Quantity::new("y", "")],
            variables: vec![Quantity::new("x", "")],
            runs: (0..6).map(&mut run).collect(),
            noise_along: Some(0),
            calibration: vec![None],
            resolution: vec![0.0],
        };
        let model = Nothing(Spec::default());
        let problem = Problem::new(&model, recording);
        let rule = noise_rule(&problem).competing();
        let white = vec![crate::statistics::median(&mut problem.rough_sigmas(0)).unwrap()];
        let start = NoiseState { shape: vec![0], sigma: white.clone() };
        let fit = solve(&problem, &problem.select(&[], &[]), &start, &[], &problem.nuisance_start).unwrap();
        let noise = RoughNoise::new(&problem, &rule, &fit, &white).unwrap();
        (noise.shape[0].of_means()[0], noise.sigma[0])
    }

    /// Neighbours that are correlated by 0.5: means have three times the variance, (1 + r) / (1 - r), whatever slow thing there is beside them.
    #[test]
    fn noise_of_a_few_rows_is_found_beside_what_is_slow() {
        const SEEDS: u64 = 12;
        for wave in [0.0, 3.0] {
            let all: Vec<(f64, f64)> = (0..SEEDS).map(|seed| found(500, 0.5, wave, seed)).collect();
            let average = |of: fn(&(f64, f64)) -> f64| all.iter().map(of).sum::<f64>() / SEEDS as f64;
            let (mean, sigma) = (average(|found| found.0), average(|found| found.1));
            assert!((mean - 3.0).abs() < 0.3 && (sigma - 1.0).abs() < 0.04, "{mean} {sigma}");
            assert!(all.iter().all(|found| (found.0 - 3.0).abs() < 1.2), "{all:?}");
        }
    }

    /// A slow wave in white noise is no noise, and neither is what is correlated over many rows.
    #[test]
    fn what_is_slow_is_no_noise() {
        for wave in [0.0, 3.0] {
            let (mean, sigma) = found(500, 0.0, wave, 7);
            assert!(mean <= 1.0 && (sigma - 1.0).abs() < 0.08, "{mean} {sigma}");
        }
        let (mean, sigma) = found(500, 0.98, 0.0, 7);
        assert!(mean <= 1.0 && sigma < 0.3, "{mean} {sigma}");
    }

    /// Runs of a dozen rows do not show a correlation.
    #[test]
    fn short_runs_have_white_noise() {
        assert!(found(12, 0.5, 0.0, 7).0 <= 1.0);
    }

    /// Autoregressive noise has its sums in closed form: (1 + r) / (1 - r) and (1 + r^2) / (1 - r^2).
    #[test]
    fn means_of_autoregressive_noise() {
        let r: f64 = 0.6;
        let shape = Shape { correlated: 1.0, length_steps: -1.0 / r.ln(), ..Shape::WHITE };
        let [mean, squares] = shape.of_means();
        approx::assert_relative_eq!(mean, (1.0 + r) / (1.0 - r), max_relative = 1e-6);
        approx::assert_relative_eq!(squares, (1.0 + r * r) / (1.0 - r * r), max_relative = 1e-6);
        assert!(Shape::WHITE.of_means() == [1.0, 1.0]);
        assert!((shape.of_mean(1) - 1.0).abs() < 1e-12 && Shape::WHITE.of_mean(16) == 1.0);
        approx::assert_relative_eq!(shape.of_mean(100_000), mean, max_relative = 1e-3);
    }

    /// What noise leaves of squared means of blocks, and how much that scatters, is what 400 draws of autoregressive noise show.
    #[test]
    fn blocks_of_autoregressive_noise() {
        const ROWS: usize = 960;
        const DRAWS: usize = 400;
        let r: f64 = 0.6;
        let shape = Shape { correlated: 1.0, length_steps: -1.0 / r.ln(), ..Shape::WHITE };
        let noise = RoughNoise { sigma: vec![1.0], shape: vec![shape] };
        let slow = noise.slow()[0];
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let mut draw = |_| {
            let mut now: f64 = StandardNormal.sample(&mut rng);
            let mut next = |_| {
                let new: f64 = StandardNormal.sample(&mut rng);
                now = r * now + (1.0 - r * r).sqrt() * new;
                now / slow
            };
            (0..ROWS).map(&mut next).collect::<Vec<f64>>()
        };
        let draws: Vec<Vec<f64>> = (0..DRAWS).map(&mut draw).collect();
        for block in [1, 4, 16] {
            let of_block = |rows: &[f64]| rows.iter().sum::<f64>().powi(2) / rows.len() as f64;
            let sums: Vec<f64> = draws.iter().map(|rows| rows.chunks(block).map(of_block).sum()).collect();
            let mean = sums.iter().sum::<f64>() / DRAWS as f64;
            let spread =
                (sums.iter().map(|sum| (sum - mean).powi(2)).sum::<f64>() / (DRAWS - 1) as f64).sqrt();
            let blocks = (ROWS / block) as f64;
            let (expected, wanted) =
                (blocks * noise.block(0, block), noise.spread_of_blocks(0, blocks, block));
            // Of a mean of so many draws the standard error is a twentieth of their spread, that of a spread 3.5 %.
            assert!((mean - expected).abs() < 0.2 * wanted, "{block}: {mean} {expected} {wanted}");
            assert!((spread / wanted - 1.0).abs() < 0.15, "{block}: {spread} {wanted}");
        }
    }
}
