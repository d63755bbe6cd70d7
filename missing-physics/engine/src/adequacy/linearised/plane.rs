//! The linearised model as a value: blocks of columns, and what is made of them for each shape of noise.

use rayon::prelude::*;

use super::block::{Block, Product};
use super::pooled::{Pooled, PooledProduct};
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
    /// Whether each alternative leaves noise to measure it by.
    pub(super) measurable: Vec<bool>,
    /// How many of the alternatives, the first ones, are mechanisms.
    pub(crate) mechanisms: usize,
    pub(super) rule: NoiseRule,
    /// Degrees of freedom of each channel's noise.
    pub(super) freedom: Vec<f64>,
}

/// Products of a data vector with every block's columns, `[run][channel][shape]`, and with those of all runs, `[channel][shape]`.
#[derive(Default)]
pub(super) struct Products {
    pub(super) values: Vec<Vec<Vec<Product>>>,
    pub(super) pooled: Vec<Vec<PooledProduct>>,
}

/// A noise that a channel may have.
pub(crate) struct ScoredNoise {
    /// Its shape among those in play.
    pub(crate) shape: usize,
    pub(crate) sigma: f64,
    /// Log likelihood with the prior weight of the shape, up to a constant of the data's layout.
    pub(crate) score: f64,
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
    /// All noises that each channel may have beside the model alone.
    pub(crate) noises: Vec<Vec<ScoredNoise>>,
    /// Coefficients of the model alone, by run: nuisance, then shared.
    pub(super) coefficients: Vec<Vec<f64>>,
}

impl Linearised<'_> {
    /// Puts the given shapes of the family in play, and no others.
    pub(crate) fn play(&mut self, shapes: &[usize]) {
        self.in_play = shapes.to_vec();
        let problem = self.problem;
        self.blocks.par_iter_mut().enumerate().for_each(|(run, row)| {
            for (channel, block) in row.iter_mut().enumerate() {
                let whitened = |&shape: &usize| block.whitened(problem.whitener(run, channel, shape));
                block.shapes = shapes.iter().map(whitened).collect();
            }
        });
        let pooled = |channel| {
            let of_shape = |shape: usize| Pooled::new(&self.blocks, channel, shape);
            (0..shapes.len()).into_par_iter().map(of_shape).collect()
        };
        self.pooled = (0..problem.channels()).map(pooled).collect();
    }

    /// Degrees of freedom of the noise that the model and so many further columns leave.
    pub(super) fn freedom_beside(&self, columns: usize) -> f64 {
        self.freedom.iter().sum::<f64>() - columns as f64
    }

    /// Degrees of freedom that these columns leave of one channel's noise: its rows, less the directions among them in which the columns act.
    /// Columns that act on one channel alone leave nothing of it where all channels together have rows enough.
    pub(super) fn freedom_of(&self, channel: usize, nuisance: &[usize], shared: &[usize]) -> f64 {
        let of_run = |row: &Vec<Block>| {
            let added = nuisance.iter().filter(|&&a| a >= self.n_nuisance);
            row[channel].mine.len() + added.filter(|&&a| row[channel].acts(a)).count()
        };
        let by_run: usize = self.blocks.iter().map(of_run).sum();
        self.problem.count(channel) as f64 - (by_run + self.pooled[channel][0].rank(shared)) as f64
    }

    /// Whether an alternative leaves noise, of all channels together and in every one on which it acts.
    pub(super) fn leaves_noise(&self, alternative: &Alternative) -> bool {
        let columns = alternative.shared.len() + alternative.nuisance.len() * self.blocks.len();
        if self.freedom_beside(columns) < 1.0 {
            return false;
        }
        let (_, model) = self.columns_with(0);
        let shared = [&model[..], &alternative.shared].concat();
        let added = || alternative.nuisance.iter().chain(&alternative.shared);
        let acts = |channel: usize| self.blocks.iter().any(|row| added().any(|&a| row[channel].acts(a)));
        let mut acting = (0..self.problem.channels()).filter(|&c| acts(c));
        acting.all(|c| self.freedom_of(c, &alternative.nuisance, &shared) >= 1.0)
    }

    /// Drops all alternatives: the model alone is read.
    pub(crate) fn without_alternatives(mut self) -> Self {
        self.alternatives.clear();
        self.measurable.clear();
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
