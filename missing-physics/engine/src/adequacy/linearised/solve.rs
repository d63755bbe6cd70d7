//! Refits of the linearised model, of an alternative and of the noise.

use nalgebra::DMatrix;

use super::plane::{Linearised, Product, Products};
use crate::fit::bordered::BorderedNormal;
use crate::linalg::dot;

impl Linearised<'_> {
    /// Products of a data vector with all columns.
    pub(super) fn products(&self, data: &[Vec<Vec<f64>>]) -> Products {
        let of_block = |run: usize, channel: usize| -> Vec<Product> {
            let shapes = self.blocks[run][channel].shapes.iter().zip(&self.in_play);
            shapes
                .map(|(whitened, &shape)| {
                    let mut y = data[run][channel].clone();
                    self.problem.whitener(run, channel, shape).whiten(&mut y);
                    let with = |(i, column): (usize, &Vec<f64>)| {
                        if whitened.gram.acts(i) { dot(column, &y) } else { 0.0 }
                    };
                    let with: Vec<f64> = whitened.columns.iter().enumerate().map(with).collect();
                    let mine = &self.blocks[run][channel].mine;
                    let mut nuisance: Vec<f64> = mine.iter().map(|&i| with[i]).collect();
                    whitened.eliminated.forward(&mut nuisance);
                    let total = dot(&y, &y);
                    Product { with, left: total - dot(&nuisance, &nuisance), nuisance, total }
                })
                .collect()
        };
        let of_run = |run: usize| (0..data[run].len()).map(|channel| of_block(run, channel)).collect();
        Products { values: (0..data.len()).map(of_run).collect() }
    }

    /// Fits the model with an alternative's columns added, for a given noise.
    pub(super) fn solve(
        &self,
        products: &Products,
        noise: &[(usize, f64)],
        nuisance: &[usize],
        shared: &[usize],
    ) -> Vec<Vec<f64>> {
        let ids: Vec<usize> = nuisance.iter().chain(shared).copied().collect();
        let last = ids.len();
        let mut bordered = BorderedNormal::new(shared.len());
        for (row, values) in self.blocks.iter().zip(&products.values) {
            let mut normal = DMatrix::zeros(last + 1, last + 1);
            for ((block, value), &(shape, sigma)) in row.iter().zip(values).zip(noise) {
                let weight = 1.0 / (sigma * sigma);
                let gram = &block.shapes[shape].gram;
                for (i, &a) in ids.iter().enumerate() {
                    normal[(last, i)] += weight * value[shape].with[a];
                    for (j, &c) in ids.iter().enumerate().take(i + 1) {
                        normal[(i, j)] += weight * gram.of(a, c);
                    }
                }
            }
            bordered.add(&normal);
        }
        // A column that the others already span (a polynomial within the nuisances) is dropped.
        let (x, _) = bordered.solve(&bordered.factor_against(&self.scales(noise, shared)));
        bordered.coefficients(&x)
    }

    /// Sums of squares of the shared columns before anything is eliminated, the measure of "already spanned".
    pub(super) fn scales(&self, noise: &[(usize, f64)], shared: &[usize]) -> Vec<f64> {
        shared
            .iter()
            .map(|&a| {
                self.blocks
                    .iter()
                    .flat_map(|row| row.iter().zip(noise))
                    .map(|(block, &(shape, sigma))| block.shapes[shape].gram.of(a, a) / (sigma * sigma))
                    .sum()
            })
            .collect()
    }

    /// Residual sum of squares of one channel under one shape.
    fn squares(
        &self,
        products: &Products,
        channel: usize,
        shape: usize,
        ids: &[usize],
        coefficients: &[Vec<f64>],
    ) -> (f64, f64) {
        let (mut squares, mut log_determinant) = (0.0, 0.0);
        let mut others: Vec<(usize, f64)> = Vec::with_capacity(ids.len());
        for ((row, values), x) in self.blocks.iter().zip(&products.values).zip(coefficients) {
            // The nuisance coefficients are fitted anew under each shape; the others are given.
            let block = &row[channel].shapes[shape];
            let borders = &block.eliminated.borders;
            let product = &values[channel][shape];
            let mine = &row[channel].mine;
            let acts = |(a, _): &(usize, f64)| !mine.contains(a) && block.gram.of(*a, *a) > 0.0;
            others.clear();
            others.extend(ids.iter().copied().zip(x.iter().copied()).filter(acts));
            let mut form = product.left;
            for (k, &(a, xa)) in others.iter().enumerate() {
                let left = product.with[a] - dot(&borders[a], &product.nuisance);
                let mut inner = -2.0 * left + block.gram.beside(a, a) * xa;
                let pairs: f64 = others[..k].iter().map(|&(c, xc)| block.gram.beside(a, c) * xc).sum();
                inner += 2.0 * pairs;
                form += xa * inner;
            }
            squares += form.max(0.0);
            log_determinant += block.log_determinant;
        }
        (squares, log_determinant)
    }

    /// Score and sigma of a channel under a shape of the family.
    fn channel_score(&self, channel: usize, shape: usize, squares: f64, log_determinant: f64) -> (f64, f64) {
        let freedom = self.freedom[channel];
        let sigma = self.rule.sigma(channel, &self.problem.family.shape(shape), (squares / freedom).sqrt());
        (-freedom * sigma.ln() - 0.5 * log_determinant - 0.5 * squares / (sigma * sigma), sigma)
    }

    /// Fits coefficients and noise in turn; returns the score, the noise and the coefficients.
    pub(super) fn alternate(
        &self,
        products: &Products,
        nuisance: &[usize],
        shared: &[usize],
        start: &[(usize, f64)],
        rounds: usize,
    ) -> (f64, Vec<(usize, f64)>, Vec<Vec<f64>>) {
        let ids: Vec<usize> = nuisance.iter().chain(shared).copied().collect();
        let mut noise = start.to_vec();
        let mut coefficients = self.solve(products, &noise, nuisance, shared);
        let mut score = f64::NEG_INFINITY;
        for round in 0..rounds {
            let mut total = 0.0;
            let mut next = noise.clone();
            for (channel, state) in next.iter_mut().enumerate() {
                let mut best = f64::NEG_INFINITY;
                for shape in 0..self.in_play.len() {
                    let of_noise = self.problem.family.shape(self.in_play[shape]);
                    if !self.rule.may_have(channel, &of_noise) {
                        continue;
                    }
                    let (squares, log_determinant) =
                        self.squares(products, channel, shape, &ids, &coefficients);
                    let (mut value, sigma) =
                        self.channel_score(channel, self.in_play[shape], squares, log_determinant);
                    value += of_noise.log_prior();
                    if value > best {
                        best = value;
                        *state = (shape, sigma);
                    }
                }
                total += best;
            }
            score = total;
            let still = next.iter().zip(&noise).all(|(a, b)| a.0 == b.0 && (a.1 / b.1 - 1.0).abs() < 1e-3);
            noise = next;
            if still || round + 1 == rounds {
                break;
            }
            coefficients = self.solve(products, &noise, nuisance, shared);
        }
        (score, noise, coefficients)
    }

    /// Sum of squares in units of the noise.
    pub(super) fn chi2(
        &self,
        products: &Products,
        noise: &[(usize, f64)],
        nuisance: &[usize],
        shared: &[usize],
        coefficients: &[Vec<f64>],
    ) -> f64 {
        let ids: Vec<usize> = nuisance.iter().chain(shared).copied().collect();
        noise
            .iter()
            .enumerate()
            .map(|(c, &(shape, sigma))| {
                self.squares(products, c, shape, &ids, coefficients).0 / (sigma * sigma)
            })
            .sum()
    }

    /// White noise at the level of the whole data, where fits begin.
    pub(super) fn white_start(&self, products: &Products) -> Vec<(usize, f64)> {
        (0..self.problem.channels())
            .map(|c| {
                let squares: f64 = products.values.iter().map(|row| row[c][0].total).sum();
                (0, self.channel_score(c, 0, squares, 0.0).1)
            })
            .collect()
    }
}
