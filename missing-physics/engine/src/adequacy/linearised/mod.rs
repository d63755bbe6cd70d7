//! The linearised model around a fit: everything that an adequacy test needs of the data, as sums over rows.
//!
//! Around the fitted parameters the prediction is a plane. For each run, channel and noise shape the whitened columns of
//! that plane, and of the directions in which it might be wrong, leave a small Gram matrix; a data vector leaves its
//! products with them. A refit of the model, of any alternative and of the noise is then algebra on a few small matrices,
//! which is what makes a bootstrap of the *whole* fit affordable.

mod build;
mod curves;
mod outliers;
mod shapes;
mod solve;

use nalgebra::DMatrix;

use crate::fit::gauss_newton::NoiseRule;
use crate::linalg::{cholesky, forward, gram, log_determinant};
use crate::problem::Problem;
pub(crate) use curves::Curves;

/// A way in which the model might be wrong, as columns that are added to it.
#[derive(Debug, Clone)]
pub(crate) struct Alternative {
    pub(crate) name: String,
    /// Columns added to each run's nuisance ones.
    nuisance: Vec<usize>,
    /// Columns added to the shared ones.
    shared: Vec<usize>,
    /// For a single shared column: the sign that its coefficient must have (0: either).
    sign: f64,
}

/// Degree of the polynomial in a variable that the adequacy test looks for.
pub(crate) const DEGREE: usize = 5;

/// One run and channel: whitened columns for each shape that is in play.
struct Block {
    /// Raw (unwhitened) columns over the measured rows.
    raw: Vec<Vec<f64>>,
    /// The model's nuisance columns that this channel determines.
    mine: Vec<usize>,
    /// Per shape in play: whitened columns and their Gram matrix.
    shapes: Vec<Whitened>,
}

struct Whitened {
    columns: Vec<Vec<f64>>,
    gram: DMatrix<f64>,
    /// The nuisance columns' Cholesky factor and kept pivots.
    nuisance: (DMatrix<f64>, Vec<bool>),
    /// The nuisance columns' share of every other column: forward-solved products.
    borders: Vec<Vec<f64>>,
    /// Log determinant of the noise and of the nuisance columns.
    log_determinant: f64,
}

/// The linearised model.
pub(crate) struct Linearised<'a> {
    problem: &'a Problem<'a>,
    /// Index into the family for each shape in play.
    in_play: Vec<usize>,
    blocks: Vec<Vec<Block>>,
    n_nuisance: usize,
    n_shared: usize,
    pub(crate) alternatives: Vec<Alternative>,
    /// How many of the alternatives, the first ones, are mechanisms.
    pub(crate) mechanisms: usize,
    rule: NoiseRule,
    /// Degrees of freedom of each channel's noise.
    freedom: Vec<f64>,
}

/// Products of a data vector with one block's columns under one shape.
struct Product {
    /// With each column.
    with: Vec<f64>,
    /// The nuisance columns' share, forward-solved.
    nuisance: Vec<f64>,
    /// Sum of squares that the nuisance columns leave.
    left: f64,
    /// Sum of squares.
    total: f64,
}

/// Products of a data vector with every block's columns, `[run][channel][shape]`.
struct Products {
    values: Vec<Vec<Vec<Product>>>,
}

/// What a data vector says of the model and its alternatives.
pub(crate) struct Reading {
    /// Log likelihood of the model alone, up to a constant of the data's layout.
    pub(crate) score: f64,
    /// How much each alternative lowers the sum of squares in units of the noise that is left beside it: the model alone
    /// would call a faint slow effect coloured noise.
    pub(crate) gains: Vec<f64>,
    /// Noise of the model alone: shape in play and sigma, by channel.
    pub(crate) noise: Vec<(usize, f64)>,
    /// Coefficients of the model alone, by run: nuisance, then shared.
    coefficients: Vec<Vec<f64>>,
}

