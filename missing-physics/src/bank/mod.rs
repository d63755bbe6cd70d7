//! The linearised model around a fit: everything that an adequacy test needs of the data, as sums over rows.
//!
//! Around the fitted parameters the prediction is a plane. For each run, channel and noise shape the whitened columns of
//! that plane, and of the directions in which it might be wrong, leave a small Gram matrix; a data vector leaves its
//! products with them. A refit of the model, of any alternative and of the noise is then algebra on a few small matrices,
//! which is what makes a bootstrap of the *whole* fit affordable.

mod curves;
mod outliers;

use nalgebra::DMatrix;

use crate::fit::{Fit, NoiseRule, NoiseState, whitened_columns};
use crate::linalg::{RANK_FLOOR, backward, cholesky, determined, dot, forward, log_determinant};
use crate::model::PredictError;
use crate::problem::{Problem, Selection};
pub(crate) use curves::Curves;

/// A way in which the model might be wrong, as columns that are added to it.
#[derive(Debug, Clone)]
pub(crate) struct Alternative {
    pub(crate) name: String,
    /// Columns added to each run's own ones.
    own: Vec<usize>,
    /// Columns added to the shared ones.
    shared: Vec<usize>,
    /// For a single shared column: the sign that its coefficient must have (0: either).
    sign: f64,
}

/// Degree of the polynomial in a variable that the bank looks for.
pub(crate) const DEGREE: usize = 5;

/// Most moves of a climb among shapes at one stride.
const CLIMB: usize = 8;

/// One run and channel: whitened columns for each shape that is in play.
struct Block {
    /// Raw (unwhitened) columns over the measured rows.
    raw: Vec<Vec<f64>>,
    /// The model's own columns that this channel determines.
    mine: Vec<usize>,
    /// Per shape in play: whitened columns and their Gram matrix.
    shapes: Vec<Whitened>,
}

struct Whitened {
    columns: Vec<Vec<f64>>,
    gram: DMatrix<f64>,
    /// The own columns' Cholesky factor and kept pivots.
    own: (DMatrix<f64>, Vec<bool>),
    /// The own columns' share of every other column: forward-solved products.
    borders: Vec<Vec<f64>>,
    /// Log determinant of the noise and of the own columns.
    log_determinant: f64,
}

/// The linearised model.
pub(crate) struct Bank<'a> {
    problem: &'a Problem<'a>,
    /// Index into the family for each shape in play.
    in_play: Vec<usize>,
    blocks: Vec<Vec<Block>>,
    n_own: usize,
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
    /// The own columns' share, forward-solved.
    own: Vec<f64>,
    /// Sum of squares that the own columns leave.
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
    /// Coefficients of the model alone, by run: own, then shared.
    coefficients: Vec<Vec<f64>>,
}

