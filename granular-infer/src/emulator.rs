//! What the statistics of a picture are on average, and how much they differ from pour to pour, learned from a campaign.
//!
//! The mean of each statistic is a cubic in friction, rolling friction, restitution and height, with terms of each effect and
//! their products with those four. Statistics that turn with the scene get terms that turn with the tilt. The variance is
//! log-quadratic, the correlation between statistics the same everywhere.

use nalgebra::{DMatrix, DVector};

use crate::campaign::{Conditions, Ranges};
use crate::statistics::{COUNT, STATISTICS, Symmetry};

/// A picture of a campaign: how it came about, and its statistics.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// How it was poured.
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
/// Mean of such a variable where it is cut at nine.
const CLIPPED_CHI2: f64 = 0.994_957;
/// Rounds in which a level under such a cut settles.
const LEVELLING: usize = 8;
/// Weight of a coefficient's distance from zero, in samples.
const RIDGE: f64 = 1e-3;
/// Parts into which pours are dealt: each is predicted from the others.
const FOLDS: usize = 6;
/// Blur variance (px^2) at which half of its effect is there.
const HALF_BLUR: f64 = 1.0;
/// Work of adhesion (J/m2) likewise.
const HALF_ADHESION: f64 = 0.05;

impl Emulator {
    /// Learns from the pictures of a campaign with these ranges. Pictures of one pour have to follow each other.
    ///
    /// # Errors
    /// [`EmulatorError`].
    pub fn learn(ranges: &Ranges, samples: &[Sample]) -> Result<Self, EmulatorError> {
        let scaled: Vec<Scaled> =
            samples.iter().map(|s| Scaled::new(ranges, &s.conditions, s.blur_px2)).collect();
        let expected = 4 * scaled.first().map_or(1, |s| s.scalar().len());
        if samples.len() < expected {
            return Err(EmulatorError::TooFew { received: samples.len(), expected });
        }
        let table = Table::new(samples, &scaled);
        let all: Vec<usize> = (0..samples.len()).collect();
        let means: Vec<DVector<f64>> = (0..COUNT).map(|k| table.mean(k, &all)).collect();
        // What a fit leaves of the pours that it has seen is too little; what it leaves of others is what matters.
        let left = table.left_of_others();
        let spread: Vec<DVector<f64>> = (0..COUNT).map(|k| table.spread(k, &left)).collect();
        let standard = DMatrix::from_fn(samples.len(), COUNT, |i, k| {
            left[(i, k)] * (-0.5 * table.spread_rows[i].dot(&spread[k])).exp()
        });
        Ok(Self { ranges: *ranges, mean: means, spread, correlation: correlation(&standard) })
    }

    /// The mean statistics.
    pub fn mean(&self, conditions: &Conditions, blur_px2: f64) -> [f64; COUNT] {
        let scaled = Scaled::new(&self.ranges, conditions, blur_px2);
        std::array::from_fn(|k| scaled.features(k).dot(&self.mean[k]))
    }

    /// Sigmas of the statistics from pour to pour, the emulator's own error included.
    pub fn sigma(&self, conditions: &Conditions, blur_px2: f64) -> [f64; COUNT] {
        let row = Scaled::new(&self.ranges, conditions, blur_px2).spread();
        std::array::from_fn(|k| (0.5 * row.dot(&self.spread[k])).exp())
    }

    /// Correlations of the statistics from pour to pour.
    pub fn correlation(&self) -> &DMatrix<f64> {
        &self.correlation
    }
}

/// Samples as rows of features and values.
struct Table<'a> {
    samples: &'a [Sample],
    scaled: &'a [Scaled],
    spread_rows: Vec<DVector<f64>>,
    /// Which pour each sample is of.
    pour: Vec<usize>,
}

impl<'a> Table<'a> {
    fn new(samples: &'a [Sample], scaled: &'a [Scaled]) -> Self {
        let mut pour = Vec::new();
        let mut last = 0;
        for (i, s) in samples.iter().enumerate() {
            last += usize::from(i > 0 && samples[i - 1].conditions != s.conditions);
            pour.push(last);
        }
        Self { samples, scaled, spread_rows: scaled.iter().map(Scaled::spread).collect(), pour }
    }

