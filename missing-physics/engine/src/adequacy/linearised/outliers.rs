//! Rows that all the others contradict, whatever mechanism is at work.
//!
//! The model with every mechanism switched on is fitted to all rows; each row in turn is then allowed a shift of its own
//! (the mean-shift test, Cook and Weisberg 1982, Residuals and Influence in Regression, section 2.2). Unlike a look at a row's neighbours, this sees a wild reading at
//! the end of a run, and one among few rows.

use nalgebra::DMatrix;

use super::Linearised;
use crate::linalg::{RANK_FLOOR, cholesky, cholesky_against, dot, forward};
use crate::noise::process::median;

/// Rows after which the whitened image of a single row's shift has died away.
const REACH: usize = 256;
/// Below this share of its information left by the fit, a row cannot be judged: it determines a parameter by itself.
const FREEDOM: f64 = 0.05;
/// A channel with fewer measured rows has no scale of its own to judge a row by.
const FEWEST_ROWS: usize = 24;

/// A run's nuisance columns eliminated: Cholesky factor, kept pivots, forward-solved borders.
type Eliminated = (DMatrix<f64>, Vec<bool>, Vec<Vec<f64>>);

impl Linearised<'_> {
    /// How far each row lies from what all the other rows say of it, in robust sigmas; `[run][channel]`, measured rows.
    pub(crate) fn row_scores(&self, data: &[Vec<Vec<f64>>]) -> Vec<Vec<Vec<f64>>> {
        let (nuisance, shared) = self.with_mechanisms();
        let products = self.products(data);
        let start = self.white_start(&products);
        let (_, noise, coefficients) = self.alternate(&products, &nuisance, &shared, &start, 8);
        let ids: Vec<usize> = nuisance.iter().chain(&shared).copied().collect();
        let (q, s) = (nuisance.len(), shared.len());
        let mut information = DMatrix::zeros(s, s);
        let parts: Vec<Eliminated> = self
            .blocks
            .iter()
            .map(|row| {
                let normal = DMatrix::from_fn(q + s, q + s, |i, j| {
                    let of = |(block, &(shape, sigma)): (&super::Block, &(usize, f64))| {
                        block.shapes[shape].gram[(ids[i], ids[j])] / (sigma * sigma)
                    };
                    row.iter().zip(&noise).map(of).sum::<f64>()
                });
                let mut factor = normal.view((0, 0), (q, q)).into_owned();
                let kept = cholesky(&mut factor, RANK_FLOOR);
                let borders: Vec<Vec<f64>> = (0..s)
                    .map(|j| {
                        let mut column: Vec<f64> = (0..q).map(|i| normal[(i, q + j)]).collect();
                        forward(&factor, &kept, &mut column);
                        column
                    })
                    .collect();
                for i in 0..s {
                    for j in 0..s {
                        information[(i, j)] += normal[(q + i, q + j)] - dot(&borders[i], &borders[j]);
                    }
                }
                (factor, kept, borders)
            })
            .collect();
        let shared_kept = cholesky_against(&mut information, &self.scales(&noise, &shared));

        let mut scores: Vec<Vec<Vec<(f64, bool)>>> = Vec::with_capacity(data.len());
        for (run, (row, (factor, kept, borders))) in self.blocks.iter().zip(&parts).enumerate() {
            let of_channel = |(channel, block): (usize, &super::Block)| -> Vec<(f64, bool)> {
                let (shape, sigma) = noise[channel];
                let whitener = self.problem.whitener(run, channel, self.in_play[shape]);
                let columns = &block.shapes[shape].columns;
                let mut plain = data[run][channel].clone();
                for (&id, x) in ids.iter().zip(&coefficients[run]) {
                    plain.iter_mut().zip(&block.raw[id]).for_each(|(r, c)| *r -= x * c);
                }
                let mut residual = plain.clone();
                whitener.whiten(&mut residual);
                (0..residual.len())
                    .map(|i| {
                        let image = whitener.impulse(i, residual.len(), REACH);
                        let rows = i..i + image.len();
                        let mut a: Vec<f64> =
                            ids.iter().map(|&id| dot(&image, &columns[id][rows.clone()]) / sigma).collect();
                        let mut rest = a.split_off(q);
                        forward(factor, kept, &mut a);
                        rest.iter_mut().zip(borders).for_each(|(r, b)| *r -= dot(b, &a));
                        forward(&information, &shared_kept, &mut rest);
                        let whole = dot(&image, &image);
                        let left = whole - dot(&a, &a) - dot(&rest, &rest);
                        let shift = dot(&image, &residual[rows]) / left;
                        // Where the level changes, the first row after it agrees with the next: a wild row stands alone.
                        let around = [i.checked_sub(1), Some(i + 1)].into_iter().flatten();
                        let alone = around
                            .filter_map(|k| plain.get(k))
                            .all(|other| (plain[i] - other) * shift > 0.5 * shift * shift);
                        let z = if left > FREEDOM * whole { shift * left.sqrt() / sigma } else { 0.0 };
                        (z, alone)
                    })
                    .collect()
            };
            scores.push(row.iter().enumerate().map(of_channel).collect());
        }
        let scale: Vec<f64> = (0..noise.len())
            .map(|channel| {
                let of_channel = scores.iter().flat_map(|row| &row[channel]);
                let mut moduli: Vec<f64> = of_channel.map(|(z, _)| z.abs()).filter(|z| *z > 0.0).collect();
                // Wild rows swell sigma, so the scale is the median's; but readings that mostly repeat leave none.
                if moduli.len() < FEWEST_ROWS {
                    f64::INFINITY
                } else {
                    median(&mut moduli).map_or(1.0, |m| (m / 0.6745).max(0.2))
                }
            })
            .collect();
        let judged = |(column, scale): (Vec<(f64, bool)>, &f64)| -> Vec<f64> {
            column.into_iter().map(|(z, alone)| if alone { z / scale } else { 0.0 }).collect()
        };
        scores.into_iter().map(|row| row.into_iter().zip(&scale).map(judged).collect()).collect()
    }

    /// The columns of the model with every mechanism switched on: nuisance and shared.
    fn with_mechanisms(&self) -> (Vec<usize>, Vec<usize>) {
        let mut nuisance: Vec<usize> = (0..self.n_nuisance).collect();
        let mut shared: Vec<usize> = (self.n_nuisance..self.n_nuisance + self.n_shared).collect();
        for alternative in &self.alternatives[..self.mechanisms] {
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