impl<'a> Bank<'a> {
    /// Linearises around `fit`; the mechanisms in `rivals` become alternatives beside smooth functions of each variable.
    pub(crate) fn new(
        problem: &'a Problem<'a>,
        selection: &Selection,
        fit: &Fit,
        rivals: &[usize],
        rule: &NoiseRule,
    ) -> Result<Self, PredictError> {
        let unit = NoiseState { shape: vec![0; problem.channels()], sigma: vec![1.0; problem.channels()] };
        let spec = problem.spec();
        // One Jacobian over everything that any rival frees.
        let mut wide = selection.clone();
        let mut groups = Vec::new();
        for &m in rivals {
            let mechanism = &spec.mechanisms[m];
            let (mut own, mut shared, mut sign) = (Vec::new(), Vec::new(), 0.0);
            for &p in mechanism.parameters.iter().chain(&mechanism.companions) {
                let slot = problem.slots[p];
                let is_shared = spec.parameters[p].scope == crate::model::Scope::Shared;
                let (list, target) =
                    if is_shared { (&mut wide.shared, &mut shared) } else { (&mut wide.own, &mut own) };
                let at = list.iter().position(|&s| s == slot).unwrap_or_else(|| {
                    list.push(slot);
                    list.len() - 1
                });
                let in_model =
                    if is_shared { selection.shared.contains(&slot) } else { selection.own.contains(&slot) };
                if !in_model {
                    target.push(at);
                }
                let info = &spec.parameters[p];
                sign = if info.lower >= info.start {
                    1.0
                } else if info.upper <= info.start {
                    -1.0
                } else {
                    0.0
                };
            }
            if own.is_empty() && shared.is_empty() {
                continue;
            }
            if shared.len() != 1 || !own.is_empty() {
                sign = 0.0;
            }
            groups.push((mechanism.id.clone(), own, shared, sign));
        }
        // Column order of a block: own of the model, shared of the model, own of rivals, shared of rivals, polynomials.
        let (n_own, n_shared) = (selection.own.len(), selection.shared.len());
        let (extra_own, extra_shared) = (wide.own.len() - n_own, wide.shared.len() - n_shared);
        let place_own = |i: usize| if i < n_own { i } else { n_shared + i };
        let place_shared = |i: usize| if i < n_shared { n_own + i } else { n_own + extra_own + i };
        let mut alternatives: Vec<Alternative> = groups
            .into_iter()
            .map(|(name, own, shared, sign)| Alternative {
                name,
                own: own.into_iter().map(place_own).collect(),
                shared: shared.into_iter().map(place_shared).collect(),
                sign,
            })
            .collect();
        let mechanisms = alternatives.len();
        let base = n_own + n_shared + extra_own + extra_shared;
        let curves = Curves::new(problem, fit)?;
        for (channel, quantity) in problem.recording.channels.iter().enumerate() {
            for (k, name) in curves.names(channel).into_iter().enumerate() {
                let first = base + (curves.offset(channel) + k) * DEGREE;
                alternatives.push(Alternative {
                    name: format!("{} depends on {name}", quantity.name),
                    own: Vec::new(),
                    shared: (first..first + DEGREE).collect(),
                    sign: 0.0,
                });
            }
        }
        let total = base + curves.total() * DEGREE;
        let mut blocks = Vec::with_capacity(problem.rows.len());
        for run in 0..problem.rows.len() {
            let columns = whitened_columns(problem, &wide, &unit, run, &fit.shared, &fit.own[run])?;
            let mut start = 0;
            let mut row = Vec::with_capacity(problem.channels());
            for channel in 0..problem.channels() {
                let n = problem.rows[run].valid[channel].len();
                let mut raw = vec![vec![0.0; n]; total];
                for i in 0..wide.own.len() {
                    raw[place_own(i)].copy_from_slice(&columns[i][start..start + n]);
                }
                for i in 0..wide.shared.len() {
                    raw[place_shared(i)].copy_from_slice(&columns[wide.own.len() + i][start..start + n]);
                }
                curves.fill(problem, run, channel, &mut raw[base..]);
                start += n;
                row.push(Block { raw, mine: Vec::new(), shapes: Vec::new() });
            }
            let squares: Vec<Vec<f64>> =
                row.iter().map(|b| b.raw[..n_own].iter().map(|c| dot(c, c)).collect()).collect();
            let largest: Vec<f64> =
                (0..n_own).map(|k| squares.iter().map(|s| s[k]).fold(0.0, f64::max)).collect();
            for (block, here) in row.iter_mut().zip(&squares) {
                block.mine = determined(here, &largest);
            }
            blocks.push(row);
        }
        let counted: usize = (0..problem.channels()).map(|c| problem.count(c)).sum();
        let freedom = (0..problem.channels())
            .map(|c| {
                let used: usize = blocks.iter().map(|row| row[c].mine.len()).sum();
                let rows = problem.count(c) as f64;
                (rows - used as f64 - n_shared as f64 * rows / counted.max(1) as f64).max(1.0)
            })
            .collect();
        let mut bank = Self {
            problem,
            in_play: Vec::new(),
            blocks,
            n_own,
            n_shared,
            alternatives,
            mechanisms,
            rule: rule.clone(),
            freedom,
        };
        bank.play(&rule.allowed);
        Ok(bank)
    }

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
                        let mut own = DMatrix::from_fn(block.mine.len(), block.mine.len(), |i, j| {
                            gram[(block.mine[i], block.mine[j])]
                        });
                        let kept = cholesky(&mut own, 1e-9);
                        let log_determinant = whitener.log_determinant + log_determinant(&own, &kept);
                        let borders = (0..columns.len())
                            .map(|j| {
                                let mut border: Vec<f64> = block.mine.iter().map(|&i| gram[(i, j)]).collect();
                                forward(&own, &kept, &mut border);
                                border
                            })
                            .collect();
                        Whitened { gram, own: (own, kept), borders, columns, log_determinant }
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