    /// The statistics that share their coefficients with one: a pair's two parts, or it alone.
    fn shared(k: usize) -> std::ops::Range<usize> {
        if STATISTICS[k].1 == Symmetry::Second {
            k - 1..k + 1
        } else if STATISTICS[k].1 == Symmetry::Scalar {
            k..k + 1
        } else {
            k..k + 2
        }
    }

    /// Coefficients of a statistic's mean, learned from some samples, each weighted by how little it scatters.
    fn mean(&self, k: usize, among: &[usize]) -> DVector<f64> {
        let parts = Self::shared(k);
        let rows: Vec<Vec<DVector<f64>>> =
            parts.clone().map(|s| among.iter().map(|&i| self.scaled[i].features(s)).collect()).collect();
        let value = |s: usize, m: usize| self.samples[among[m]].statistics[parts.start + s];
        let mut weights = vec![1.0; among.len()];
        let mut mean = DVector::zeros(0);
        for _ in 0..3 {
            mean = least_squares((0..rows.len()).flat_map(|s| {
                let (rows, weights) = (&rows[s], &weights);
                (0..among.len()).map(move |m| (&rows[m], value(s, m), weights[m]))
            }));
            let left: Vec<(usize, f64)> = (0..rows.len())
                .flat_map(|s| (0..among.len()).map(move |m| (s, m)))
                .map(|(s, m)| (among[m], value(s, m) - rows[s][m].dot(&mean)))
                .collect();
            let spread = self.log_variance(&left);
            for (w, &i) in weights.iter_mut().zip(among) {
                *w = (spread[0] - self.spread_rows[i].dot(&spread)).exp();
            }
        }
        mean
    }

    /// Every sample less the mean that was learned without its pour.
    fn left_of_others(&self) -> DMatrix<f64> {
        let mut left = DMatrix::zeros(self.samples.len(), COUNT);
        for fold in 0..FOLDS {
            let (out, among): (Vec<usize>, Vec<usize>) =
                (0..self.samples.len()).partition(|&i| self.pour[i] % FOLDS == fold);
            for k in 0..COUNT {
                let mean = self.mean(k, &among);
                for &i in &out {
                    left[(i, k)] = self.samples[i].statistics[k] - self.scaled[i].features(k).dot(&mean);
                }
            }
        }
        left
    }

    /// Coefficients of a statistic's log variance, from what is left.
    fn spread(&self, k: usize, left: &DMatrix<f64>) -> DVector<f64> {
        let all: Vec<(usize, f64)> =
            Self::shared(k).flat_map(|s| (0..left.nrows()).map(move |i| (i, left[(i, s)]))).collect();
        self.log_variance(&all)
    }

    /// Coefficients of the log variance, from samples and what is left of them.
    fn log_variance(&self, left: &[(usize, f64)]) -> DVector<f64> {
        let n = left.len() as f64;
        let floor = 1e-6 * left.iter().map(|(_, v)| v * v).sum::<f64>() / n + 1e-300;
        let mut spread = least_squares(
            left.iter().map(|(i, v)| (&self.spread_rows[*i], (v * v + floor).ln() - LOG_CHI2, 1.0)),
        );
        // Logs of squares are anything but normal: the level is set by the squares themselves, a wild one counted as three sigmas.
        for _ in 0..LEVELLING {
            let ratio = left
                .iter()
                .map(|(i, v)| (v * v / self.spread_rows[*i].dot(&spread).exp()).min(9.0))
                .sum::<f64>()
                / (n * CLIPPED_CHI2);
            spread[0] += ratio.max(1e-12).ln();
        }
        spread
    }
}

/// Conditions on the scale of their ranges.
struct Scaled {
    /// Friction, rolling friction, restitution and height, -1 to 1.
    base: [f64; 4],
    /// Effects, about 0 to 1 (or -1 to 1): adhesion, ground, variance of sizes, square of the tilt, drag, blur.
    effects: [f64; 6],
    tilt: [f64; 2],
}

