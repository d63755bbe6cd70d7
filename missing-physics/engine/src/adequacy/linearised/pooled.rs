//! Sums over all runs of what each leaves of the shared columns beside its nuisance ones.
//!
//! Where each run's nuisance parameters act on one channel each, their elimination does not hang on how the channels are weighed: the sums
//! over runs are made once, and a refit costs the same however many runs there are.

use nalgebra::DMatrix;

use super::block::{Block, Product};
use crate::linalg::{SemiCholesky, dot};

/// One channel's columns under one shape of noise.
pub(super) struct Pooled {
    /// Products of the columns with one another, beside each run's nuisance columns.
    beside: DMatrix<f64>,
    /// Sums of squares of the columns before elimination.
    squares: Vec<f64>,
    /// Log determinant of the noise and of the nuisance columns.
    log_determinant: f64,
}

/// Products of a data vector with one channel's columns under one shape.
pub(super) struct PooledProduct {
    /// With each column, beside each run's nuisance columns.
    with: Vec<f64>,
    /// Sum of squares that the nuisance columns leave.
    left: f64,
    /// Sum of squares.
    pub(super) total: f64,
}

/// Which nuisance columns act on one channel of each run at most, which eliminates them.
pub(super) fn separate(blocks: &[Vec<Block>], n_nuisance: usize) -> Vec<bool> {
    let of_run = |row: &Vec<Block>, column: usize| {
        let mut acting = row.iter().filter(|block| block.acts(column));
        acting.next().is_none_or(|block| block.mine.contains(&column)) && acting.next().is_none()
    };
    (0..n_nuisance).map(|column| blocks.iter().all(|row| of_run(row, column))).collect()
}

impl Pooled {
    /// Of the blocks of all runs, under the shape with this number in play.
    pub(super) fn new(blocks: &[Vec<Block>], channel: usize, shape: usize) -> Self {
        let columns = blocks.first().map_or(0, |row| row[channel].raw.len());
        let mut pooled = Self {
            beside: DMatrix::zeros(columns, columns),
            squares: vec![0.0; columns],
            log_determinant: 0.0,
        };
        for row in blocks {
            let block = &row[channel].shapes[shape];
            pooled.log_determinant += block.log_determinant;
            let acting: Vec<(usize, usize)> =
                block.others.iter().enumerate().filter_map(|(a, place)| place.map(|p| (a, p))).collect();
            for &(a, place) in &acting {
                pooled.squares[a] += block.gram.at(place)[place];
                let beside = block.gram.beside(place);
                acting.iter().for_each(|&(b, other)| pooled.beside[(b, a)] += beside[other]);
            }
        }
        pooled
    }

    /// In how many directions these columns act beside each run's nuisance columns.
    pub(super) fn rank(&self, columns: &[usize]) -> usize {
        let n = columns.len();
        let gram = DMatrix::from_fn(n, n, |i, j| self.beside[(columns[i], columns[j])]);
        let squares: Vec<f64> = columns.iter().map(|&a| self.squares[a]).collect();
        SemiCholesky::against(gram, &squares).rank()
    }

    /// Of one data vector's products with the blocks of all runs.
    pub(super) fn products(
        &self,
        blocks: &[Vec<Block>],
        values: &[Vec<Vec<Product>>],
        channel: usize,
        shape: usize,
    ) -> PooledProduct {
        let mut pooled = PooledProduct { with: vec![0.0; self.squares.len()], left: 0.0, total: 0.0 };
        for (row, values) in blocks.iter().zip(values) {
            let (block, product) = (&row[channel].shapes[shape], &values[channel][shape]);
            pooled.left += product.left;
            pooled.total += product.total;
            for (a, with) in pooled.with.iter_mut().enumerate() {
                if block.others[a].is_some() {
                    *with += product.with[a] - dot(&block.eliminated.borders[a], &product.nuisance);
                }
            }
        }
        pooled
    }

    /// Sum of squares that shared columns with these coefficients leave, and the log determinant.
    pub(super) fn left(&self, product: &PooledProduct, shared: &[usize], coefficients: &[f64]) -> (f64, f64) {
        let mut form = product.left;
        for (k, (&a, xa)) in shared.iter().zip(coefficients).enumerate() {
            let beside = self.beside.column(a);
            let pairs: f64 = shared[..k].iter().zip(coefficients).map(|(&c, xc)| beside[c] * xc).sum();
            form += xa * (-2.0 * product.with[a] + beside[a] * xa + 2.0 * pairs);
        }
        (form, self.log_determinant)
    }
}

/// The shared coefficients of a fit for a given noise, where each nuisance column is separate; `pooled` and `products` by channel and shape.
pub(super) fn solve(
    pooled: &[Vec<Pooled>],
    products: &[Vec<PooledProduct>],
    noise: &[(usize, f64)],
    shared: &[usize],
) -> Vec<f64> {
    let n = shared.len();
    let (mut information, mut gradient, mut squares) = (DMatrix::zeros(n, n), vec![0.0; n], vec![0.0; n]);
    for ((pooled, products), &(shape, sigma)) in pooled.iter().zip(products).zip(noise) {
        let (pooled, product, weight) = (&pooled[shape], &products[shape], 1.0 / (sigma * sigma));
        for (i, &a) in shared.iter().enumerate() {
            gradient[i] += weight * product.with[a];
            squares[i] += weight * pooled.squares[a];
            let beside = pooled.beside.column(a);
            shared[..=i].iter().enumerate().for_each(|(j, &b)| information[(i, j)] += weight * beside[b]);
        }
    }
    // A column that the others already span (a polynomial within the nuisances) is dropped.
    SemiCholesky::against(information, &squares).solve(&mut gradient);
    gradient
}
