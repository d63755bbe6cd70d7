//! What the statistics of a picture are on average, and how much they differ from pour to pour, learned from a campaign.
//!
//! The mean of each statistic is a polynomial of the fifth degree in friction, rolling friction, restitution and height, with
//! terms of each effect beside those four and beside another effect; its coefficients are held back as far as pours that were
//! left out are foretold best. Statistics that turn with the scene get terms that turn with the tilt. The variance is
//! log-quadratic, and is that of pours left out; the correlation between statistics is the same everywhere.

mod features;
mod ridge;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use self::features::Scaled;
use self::ridge::Design;
use crate::campaign::{Conditions, Ranges};
use crate::statistics::{COUNT, STATISTICS, Symmetry};

/// A picture of a campaign: how it came about, and its statistics.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// How it was poured; pictures of one pour follow each other.
    pub conditions: Conditions,
    /// Square of the blur's sigma in pixels.
    pub blur_px2: f64,
    /// What the picture shows.
    pub statistics: [f64; COUNT],
}

/// Why there is no emulator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum EmulatorError {
    /// Too few samples for the coefficients.
    #[error("{received} pictures are too few for an emulator, expected at least {expected}")]
    TooFew {
        /// Samples that came.
        received: usize,
        /// Fewest that do.
        expected: usize,
    },
}

/// Means and covariances of the statistics.
#[derive(Debug, Clone)]
pub struct Emulator {
    ranges: Ranges,
    /// Coefficients of the means, one list a statistic.
    mean: Vec<DVector<f64>>,
    /// Coefficients of the log variances, likewise.
    spread: Vec<DVector<f64>>,
    correlation: DMatrix<f64>,
}

/// Mean of the log of a chi-squared variable with one degree of freedom.
const LOG_CHI2: f64 = -1.270_362_845_461_478;
/// Weight of a variance's coefficient's distance from zero, in samples.
const RIDGE: f64 = 1e-3;
/// Rounds in which means and variances are found in turn.
const ROUNDS: usize = 2;

/// A statistic that stands alone, or the two parts of a pair, which share their coefficients.
struct Learned {
    mean: DVector<f64>,
    spread: DVector<f64>,
    /// Distances from what was foretold without them, in sigmas; one list a part.
    standard: Vec<Vec<f64>>,
}

impl Emulator {
    /// Learns from the pictures of a campaign with these ranges.
    ///
    /// # Errors
    /// [`EmulatorError`].
    pub fn learn(ranges: &Ranges, samples: &[Sample]) -> Result<Self, EmulatorError> {
        Self::learn_weighted(ranges, samples, |_| 1.0)
    }

    /// Learns from pictures of which each counts for so many; what counts for nothing (or for no finite number) is left aside. Means,
    /// variances and correlations are best where pictures count for most.
    ///
    /// # Errors
    /// [`EmulatorError`].
    pub fn learn_weighted(
        ranges: &Ranges,
        samples: &[Sample],
        count: impl Fn(&Sample) -> f64,
    ) -> Result<Self, EmulatorError> {
        let (samples, counts): (Vec<Sample>, Vec<f64>) =
            samples.iter().map(|s| (s.clone(), count(s))).filter(|(_, c)| *c > 0.0 && c.is_finite()).unzip();
        let (samples, counts) = (&samples[..], &counts[..]);
        let scaled: Vec<Scaled> =
            samples.iter().map(|s| Scaled::new(ranges, &s.conditions, s.blur_px2)).collect();
        let expected = scaled.first().map_or(1, |s| s.scalar().values.len());
        if samples.len() < expected {
            return Err(EmulatorError::TooFew { received: samples.len(), expected });
        }
        // A pair's two parts share their coefficients.
        let seconds = |k: usize| k < COUNT && STATISTICS[k].1 == Symmetry::Second;
        let firsts: Vec<usize> = (0..COUNT).filter(|k| !seconds(*k)).collect();
        let learned: Vec<Learned> = firsts
            .par_iter()
            .map(|&k| learn(samples, counts, &scaled, k..k + 1 + usize::from(seconds(k + 1))))
            .collect();
        let parts = |l: &Learned| l.standard.len();
        let each = |of: fn(&Learned) -> &DVector<f64>| -> Vec<DVector<f64>> {
            learned.iter().flat_map(|l| std::iter::repeat_n(of(l).clone(), parts(l))).collect()
        };
        let columns: Vec<&Vec<f64>> = learned.iter().flat_map(|l| &l.standard).collect();
        // An outlier counts as one of three sigmas.
        let standard =
            DMatrix::from_fn(samples.len(), COUNT, |i, k| counts[i].sqrt() * columns[k][i].clamp(-3.0, 3.0));
        Ok(Self {
            ranges: *ranges,
            mean: each(|l| &l.mean),
            spread: each(|l| &l.spread),
            correlation: correlation(&standard),
        })
    }