impl Scaled {
    fn new(ranges: &Ranges, c: &Conditions, blur_px2: f64) -> Self {
        let line = |[a, b]: [f64; 2], v: f64| 2.0 * (v - a) / (b - a) - 1.0;
        let log = |[a, b]: [f64; 2], v: f64| line([a.ln(), b.ln()], v.max(1e-9).ln());
        let tilt = c.tilt_rad.map(|t| t / ranges.tilt_rad);
        let w = c.work_of_adhesion_j_m2;
        Self {
            base: [
                log(ranges.sliding_friction, c.sliding_friction),
                log(ranges.rolling_friction, c.rolling_friction),
                line(ranges.restitution, c.restitution),
                log(ranges.height_m, c.height_m),
            ],
            effects: [
                w / (w + HALF_ADHESION),
                c.ground_ratio.max(1e-9).ln() / ranges.ground_ratio.ln(),
                (c.size_variation / ranges.size_variation).powi(2),
                tilt[0] * tilt[0] + tilt[1] * tilt[1],
                c.drag_per_m / ranges.drag_per_m,
                blur_px2 / (blur_px2 + HALF_BLUR),
            ],
            tilt,
        }
    }

    /// 1, the four, and their products up to the third degree; effects, their squares and products with the four.
    fn scalar(&self) -> Vec<f64> {
        let mut row = vec![1.0];
        for i in 0..4 {
            row.push(self.base[i]);
            for j in i..4 {
                row.push(self.base[i] * self.base[j]);
                row.extend((j..4).map(|k| self.base[i] * self.base[j] * self.base[k]));
            }
        }
        for (at, e) in self.effects.iter().enumerate() {
            row.extend([*e, e * e]);
            row.extend(self.base.iter().map(|b| b * e));
            // What saturates on one side, or bends the most.
            if at == 1 || at == 5 {
                row.push(e * e * e);
            }
        }
        row
    }

    fn features(&self, statistic: usize) -> DVector<f64> {
        let [x, y] = self.tilt;
        let turning = |part: f64| {
            let mut row = vec![part, part * (x * x + y * y)];
            row.extend(self.base.iter().map(|b| b * part));
            row.push(self.base[3] * self.base[3] * part);
            row.push(self.base[1] * self.base[3] * part);
            DVector::from_vec(row)
        };
        let kind = STATISTICS[statistic].1;
        let first = if kind == Symmetry::Second { STATISTICS[statistic - 1].1 } else { kind };
        match (first, kind) {
            (Symmetry::Vector, Symmetry::Second) => turning(y),
            (Symmetry::Vector, _) => turning(x),
            (Symmetry::Tensor, Symmetry::Second) => turning(2.0 * x * y),
            (Symmetry::Tensor, _) => turning(x * x - y * y),
            _ => DVector::from_vec(self.scalar()),
        }
    }

    /// What the log variance depends on.
    fn spread(&self) -> DVector<f64> {
        let mut row = vec![1.0];
        row.extend(self.base);
        row.extend(self.base.iter().enumerate().flat_map(|(i, b)| self.base[i..].iter().map(move |c| b * c)));
        row.extend(self.effects);
        DVector::from_vec(row)
    }
}

/// Weighted least squares with a faint pull towards zero.
fn least_squares<'a>(rows: impl Iterator<Item = (&'a DVector<f64>, f64, f64)>) -> DVector<f64> {
    let (mut normal, mut right) = (DMatrix::zeros(0, 0), DVector::zeros(0));
    for (row, value, weight) in rows {
        if right.is_empty() {
            (normal, right) = (DMatrix::identity(row.len(), row.len()) * RIDGE, DVector::zeros(row.len()));
        }
        normal.ger(weight, row, row, 1.0);
        right.axpy(weight * value, row, 1.0);
    }
    let zero = DVector::zeros(right.len());
    normal.cholesky().map_or(zero, |c| c.solve(&right))
}

/// Correlation of columns whose mean is zero; an outlier counts as one of three sigmas.
fn correlation(standard: &DMatrix<f64>) -> DMatrix<f64> {
    let clipped = standard.map(|v| v.clamp(-3.0, 3.0));
    let product = clipped.tr_mul(&clipped);
    DMatrix::from_fn(COUNT, COUNT, |i, j| {
        let scale = (product[(i, i)] * product[(j, j)]).sqrt();
        if i == j { 1.0 } else { 0.98 * product[(i, j)] / scale.max(1e-300) }
    })
}
