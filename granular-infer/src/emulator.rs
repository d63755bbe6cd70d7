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
/// Weight of a coefficient's distance from zero, in samples.
const RIDGE: f64 = 1e-3;
/// Blur variance (px^2) at which half of its effect is there.
const HALF_BLUR: f64 = 1.0;
/// Work of adhesion (J/m2) likewise.
const HALF_ADHESION: f64 = 0.05;

impl Emulator {
    /// Learns from the pictures of a campaign with these ranges.
    ///
    /// # Errors
    /// [`EmulatorError`].
    pub fn learn(ranges: &Ranges, samples: &[Sample]) -> Result<Self, EmulatorError> {
        let scaled: Vec<Scaled> =
            samples.iter().map(|s| Scaled::new(ranges, &s.conditions, s.blur_px2)).collect();
        let expected = 3 * scaled.first().map_or(1, |s| s.scalar().len());
        if samples.len() < expected {
            return Err(EmulatorError::TooFew { received: samples.len(), expected });
        }
        let spread_rows: Vec<DVector<f64>> = scaled.iter().map(Scaled::spread).collect();
        let mut emulator = Self {
            ranges: *ranges,
            mean: Vec::new(),
            spread: Vec::new(),
            correlation: DMatrix::identity(COUNT, COUNT),
        };
        let mut standard = DMatrix::zeros(samples.len(), COUNT);
        let mut k = 0;
        while k < COUNT {
            // A pair's two parts share their coefficients.
            let width = if k + 1 < COUNT && STATISTICS[k + 1].1 == Symmetry::Second { 2 } else { 1 };
            let rows: Vec<Vec<DVector<f64>>> =
                (k..k + width).map(|s| scaled.iter().map(|p| p.features(s)).collect()).collect();
            let values = |s: usize, i: usize| samples[i].statistics[k + s];
            let mut weights = vec![1.0; samples.len()];
            let (mut mean, mut spread) = (DVector::zeros(0), DVector::zeros(0));
            for _ in 0..3 {
                mean = least_squares((0..width).flat_map(|s| {
                    let (rows, weights) = (&rows[s], &weights);
                    (0..samples.len()).map(move |i| (&rows[i], values(s, i), weights[i]))
                }));
                let freedom = (width * samples.len()) as f64 / (width * samples.len() - mean.len()) as f64;
                let left = |s: usize, i: usize| values(s, i) - rows[s][i].dot(&mean);
                let floor =
                    (0..samples.len()).map(|i| left(0, i).powi(2)).sum::<f64>() / samples.len() as f64;
                let log = |s: usize, i: usize| {
                    (freedom * left(s, i).powi(2) + 1e-6 * floor + 1e-300).ln() - LOG_CHI2
                };
                spread = least_squares((0..width).flat_map(|s| {
                    let (rows, log) = (&spread_rows, &log);
                    (0..samples.len()).map(move |i| (&rows[i], log(s, i), 1.0))
                }));
                // Logs of squares are anything but normal: the level is set by the squares themselves.
                let ratio = (0..width)
                    .flat_map(|s| (0..samples.len()).map(move |i| (s, i)))
                    .map(|(s, i)| freedom * left(s, i).powi(2) / spread_rows[i].dot(&spread).exp())
                    .sum::<f64>()
                    / (width * samples.len()) as f64;
                spread[0] += ratio.max(1e-12).ln();
                for (w, row) in weights.iter_mut().zip(&spread_rows) {
                    *w = (spread[0] - row.dot(&spread)).exp();
                }
            }
            for s in 0..width {
                for i in 0..samples.len() {
                    let sigma = (0.5 * spread_rows[i].dot(&spread)).exp();
                    standard[(i, k + s)] = (values(s, i) - rows[s][i].dot(&mean)) / sigma;
                }
                emulator.mean.push(mean.clone());
                emulator.spread.push(spread.clone());
            }
            k += width;
        }
        emulator.correlation = correlation(&standard);
        Ok(emulator)
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
        row.extend(self.base.map(|b| b * b));
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