    fn products(&self, data: &[Vec<Vec<f64>>]) -> Products {
        let values = self
            .blocks
            .iter()
            .zip(data)
            .enumerate()
            .map(|(run, (row, data))| {
                row.iter()
                    .zip(data)
                    .enumerate()
                    .map(|(channel, (block, raw))| {
                        block
                            .shapes
                            .iter()
                            .zip(&self.in_play)
                            .map(|(shape, &index)| {
                                let mut y = raw.clone();
                                self.problem.whitener(run, channel, index).whiten(&mut y);
                                let with: Vec<f64> = shape.columns.iter().map(|c| dot(c, &y)).collect();
                                let mut own: Vec<f64> = block.mine.iter().map(|&i| with[i]).collect();
                                forward(&shape.own.0, &shape.own.1, &mut own);
                                let total = dot(&y, &y);
                                Product { with, left: total - dot(&own, &own), own, total }
                            })
                            .collect()
                    })
                    .collect()
            })
            .collect();
        Products { values }
    }

    /// Fits the model with an alternative's columns added, for a given noise.
    fn solve(
        &self,
        products: &Products,
        noise: &[(usize, f64)],
        own: &[usize],
        shared: &[usize],
    ) -> Vec<Vec<f64>> {
        let (q, s) = (own.len(), shared.len());
        let mut information = DMatrix::zeros(s, s);
        let mut right = vec![0.0; s];
        let mut parts = Vec::with_capacity(self.blocks.len());
        for (row, values) in self.blocks.iter().zip(&products.values) {
            let ids: Vec<usize> = own.iter().chain(shared).copied().collect();
            let mut normal = DMatrix::zeros(q + s, q + s);
            let mut b = vec![0.0; q + s];
            for ((block, value), &(shape, sigma)) in row.iter().zip(values).zip(noise) {
                let weight = 1.0 / (sigma * sigma);
                let gram = &block.shapes[shape].gram;
                for (i, &a) in ids.iter().enumerate() {
                    b[i] += weight * value[shape].with[a];
                    for (j, &c) in ids.iter().enumerate().take(i + 1) {
                        normal[(i, j)] += weight * gram[(a, c)];
                    }
                }
            }
            let mut factor = normal.view((0, 0), (q, q)).into_owned();
            let kept = cholesky(&mut factor, RANK_FLOOR);
            let borders: Vec<Vec<f64>> = (0..s)
                .map(|j| {
                    let mut column: Vec<f64> = (0..q).map(|i| normal[(q + j, i)]).collect();
                    forward(&factor, &kept, &mut column);
                    column
                })
                .collect();
            let mut reduced = b[..q].to_vec();
            forward(&factor, &kept, &mut reduced);
            for i in 0..s {
                for j in 0..=i {
                    information[(i, j)] += normal[(q + i, q + j)] - dot(&borders[i], &borders[j]);
                }
                right[i] += b[q + i] - dot(&borders[i], &reduced);
            }
            parts.push((factor, kept, borders, reduced));
        }
        // A column that the others already span (a polynomial within the nuisances) is dropped.
        let kept = cholesky_against(&mut information, &self.scales(noise, shared));
        forward(&information, &kept, &mut right);
        backward(&information, &kept, &mut right);
        parts
            .into_iter()
            .map(|(factor, kept, borders, mut reduced)| {
                for (border, x) in borders.iter().zip(&right) {
                    reduced.iter_mut().zip(border).for_each(|(r, b)| *r -= x * b);
                }
                backward(&factor, &kept, &mut reduced);
                reduced.extend_from_slice(&right);
                reduced
            })
            .collect()
    }