impl Linearised<'_> {
    /// Puts the given shapes of the family in play, and no others.
    pub(crate) fn play(&mut self, shapes: &[usize]) {
        self.in_play = shapes.to_vec();
        let problem = self.problem;
        for (run, row) in self.blocks.iter_mut().enumerate() {
            for (channel, block) in row.iter_mut().enumerate() {
                block.shapes = shapes
                    .iter()
                    .map(|&shape| {
                        let whitener = problem.whitener(run, channel, shape);
                        let mut columns = block.raw.clone();
                        columns.iter_mut().for_each(|c| whitener.whiten(c));
                        let gram = gram(&columns);
                        let mut nuisance = DMatrix::from_fn(block.mine.len(), block.mine.len(), |i, j| {
                            gram[(block.mine[i], block.mine[j])]
                        });
                        let kept = cholesky(&mut nuisance, 1e-9);
                        let log_determinant = whitener.log_determinant + log_determinant(&nuisance, &kept);
                        let borders = (0..columns.len())
                            .map(|j| {
                                let mut border: Vec<f64> = block.mine.iter().map(|&i| gram[(i, j)]).collect();
                                forward(&nuisance, &kept, &mut border);
                                border
                            })
                            .collect();
                        Whitened { gram, nuisance: (nuisance, kept), borders, columns, log_determinant }
                    })
                    .collect();
            }
        }
    }

    /// Drops all alternatives: the model alone is read.
    pub(crate) fn without_alternatives(mut self) -> Self {
        self.alternatives.clear();
        self
    }

    pub(crate) fn in_play(&self) -> &[usize] {
        &self.in_play
    }

    /// Fits the model and every alternative to a data vector (`[run][channel]`, measured rows).
    pub(crate) fn read(&self, data: &[Vec<Vec<f64>>]) -> Reading {
        let products = self.products(data);
        let nuisance: Vec<usize> = (0..self.n_nuisance).collect();
        let shared: Vec<usize> = (self.n_nuisance..self.n_nuisance + self.n_shared).collect();
        let start = self.white_start(&products);
        let (score, noise, coefficients) = self.alternate(&products, &nuisance, &shared, &start, 8);
        let plain = (nuisance.clone(), shared.clone());
        let gains = self
            .alternatives
            .iter()
            .map(|alternative| {
                let nuisance: Vec<usize> = nuisance.iter().chain(&alternative.nuisance).copied().collect();
                let shared: Vec<usize> = shared.iter().chain(&alternative.shared).copied().collect();
                let (_, beside, _) = self.alternate(&products, &nuisance, &shared, &noise, 4);
                let x = self.solve(&products, &beside, &nuisance, &shared);
                let wrong = alternative.sign != 0.0
                    && x.first().and_then(|x| x.last()).is_some_and(|value| value * alternative.sign < 0.0);
                if wrong {
                    return 0.0;
                }
                let with = self.chi2(&products, &beside, &nuisance, &shared, &x);
                let without = self.solve(&products, &beside, &plain.0, &plain.1);
                (self.chi2(&products, &beside, &plain.0, &plain.1, &without) - with).max(0.0)
            })
            .collect();
        Reading { score, gains, noise, coefficients }
    }

    /// The whitened residual of a data vector under the model alone, `[run][channel]`.
    pub(crate) fn whitened_residual(&self, data: &[Vec<Vec<f64>>], reading: &Reading) -> Vec<Vec<Vec<f64>>> {
        let used = self.n_nuisance + self.n_shared;
        data.iter()
            .enumerate()
            .map(|(run, row)| {
                row.iter()
                    .enumerate()
                    .map(|(channel, raw)| {
                        let (shape, sigma) = reading.noise[channel];
                        let mut y = raw.clone();
                        for (column, x) in
                            self.blocks[run][channel].raw[..used].iter().zip(&reading.coefficients[run])
                        {
                            y.iter_mut().zip(column).for_each(|(v, c)| *v -= x * c);
                        }
                        self.problem.whitener(run, channel, self.in_play[shape]).whiten(&mut y);
                        y.iter_mut().for_each(|v| *v /= sigma);
                        y
                    })
                    .collect()
            })
            .collect()
    }
}
