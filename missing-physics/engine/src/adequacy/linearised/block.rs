//! One run and channel of the linearised model: its columns, whitened for each shape of noise that is in play.

use nalgebra::DMatrix;

use super::gram::Gram;
use crate::fit::bordered::Eliminated;
use crate::linalg::{dots_of_each, rank};
use crate::noise::process::Whitener;

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

impl Whitened {
    /// Products of whitened data vectors with each column, a list for each of them; those of columns that do not act are nothing.
    pub(super) fn products(&self, data: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let acting: Vec<usize> = (0..self.columns.len()).filter(|&i| self.gram.place(i).is_some()).collect();
        let columns: Vec<&[f64]> = acting.iter().map(|&i| self.columns[i].as_slice()).collect();
        let data: Vec<&[f64]> = data.iter().map(Vec::as_slice).collect();
        let with_all = |dots: Vec<f64>| {
            let mut products = vec![0.0; self.columns.len()];
            acting.iter().zip(dots).for_each(|(&i, dot)| products[i] = dot);
            products
        };
        dots_of_each(&data, &columns).into_iter().map(with_all).collect()
    }
}

impl Block {
    /// Whether a column acts here.
    pub(super) fn acts(&self, column: usize) -> bool {
        self.raw[column].iter().any(|v| *v != 0.0)
    }

    /// The columns whitened, the nuisance columns eliminated.
    pub(super) fn whitened(&self, whitener: &Whitener) -> Whitened {
        let mut columns = self.raw.clone();
        whitener.whiten_all(columns.iter_mut().filter(|c| c.iter().any(|v| *v != 0.0)));
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