    /// Sums of squares of the shared columns before anything is eliminated, the measure of "already spanned".
    fn scales(&self, noise: &[(usize, f64)], shared: &[usize]) -> Vec<f64> {
        shared
            .iter()
            .map(|&a| {
                self.blocks
                    .iter()
                    .flat_map(|row| row.iter().zip(noise))
                    .map(|(block, &(shape, sigma))| block.shapes[shape].gram[(a, a)] / (sigma * sigma))
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
        for ((row, values), x) in self.blocks.iter().zip(&products.values).zip(coefficients) {
            // The own coefficients are fitted anew under each shape; the others are given.
            let block = &row[channel].shapes[shape];
            let product = &values[channel][shape];
            let mut form = product.left;
            let others = || ids.iter().zip(x).filter(|(a, _)| !row[channel].mine.contains(a));
            for (&a, xa) in others() {
                let mut inner = -2.0 * (product.with[a] - dot(&block.borders[a], &product.own));
                for (&c, xc) in others() {
                    inner += (block.gram[(a, c)] - dot(&block.borders[a], &block.borders[c])) * xc;
                }
                form += xa * inner;
            }
            squares += form.max(0.0);
            log_determinant += block.log_determinant;
        }
        (squares, log_determinant)
    }

    fn channel_score(&self, channel: usize, squares: f64, log_determinant: f64) -> (f64, f64) {
        let freedom = self.freedom[channel];
        let sigma = match self.rule.fixed_sigma[channel] {
            Some(sigma) => sigma,
            None => (squares / freedom).sqrt().max(self.rule.floor[channel]),
        };
        (-freedom * sigma.ln() - 0.5 * log_determinant - 0.5 * squares / (sigma * sigma), sigma)
    }

    /// Fits coefficients and noise in turn; returns the score, the noise and the coefficients.
    fn alternate(
        &self,
        products: &Products,
        own: &[usize],
        shared: &[usize],
        start: &[(usize, f64)],
        rounds: usize,
    ) -> (f64, Vec<(usize, f64)>, Vec<Vec<f64>>) {
        let ids: Vec<usize> = own.iter().chain(shared).copied().collect();
        let mut noise = start.to_vec();
        let mut coefficients = self.solve(products, &noise, own, shared);
        let mut score = f64::NEG_INFINITY;
        for round in 0..rounds {
            let mut total = 0.0;
            let mut next = noise.clone();
            for (channel, state) in next.iter_mut().enumerate() {
                let mut best = f64::NEG_INFINITY;
                for shape in 0..self.in_play.len() {
                    let (squares, log_determinant) =
                        self.squares(products, channel, shape, &ids, &coefficients);
                    let (mut value, sigma) = self.channel_score(channel, squares, log_determinant);
                    value += self.problem.family.shape(self.in_play[shape]).log_prior();
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
            coefficients = self.solve(products, &noise, own, shared);
        }
        (score, noise, coefficients)
    }

    /// Sum of squares in units of the noise.
    fn chi2(
        &self,
        products: &Products,
        noise: &[(usize, f64)],
        own: &[usize],
        shared: &[usize],
        coefficients: &[Vec<f64>],
    ) -> f64 {
        let ids: Vec<usize> = own.iter().chain(shared).copied().collect();
        noise
            .iter()
            .enumerate()
            .map(|(c, &(shape, sigma))| {
                self.squares(products, c, shape, &ids, coefficients).0 / (sigma * sigma)
            })
            .sum()
    }

    /// Fits the model and every alternative to a data vector (`[run][channel]`, measured rows).
    pub(crate) fn read(&self, data: &[Vec<Vec<f64>>]) -> Reading {
        let products = self.products(data);
        let own: Vec<usize> = (0..self.n_own).collect();
        let shared: Vec<usize> = (self.n_own..self.n_own + self.n_shared).collect();
        let start = self.white_start(&products);
        let (score, noise, coefficients) = self.alternate(&products, &own, &shared, &start, 8);
        let plain = (own.clone(), shared.clone());
        let gains = self
            .alternatives
            .iter()
            .map(|alternative| {
                let own: Vec<usize> = own.iter().chain(&alternative.own).copied().collect();
                let shared: Vec<usize> = shared.iter().chain(&alternative.shared).copied().collect();
                let (_, beside, _) = self.alternate(&products, &own, &shared, &noise, 4);
                let x = self.solve(&products, &beside, &own, &shared);
                let wrong = alternative.sign != 0.0
                    && x.first().and_then(|x| x.last()).is_some_and(|value| value * alternative.sign < 0.0);
                if wrong {
                    return 0.0;
                }
                let with = self.chi2(&products, &beside, &own, &shared, &x);
                let without = self.solve(&products, &beside, &plain.0, &plain.1);
                (self.chi2(&products, &beside, &plain.0, &plain.1, &without) - with).max(0.0)
            })
            .collect();
        Reading { score, gains, noise, coefficients }
    }

    /// The noise of a data vector once the model *and* every mechanism are fitted to it: shape of the family and sigma, by
    /// channel. Where the noise of null worlds is taken from, so that what is tested for does not swell it.
    pub(crate) fn noise_beyond_mechanisms(&self, data: &[Vec<Vec<f64>>]) -> Vec<(usize, f64)> {
        let products = self.products(data);
        let own: Vec<usize> = (0..self.n_own).collect();
        let mut shared: Vec<usize> = (self.n_own..self.n_own + self.n_shared).collect();
        for alternative in &self.alternatives[..self.mechanisms] {
            for column in &alternative.shared {
                if !shared.contains(column) {
                    shared.push(*column);
                }
            }
        }
        let start = self.white_start(&products);
        let (_, noise, _) = self.alternate(&products, &own, &shared, &start, 8);
        noise.into_iter().map(|(shape, sigma)| (self.in_play[shape], sigma)).collect()
    }

    /// The noise of a data vector as [`Self::noise_beyond_mechanisms`] finds it, of the shapes between those in play as well;
    /// those a standard error about it are put in play beside the others: another vector of this noise would choose among them.
    pub(crate) fn sharpen(&mut self, data: &[Vec<Vec<f64>>]) -> Vec<(usize, f64)> {
        let mut shapes = self.in_play.clone();
        let mut noise = self.noise_beyond_mechanisms(data);
        for stride in self.problem.family.strides() {
            for _ in 0..CLIMB {
                self.play(&self.around(&noise, |_| stride));
                let next = self.noise_beyond_mechanisms(data);
                let still = next.iter().zip(&noise).all(|(a, b)| a.0 == b.0);
                noise = next;
                if still {
                    break;
                }
            }
        }
        let problem = self.problem;
        shapes.extend(self.around(&noise, |channel| problem.family.error_steps(problem.count(channel))));
        shapes.sort_unstable();
        shapes.dedup();
        self.play(&shapes);
        noise
    }

    /// White noise, each channel's shape, and the shapes so many steps about it.
    fn around(&self, noise: &[(usize, f64)], stride: impl Fn(usize) -> usize) -> Vec<usize> {
        let family = self.problem.family;
        let mut shapes = vec![0];
        for (channel, &(shape, _)) in noise.iter().enumerate() {
            let beside = family.around(shape, stride(channel)).into_iter();
            shapes.extend(beside.filter(|&s| self.rule.admits(&family.shape(s))).chain([shape]));
        }
        shapes.sort_unstable();
        shapes.dedup();
        shapes
    }

    /// White noise at the level of the whole data, where fits begin.
    fn white_start(&self, products: &Products) -> Vec<(usize, f64)> {
        (0..self.problem.channels())
            .map(|c| {
                let squares: f64 = products.values.iter().map(|row| row[c][0].total).sum();
                (0, self.channel_score(c, squares, 0.0).1)
            })
            .collect()
    }

    /// The whitened residual of a data vector under the model alone, `[run][channel]`.
    pub(crate) fn whitened_residual(&self, data: &[Vec<Vec<f64>>], reading: &Reading) -> Vec<Vec<Vec<f64>>> {
        let used = self.n_own + self.n_shared;
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

fn gram(columns: &[Vec<f64>]) -> DMatrix<f64> {
    let n = columns.len();
    let mut gram = DMatrix::zeros(n, n);
    for i in 0..n {
        for j in 0..=i {
            gram[(i, j)] = dot(&columns[i], &columns[j]);
            gram[(j, i)] = gram[(i, j)];
        }
    }
    gram
}

/// Cholesky with pivots judged against the columns' sums of squares before elimination.
fn cholesky_against(matrix: &mut DMatrix<f64>, scales: &[f64]) -> Vec<bool> {
    for (i, scale) in scales.iter().enumerate() {
        if matrix[(i, i)] <= 1e-9 * scale {
            for j in 0..scales.len() {
                matrix[(i, j)] = 0.0;
                matrix[(j, i)] = 0.0;
            }
        }
    }
    cholesky(matrix, 1e-9)
}