    /// The mean statistics.
    pub fn mean(&self, conditions: &Conditions, blur_px2: f64) -> [f64; COUNT] {
        let scaled = Scaled::new(&self.ranges, conditions, blur_px2);
        let scalar = scaled.scalar().values;
        std::array::from_fn(|k| {
            let dot = |row: &[f64]| row.iter().zip(&self.mean[k]).map(|(a, b)| a * b).sum();
            if STATISTICS[k].1 == Symmetry::Scalar { dot(&scalar) } else { dot(&scaled.of(k).values) }
        })
    }

    /// Sigmas of the statistics from pour to pour, the emulator's own error included.
    pub fn sigma(&self, conditions: &Conditions, blur_px2: f64) -> [f64; COUNT] {
        let row = DVector::from_vec(Scaled::new(&self.ranges, conditions, blur_px2).spread());
        std::array::from_fn(|k| (0.5 * row.dot(&self.spread[k])).exp())
    }

    /// Correlations of the statistics from pour to pour.
    pub fn correlation(&self) -> &DMatrix<f64> {
        &self.correlation
    }
}

/// Mean and variance of the statistics `parts`, one alone or a pair.
fn learn(samples: &[Sample], counts: &[f64], scaled: &[Scaled], parts: std::ops::Range<usize>) -> Learned {
    let n = samples.len();
    // Pictures of one pour are left out together.
    let mut group = vec![0; n];
    for i in 1..n {
        group[i] = group[i - 1] + usize::from(samples[i].conditions != samples[i - 1].conditions);
    }
    let terms: Vec<_> = parts.clone().flat_map(|k| scaled.iter().map(move |s| s.of(k))).collect();
    let width = terms.first().map_or(0, |t| t.values.len());
    let design = Design {
        rows: DMatrix::from_fn(terms.len(), width, |i, j| terms[i].values[j]),
        degrees: terms.first().map_or_else(Vec::new, |t| t.degrees.clone()),
        groups: (0..terms.len()).map(|i| group[i % n]).collect(),
    };
    let all = parts.clone().flat_map(|k| samples.iter().map(move |s| s.statistics[k]));
    let values = DVector::from_iterator(terms.len(), all);
    let rows: Vec<DVector<f64>> = scaled.iter().map(|s| DVector::from_vec(s.spread())).collect();
    let mut weights = DVector::from_fn(values.len(), |i, _| counts[i % n]);
    let (mut mean, mut spread) = (DVector::zeros(0), DVector::zeros(0));
    let mut left = Vec::new();
    for _ in 0..ROUNDS {
        let fitted = design.fit(&values, &weights);
        (mean, left) = (fitted.coefficients, fitted.left_out);
        let squares: Vec<f64> = left.iter().map(|l| l * l).collect();
        let floor = 1e-6 * squares.iter().sum::<f64>() / squares.len() as f64 + 1e-300;
        let logs = squares.iter().map(|s| (s + floor).ln() - LOG_CHI2);
        spread = least_squares(logs.enumerate().map(|(i, log)| (&rows[i % n], counts[i % n], log)));
        // Logs of squares are anything but normal: the level is set by the squares themselves.
        let ratio = squares
            .iter()
            .enumerate()
            .map(|(i, s)| counts[i % n] * s / rows[i % n].dot(&spread).exp())
            .sum::<f64>();
        let all = parts.len() as f64 * counts.iter().sum::<f64>();
        spread[0] += (ratio / all).max(1e-12).ln();
        weights = DVector::from_fn(values.len(), |i, _| {
            counts[i % n] * (spread[0] - rows[i % n].dot(&spread)).exp()
        });
        weights /= weights.mean().max(1e-300);
    }
    let sigma = |i: usize| (0.5 * rows[i % n].dot(&spread)).exp();
    let standard =
        left.chunks(n).map(|l| l.iter().enumerate().map(|(i, l)| l / sigma(i)).collect()).collect();
    Learned { mean, spread, standard }
}

/// Least squares with a faint pull towards zero.
fn least_squares<'a>(rows: impl Iterator<Item = (&'a DVector<f64>, f64, f64)>) -> DVector<f64> {
    let (mut normal, mut right) = (DMatrix::zeros(0, 0), DVector::zeros(0));
    for (row, weight, value) in rows {
        if right.is_empty() {
            (normal, right) = (DMatrix::identity(row.len(), row.len()) * RIDGE, DVector::zeros(row.len()));
        }
        normal.ger(weight, row, row, 1.0);
        right.axpy(weight * value, row, 1.0);
    }
    let zero = DVector::zeros(right.len());
    normal.cholesky().map_or(zero, |c| c.solve(&right))
}

/// Correlation of columns whose mean is zero.
fn correlation(standard: &DMatrix<f64>) -> DMatrix<f64> {
    let product = standard.tr_mul(standard);
    DMatrix::from_fn(COUNT, COUNT, |i, j| {
        let scale = (product[(i, i)] * product[(j, j)]).sqrt();
        if i == j { 1.0 } else { 0.98 * product[(i, j)] / scale.max(1e-300) }
    })
}
