//! Refits of the linearised model, of an alternative and of the noise.

use nalgebra::DMatrix;

use super::block::{Block, Product};
use super::plane::{Linearised, Products, ScoredNoise};
use super::pooled::{self, Pooled, PooledProduct};
use crate::fit::bordered::BorderedNormal;
use crate::linalg::dot;

/// Coefficients of a fit of columns.
pub(super) struct Coefficients {
    /// The noise that they were fitted under: shape in play and sigma, by channel.
    pub(super) noise: Vec<(usize, f64)>,
    pub(super) shared: Vec<f64>,
    /// Those of each run's nuisance columns; none where each channel's elimination makes up for them.
    nuisance: Vec<Vec<f64>>,
}

/// One run's normal equations of the columns `ids` for a given noise, the lower triangle; the residual's row, the last, is zero.
pub(super) fn normal(row: &[Block], noise: &[(usize, f64)], ids: &[usize]) -> DMatrix<f64> {
    let mut normal = DMatrix::zeros(ids.len() + 1, ids.len() + 1);
    // Each column that acts: its number among `ids`, its place.
    let mut acting: Vec<(usize, usize)> = Vec::with_capacity(ids.len());
    for (block, &(shape, sigma)) in row.iter().zip(noise) {
        let weight = 1.0 / (sigma * sigma);
        let gram = &block.shapes[shape].gram;
        acting.clear();
        for (i, &a) in ids.iter().enumerate() {
            let Some(place) = gram.place(a) else { continue };
            let products = gram.at(place);
            acting.push((i, place));
            acting.iter().for_each(|&(j, other)| normal[(i, j)] += weight * products[other]);
        }
    }
    normal
}

