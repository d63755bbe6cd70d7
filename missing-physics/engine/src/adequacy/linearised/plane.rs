//! The linearised model as a value: blocks of columns, and what is made of them for each shape of noise.

use nalgebra::DMatrix;

use super::gram::Gram;
use super::pooled::{Pooled, PooledProduct};
use crate::fit::bordered::Eliminated;
use crate::linalg::rank;
use crate::noise::process::Whitener;
use crate::noise::rule::NoiseRule;
use crate::problem::Problem;

/// A way in which the model might be wrong, as columns that are added to it.
#[derive(Debug, Clone)]
pub(crate) struct Alternative {
    pub(crate) name: String,
    /// Columns added to each run's nuisance ones.
    pub(super) nuisance: Vec<usize>,
    /// Columns added to the shared ones.
    pub(super) shared: Vec<usize>,
    /// For a single shared column: the sign that its coefficient must have (0: either).
    pub(super) sign: f64,
}

/// One run and channel: whitened columns for each shape that is in play.
pub(super) struct Block {
    /// Raw (unwhitened) columns over the measured rows.
    pub(super) raw: Vec<Vec<f64>>,
    /// The model's nuisance columns that this channel determines.
    pub(super) mine: Vec<usize>,
    /// Per shape in play: whitened columns and their Gram matrix.
    pub(super) shapes: Vec<Whitened>,
}

/// Columns under one shape of noise.
pub(super) struct Whitened {
    pub(super) columns: Vec<Vec<f64>>,
    pub(super) gram: Gram,
    /// The nuisance columns that the channel determines, eliminated from every column.
    pub(super) eliminated: Eliminated,
    /// Where in the Gram matrix each column stands that acts and is not eliminated.
    pub(super) others: Vec<Option<usize>>,
    /// Log determinant of the noise and of the nuisance columns.
    pub(super) log_determinant: f64,
}

/// The linearised model.
pub(crate) struct Linearised<'a> {
    pub(super) problem: &'a Problem<'a>,
    /// Index into the family for each shape in play.
    pub(super) in_play: Vec<usize>,
    pub(super) blocks: Vec<Vec<Block>>,
    /// All runs together, `[channel][shape]`.
    pub(super) pooled: Vec<Vec<Pooled>>,
    /// Which of the model's nuisance columns act on one channel of each run at most, which eliminates them.
    pub(super) separate: Vec<bool>,
    pub(super) n_nuisance: usize,
    pub(super) n_shared: usize,
    pub(crate) alternatives: Vec<Alternative>,
    /// How many of the alternatives, the first ones, are mechanisms.
    pub(crate) mechanisms: usize,
    pub(super) rule: NoiseRule,
    /// Degrees of freedom of each channel's noise.
    pub(super) freedom: Vec<f64>,
}

/// Products of a data vector with one block's columns under one shape.
pub(super) struct Product {
    /// With each column.
    pub(super) with: Vec<f64>,
    /// The nuisance columns' share, forward-solved.
    pub(super) nuisance: Vec<f64>,
    /// Sum of squares that the nuisance columns leave.
    pub(super) left: f64,
    /// Sum of squares.
    pub(super) total: f64,
}

/// Products of a data vector with every block's columns, `[run][channel][shape]`, and with those of all runs, `[channel][shape]`.
pub(super) struct Products {
    pub(super) values: Vec<Vec<Vec<Product>>>,
    pub(super) pooled: Vec<Vec<PooledProduct>>,
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
    pub(super) coefficients: Vec<Vec<f64>>,
}

impl Block {
    /// The columns whitened, the nuisance columns eliminated.
    fn whitened(&self, whitener: &Whitener) -> Whitened {
        let mut columns = self.raw.clone();
        columns.iter_mut().filter(|c| c.iter().any(|v| *v != 0.0)).for_each(|c| whitener.whiten(c));
        let mut gram = Gram::new(&columns);
        let mine = &self.mine;
        let block = DMatrix::from_fn(mine.len(), mine.len(), |i, j| gram.of(mine[i], mine[j]));
        let beside = (0..columns.len()).map(|j| mine.iter().map(|&i| gram.of(i, j)).collect());
        let eliminated = Eliminated::new(block, rank::CHANNEL, beside);
        gram.eliminate(&eliminated.borders);
        let other =
            |i: usize| gram.place(i).filter(|&place| !mine.contains(&i) && gram.at(place)[place] > 0.0);
        let others = (0..columns.len()).map(other).collect();
        let log_determinant = whitener.log_determinant + eliminated.log_determinant();
        Whitened { columns, gram, eliminated, others, log_determinant }
    }
}

impl Linearised<'_> {
    /// Puts the given shapes of the family in play, and no others.
    pub(crate) fn play(&mut self, shapes: &[usize]) {
        self.in_play = shapes.to_vec();
        let problem = self.problem;
        for (run, row) in self.blocks.iter_mut().enumerate() {
            for (channel, block) in row.iter_mut().enumerate() {
                let whitened = |&shape: &usize| block.whitened(problem.whitener(run, channel, shape));
                block.shapes = shapes.iter().map(whitened).collect();
            }
        }
        let pooled = |channel| (0..shapes.len()).map(|k| Pooled::new(&self.blocks, channel, k)).collect();
        self.pooled = (0..problem.channels()).map(pooled).collect();
    }

    /// Degrees of freedom of the noise that the model and so many further columns leave.
    pub(super) fn freedom_beside(&self, columns: usize) -> f64 {
        self.freedom.iter().sum::<f64>() - columns as f64
    }

    /// Drops all alternatives: the model alone is read.
    pub(crate) fn without_alternatives(mut self) -> Self {
        self.alternatives.clear();
        self
    }

    pub(crate) fn in_play(&self) -> &[usize] {
        &self.in_play
    }

    /// The model's nuisance and shared columns, and the same with the columns of the first `alternatives` alternatives, each once.
    pub(super) fn columns_with(&self, alternatives: usize) -> (Vec<usize>, Vec<usize>) {
        let mut nuisance: Vec<usize> = (0..self.n_nuisance).collect();
        let mut shared: Vec<usize> = (self.n_nuisance..self.n_nuisance + self.n_shared).collect();
        for alternative in &self.alternatives[..alternatives] {
            for (list, more) in [(&mut nuisance, &alternative.nuisance), (&mut shared, &alternative.shared)] {
                more.iter().for_each(|c| {
                    if !list.contains(c) {
                        list.push(*c);
                    }
                });
            }
        }
        (nuisance, shared)
    }
}