impl Linearised<'_> {
    /// Products of a data vector (`[run][channel]`) with all columns.
    pub(super) fn products(&self, data: &[Vec<Vec<f64>>]) -> Products {
        self.products_of_each(&[data]).pop().unwrap_or_default()
    }

    /// The same of several data vectors: the columns, which are many, are taken from memory once for all of them.
    pub(super) fn products_of_each(&self, data: &[&[Vec<Vec<f64>>]]) -> Vec<Products> {
        let mut values: Vec<Vec<Vec<Vec<Product>>>> = data.iter().map(|_| Vec::new()).collect();
        for (run, row) in self.blocks.iter().enumerate() {
            values.iter_mut().for_each(|values| values.push(row.iter().map(|_| Vec::new()).collect()));
            for (channel, block) in row.iter().enumerate() {
                for (whitened, &shape) in block.shapes.iter().zip(&self.in_play) {
                    let whitener = self.problem.whitener(run, channel, shape);
                    let mut white: Vec<Vec<f64>> =
                        data.iter().map(|data| data[run][channel].clone()).collect();
                    whitener.whiten_all(&mut white);
                    let with = whitened.products(&white);
                    for ((values, y), with) in values.iter_mut().zip(&white).zip(with) {
                        let mut nuisance: Vec<f64> = block.mine.iter().map(|&i| with[i]).collect();
                        whitened.eliminated.forward(&mut nuisance);
                        let total = dot(y, y);
                        let left = total - dot(&nuisance, &nuisance);
                        values[run][channel].push(Product { with, left, nuisance, total });
                    }
                }
            }
        }
        let pooled = |values: Vec<Vec<Vec<Product>>>| {
            let of_channel = |(channel, shapes): (usize, &Vec<Pooled>)| -> Vec<PooledProduct> {
                let shapes = shapes.iter().enumerate();
                shapes.map(|(shape, pooled)| pooled.products(&self.blocks, &values, channel, shape)).collect()
            };
            Products { pooled: self.pooled.iter().enumerate().map(of_channel).collect(), values }
        };
        values.into_iter().map(pooled).collect()
    }

    /// Whether each of these nuisance columns acts on one channel of each run at most, which eliminates it.
    fn are_separate(&self, nuisance: &[usize]) -> bool {
        nuisance.iter().all(|&a| self.separate.get(a) == Some(&true))
    }

    /// Fits the model with an alternative's columns added, for a given noise.
    pub(super) fn solve(
        &self,
        products: &Products,
        noise: &[(usize, f64)],
        nuisance: &[usize],
        shared: &[usize],
    ) -> Coefficients {
        if self.are_separate(nuisance) {
            let shared = pooled::solve(&self.pooled, &products.pooled, noise, shared);
            return Coefficients { noise: noise.to_vec(), shared, nuisance: Vec::new() };
        }
        let by_run = self.solve_by_run(products, noise, nuisance, shared);
        let n = nuisance.len();
        let shared = by_run.first().map_or(Vec::new(), |x| x[n..].to_vec());
        let nuisance = by_run.into_iter().map(|x| x[..n].to_vec()).collect();
        Coefficients { noise: noise.to_vec(), shared, nuisance }
    }

    /// The same for each run: coefficients of its nuisance columns, then of the shared ones.
    pub(super) fn solve_by_run(
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
            let mut normal = normal(row, noise, &ids);
            for (value, &(shape, sigma)) in values.iter().zip(noise) {
                let weight = 1.0 / (sigma * sigma);
                for (i, &a) in ids.iter().enumerate() {
                    normal[(last, i)] += weight * value[shape].with[a];
                }
            }
            bordered.add(&normal);
        }
        // A column that the others already span (a polynomial within the nuisances) is dropped.
        let (x, _) = bordered.solve(&bordered.factor_of_independent());
        bordered.coefficients(&x)
    }

    /// Residual sum of squares of one channel under one shape, and the log determinant. The nuisance coefficients that the channel
    /// determines are fitted anew under each shape; the others are given.
    fn squares(
        &self,
        products: &Products,
        (channel, shape): (usize, usize),
        (nuisance, shared): (&[usize], &[usize]),
        coefficients: &Coefficients,
    ) -> (f64, f64) {
        let product = &products.pooled[channel][shape];
        let (mut squares, log_determinant) =
            self.pooled[channel][shape].left(product, shared, &coefficients.shared);
        // Without coefficients of nuisance columns there are none but those that are eliminated.
        let by_run = products.values.iter().zip(&coefficients.nuisance);
        for (row, (values, x)) in self.blocks.iter().zip(by_run) {
            let block = &row[channel].shapes[shape];
            let product = &values[channel][shape];
            for (k, (&a, xa)) in nuisance.iter().zip(x).enumerate() {
                let Some(place) = block.others[a] else { continue };
                let beside = block.gram.beside(place);
                let with = |(&c, xc): (&usize, &f64)| block.others[c].map_or(0.0, |other| beside[other] * xc);
                let pairs = nuisance[..k].iter().zip(x).map(with).sum::<f64>()
                    + shared.iter().zip(&coefficients.shared).map(with).sum::<f64>();
                let left = product.with[a] - dot(&block.eliminated.borders[a], &product.nuisance);
                squares += xa * (-2.0 * left + beside[place] * xa + 2.0 * pairs);
            }
        }
        (squares.max(0.0), log_determinant)
    }

    /// Score and sigma of a channel under a shape of the family.
    fn channel_score(&self, channel: usize, shape: usize, squares: f64, log_determinant: f64) -> (f64, f64) {
        let freedom = self.freedom[channel];
        let sigma = self.rule.sigma(channel, &self.problem.family.shape(shape), (squares / freedom).sqrt());
        (-freedom * sigma.ln() - 0.5 * log_determinant - 0.5 * squares / (sigma * sigma), sigma)
    }

    /// Every noise that a channel may have beside given coefficients, each with its likeliest sigma.
    pub(super) fn noises(
        &self,
        products: &Products,
        channel: usize,
        columns: (&[usize], &[usize]),
        coefficients: &Coefficients,
    ) -> Vec<ScoredNoise> {
        let scored = |shape: usize| {
            let of_noise = self.problem.family.shape(self.in_play[shape]);
            self.rule.may_have(channel, &of_noise).then(|| {
                let (squares, log_determinant) =
                    self.squares(products, (channel, shape), columns, coefficients);
                let (score, sigma) =
                    self.channel_score(channel, self.in_play[shape], squares, log_determinant);
                ScoredNoise { shape, sigma, score: score + of_noise.log_prior() }
            })
        };
        (0..self.in_play.len()).filter_map(scored).collect()
    }

    /// Fits coefficients and noise in turn; returns the score, the noise and the coefficients.
    pub(super) fn alternate(
        &self,
        products: &Products,
        nuisance: &[usize],
        shared: &[usize],
        start: &[(usize, f64)],
        rounds: usize,
    ) -> (f64, Vec<(usize, f64)>, Coefficients) {
        let mut noise = start.to_vec();
        let mut coefficients = self.solve(products, &noise, nuisance, shared);
        let mut score = f64::NEG_INFINITY;
        for round in 0..rounds {
            let mut total = 0.0;
            let mut next = noise.clone();
            for (channel, state) in next.iter_mut().enumerate() {
                let scored = self.noises(products, channel, (nuisance, shared), &coefficients);
                // A score that is no number is none, and of equal ones the first counts.
                let known = scored.into_iter().filter(|noise| noise.score > f64::NEG_INFINITY);
                let best = known.reduce(|best, next| if next.score > best.score { next } else { best });
                total += best.as_ref().map_or(f64::NEG_INFINITY, |best| best.score);
                *state = best.map_or(*state, |best| (best.shape, best.sigma));
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
        coefficients: &Coefficients,
    ) -> f64 {
        noise
            .iter()
            .enumerate()
            .map(|(c, &(shape, sigma))| {
                self.squares(products, (c, shape), (nuisance, shared), coefficients).0 / (sigma * sigma)
            })
            .sum()
    }

    /// White noise at the level of the whole data, where fits begin.
    pub(super) fn white_start(&self, products: &Products) -> Vec<(usize, f64)> {
        (0..self.problem.channels())
            .map(|c| (0, self.channel_score(c, 0, products.pooled[c][0].total, 0.0).1))
            .collect()
    }
}
