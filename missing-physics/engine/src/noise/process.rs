//! Measurement noise: white, correlated, or both, along a run.
//!
//! A channel's noise is `sigma` times a unit-variance process that is the sum of a white part and a correlated part, the
//! latter an Ornstein-Uhlenbeck process (an AR(1) on evenly spaced rows) or a Matern process with nu = 3/2 (smooth, the
//! error of a camera or a thermometer). Both have a state of one or two numbers, so that a Kalman filter whitens a
//! column in O(n) at any spacing of the rows and with rows missing (Hartikainen and Sarkka 2010,
//! doi:10.1109/MLSP.2010.5589113).

use nalgebra::DMatrix;

use crate::statistics::median;

/// How the unit-variance noise of one channel is correlated along a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// Share of the variance that is correlated, in [0, 1].
    pub correlated: f64,
    /// Correlation length of that part, in median steps between rows.
    pub length_steps: f64,
    /// Whether the correlated part is smooth (Matern 3/2) or rough (Ornstein-Uhlenbeck).
    pub smooth: bool,
    /// Whether it is correlated from row to row, however far apart these are (a filter that runs with the readings), and not
    /// along the noise variable.
    pub by_row: bool,
    /// How large the errors are that accumulate along a run as the model says, beside white noise: ratio of their root mean square to
    /// its sigma.
    pub accumulated: f64,
    /// Correlation of neighbouring steps of those errors: what scatters remembers.
    pub memory: f64,
}

impl Shape {
    /// White noise.
    pub const WHITE: Self = Self {
        correlated: 0.0,
        length_steps: 0.0,
        smooth: false,
        by_row: false,
        accumulated: 0.0,
        memory: 0.0,
    };

    /// Share of the variance that is correlated, and over how many steps, in runs of so many: errors that accumulate are, over a run.
    pub fn correlation(&self, steps: f64) -> (f64, f64) {
        let square = self.accumulated * self.accumulated;
        if square > 0.0 { (square / (1.0 + square), steps) } else { (self.correlated, self.length_steps) }
    }

    /// Correlation of rows so many steps apart, along evenly spaced rows; of errors that accumulate none.
    fn at_lag(&self, lag: f64) -> f64 {
        if self.correlated <= 0.0 {
            return 0.0;
        }
        let x = if self.smooth { 3f64.sqrt() * lag / self.length_steps } else { lag / self.length_steps };
        self.correlated * (-x).exp() * if self.smooth { 1.0 + x } else { 1.0 }
    }

    /// How many times larger than for white noise the variance is of the mean of many evenly spaced rows, and that of the mean of their squares.
    pub(crate) fn of_means(&self) -> [f64; 2] {
        /// Lags beyond which nothing is left, in correlation lengths.
        const FAR: f64 = 20.0;
        let lags = (1..=(FAR * self.length_steps).ceil() as usize).map(|lag| self.at_lag(lag as f64));
        let [sum, squares] = lags.fold([0.0, 0.0], |[sum, squares], r| [sum + r, squares + r * r]);
        [1.0 + 2.0 * sum, 1.0 + 2.0 * squares]
    }

    /// How many times larger than for white noise the variance is of the mean of so many evenly spaced rows.
    pub(crate) fn of_mean(&self, rows: usize) -> f64 {
        let lag = |k: usize| (1.0 - k as f64 / rows as f64) * self.at_lag(k as f64);
        1.0 + 2.0 * (1..rows).map(lag).sum::<f64>()
    }

    /// Log prior weight against white noise: colour has to show, and a faint slow part (which would swallow any faint
    /// slow effect) has to show most.
    pub fn log_prior(&self) -> f64 {
        if self.accumulated > 0.0 {
            if self.memory > 0.0 { -2.0 } else { -1.0 }
        } else if self.correlated <= 0.0 {
            0.0
        } else if self.correlated >= 1.0 && !self.smooth {
            -1.0
        } else {
            -2.0
        }
    }
}

/// Smallest share of the variance that is white.
const LEAST_WHITE: f64 = 1e-6;

/// How many columns go through a filter side by side, at the most.
const LANES: usize = 8;

/// Turns noise of one shape at fixed positions into white noise of unit variance, and back.
#[derive(Debug, Clone)]
pub struct Whitener {
    steps: Vec<Step>,
    kind: Kind,
    /// The lower triangular root of a covariance that no filter makes, row by row.
    root: Vec<Vec<f64>>,
    /// Log determinant of the covariance.
    pub log_determinant: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    White,
    Rough,
    Smooth,
    Root,
}

/// What the filter does at one row: transition from the row before, gain, one over the innovation's sigma.
#[derive(Debug, Clone, Copy)]
struct Step {
    transition: [f64; 4],
    gain: [f64; 2],
    inverse_sigma: f64,
}

impl Whitener {
    /// A whitener for rows at `positions` (rising), with lengths in units of `step`.
    pub fn new(positions: &[f64], step: f64, shape: Shape) -> Self {
        let kind = match shape {
            s if s.correlated <= 0.0 => Kind::White,
            s if s.smooth => Kind::Smooth,
            _ => Kind::Rough,
        };
        if kind == Kind::White {
            return Self { steps: Vec::new(), kind, root: Vec::new(), log_determinant: 0.0 };
        }
        let (correlated, length) = (shape.correlated, shape.length_steps * step);
        // The white part never vanishes altogether: readings have a last digit, and the filter stays regular (also where
        // two rows share a position).
        let white = (1.0 - correlated).max(LEAST_WHITE);
        let rate = if shape.smooth { 3f64.sqrt() / length } else { 1.0 / length };
        // Stationary covariance of the state: diagonal in both cases.
        let stationary = [correlated, if shape.smooth { rate * rate * correlated } else { 0.0 }];
        let mut covariance = [stationary[0], 0.0, stationary[1]]; // p11, p12, p22
        let mut log_determinant = 0.0;
        let steps = (0..positions.len())
            .map(|i| {
                let gap = if i == 0 { 0.0 } else { (positions[i] - positions[i - 1]).max(0.0) };
                let decay = (-rate * gap).exp();
                let f = if shape.smooth {
                    let scaled = rate * gap;
                    [decay * (1.0 + scaled), decay * gap, -decay * rate * scaled, decay * (1.0 - scaled)]
                } else {
                    [decay, 0.0, 0.0, 0.0]
                };
                if i > 0 {
                    covariance = propagate(covariance, stationary, f);
                }
                let innovation = covariance[0] + white;
                let gain = [covariance[0] / innovation, covariance[1] / innovation];
                covariance = [
                    covariance[0] - gain[0] * covariance[0],
                    covariance[1] - gain[0] * covariance[1],
                    covariance[2] - gain[1] * covariance[1],
                ];
                log_determinant += innovation.ln();
                Step { transition: f, gain, inverse_sigma: 1.0 / innovation.sqrt() }
            })
            .collect();
        Self { steps, kind, root: Vec::new(), log_determinant }
    }

    /// A whitener for white noise of unit variance and errors that accumulate: `accumulated[row]` times standard normal numbers, as many
    /// in each row, of which neighbours are correlated by `memory`, and others by its powers. Of white noise alone where these are no
    /// numbers.
    pub fn of_accumulated(accumulated: &[Vec<f64>], memory: f64) -> Self {
        let n = accumulated.len();
        let steps = accumulated.first().map_or(0, Vec::len);
        let adds = DMatrix::from_fn(n, steps, |row, step| accumulated[row][step]);
        let alike = DMatrix::from_fn(steps, steps, |i, j| memory.powi(i.abs_diff(j) as i32));
        let covariance = DMatrix::identity(n, n) + &adds * alike * adds.transpose();
        let Some(factor) = covariance.cholesky() else {
            return Self { steps: Vec::new(), kind: Kind::White, root: Vec::new(), log_determinant: 0.0 };
        };
        let lower = factor.l_dirty();
        let root: Vec<Vec<f64>> = (0..n).map(|i| (0..=i).map(|j| lower[(i, j)]).collect()).collect();
        let log_determinant = 2.0 * (0..n).map(|i| lower[(i, i)].ln()).sum::<f64>();
        Self { steps: Vec::new(), kind: Kind::Root, root, log_determinant }
    }

    /// Whitens a column in place.
    pub fn whiten(&self, column: &mut [f64]) {
        self.whiten_lanes([column]);
    }

    /// Whitens columns of one length in place, each as [`Self::whiten`] does: several go through the filter side by side, since each of
    /// its rows waits for the one before.
    pub fn whiten_all<'c>(&self, columns: impl IntoIterator<Item = &'c mut Vec<f64>>) {
        let mut columns: Vec<&mut [f64]> = columns.into_iter().map(Vec::as_mut_slice).collect();
        for group in columns.chunks_mut(LANES) {
            match group {
                [a] => self.whiten_lanes([a]),
                [a, b] => self.whiten_lanes([a, b]),
                [a, b, c] => self.whiten_lanes([a, b, c]),
                [a, b, c, d] => self.whiten_lanes([a, b, c, d]),
                [a, b, c, d, e] => self.whiten_lanes([a, b, c, d, e]),
                [a, b, c, d, e, f] => self.whiten_lanes([a, b, c, d, e, f]),
                [a, b, c, d, e, f, g] => self.whiten_lanes([a, b, c, d, e, f, g]),
                [a, b, c, d, e, f, g, h] => self.whiten_lanes([a, b, c, d, e, f, g, h]),
                _ => {}
            }
        }
    }

    fn whiten_lanes<const L: usize>(&self, columns: [&mut [f64]; L]) {
        if self.kind == Kind::Root {
            columns.into_iter().for_each(|column| self.whiten_by_root(column));
            return;
        }
        self.run_from(0, columns, |value, mean, inverse_sigma| {
            let innovation = value - mean;
            (innovation * inverse_sigma, innovation)
        });
    }

    fn whiten_by_root(&self, column: &mut [f64]) {
        for (i, row) in self.root.iter().enumerate().take(column.len()) {
            let known: f64 = row[..i].iter().zip(&column[..i]).map(|(r, x)| r * x).sum();
            column[i] = (column[i] - known) / row[i];
        }
    }

    /// Turns white noise of unit variance into noise of this shape, in place.
    pub fn colour(&self, column: &mut [f64]) {
        for (i, row) in self.root.iter().enumerate().take(column.len()).rev() {
            column[i] = row[..=i].iter().zip(&column[..=i]).map(|(r, x)| r * x).sum();
        }
        self.run_from(0, [column], |value, mean, inverse_sigma| {
            let innovation = value / inverse_sigma;
            (mean + innovation, innovation)
        });
    }

    /// The whitened image of a shift of row `i` alone among `n` rows: its entries from row `i` on, at most `reach` of them.
    pub fn impulse(&self, i: usize, n: usize, reach: usize) -> Vec<f64> {
        if self.kind == Kind::White {
            return vec![1.0];
        }
        if self.kind == Kind::Root {
            let mut shift = vec![0.0; n];
            shift[i] = 1.0;
            self.whiten(&mut shift);
            return shift[i..].iter().take(reach).copied().collect();
        }
        let mut image = vec![0.0; n.saturating_sub(i).min(reach)];
        if let Some(first) = image.first_mut() {
            *first = 1.0;
        }
        self.run_from(i, [&mut image], |value, mean, inverse_sigma| {
            let innovation = value - mean;
            (innovation * inverse_sigma, innovation)
        });
        image
    }

    /// Runs the filter over rows of some columns that begin at row `first`, all rows before them being zero.
    #[inline]
    fn run_from<const L: usize>(
        &self,
        first: usize,
        columns: [&mut [f64]; L],
        output: impl Fn(f64, f64, f64) -> (f64, f64),
    ) {
        let steps = self.steps.get(first..).unwrap_or_default();
        let rows = columns.iter().fold(steps.len(), |rows, column| rows.min(column.len()));
        let mut columns = columns.map(|column| &mut column[..rows]);
        match self.kind {
            Kind::White | Kind::Root => {}
            Kind::Rough => {
                let mut state = [0.0; L];
                for (row, step) in steps[..rows].iter().enumerate() {
                    for (column, state) in columns.iter_mut().zip(&mut state) {
                        *state *= step.transition[0];
                        let (out, innovation) = output(column[row], *state, step.inverse_sigma);
                        *state += step.gain[0] * innovation;
                        column[row] = out;
                    }
                }
            }
            Kind::Smooth => {
                let mut state = [[0.0; 2]; L];
                for (row, step) in steps[..rows].iter().enumerate() {
                    let f = step.transition;
                    for (column, [state, slope]) in columns.iter_mut().zip(&mut state) {
                        (*state, *slope) = (f[0] * *state + f[1] * *slope, f[2] * *state + f[3] * *slope);
                        let (out, innovation) = output(column[row], *state, step.inverse_sigma);
                        *state += step.gain[0] * innovation;
                        *slope += step.gain[1] * innovation;
                        column[row] = out;
                    }
                }
            }
        }
    }
}

/// Covariance after a transition `f` of a process with diagonal stationary covariance.
fn propagate(p: [f64; 3], stationary: [f64; 2], f: [f64; 4]) -> [f64; 3] {
    // P' = S + F (P - S) F^T keeps the stationary covariance exactly.
    let d = [p[0] - stationary[0], p[1], p[2] - stationary[1]];
    let top = [f[0] * d[0] + f[1] * d[1], f[0] * d[1] + f[1] * d[2]];
    let bottom = [f[2] * d[0] + f[3] * d[1], f[2] * d[1] + f[3] * d[2]];
    [
        (stationary[0] + top[0] * f[0] + top[1] * f[1]).max(0.0),
        top[0] * f[2] + top[1] * f[3],
        (stationary[1] + bottom[0] * f[2] + bottom[1] * f[3]).max(0.0),
    ]
}

/// Sigma of a column's rough part, from differences that a locally cubic curve does not touch; `None` below 8 rows.
///
/// `values` at `positions`; robust against spikes (median of moduli).
pub fn rough_sigma(positions: &[f64], values: &[f64]) -> Option<f64> {
    if values.len() < 8 {
        return None;
    }
    let mut moduli: Vec<f64> = (2..values.len() - 2).map(|i| departure(positions, values, i).abs()).collect();
    Some(median(&mut moduli)? / 0.6745)
}

/// Distance of row `i` from the cubic through its four neighbours, scaled to the sigma of one row.
fn departure(positions: &[f64], values: &[f64], i: usize) -> f64 {
    let ids = [i - 2, i - 1, i + 1, i + 2];
    let weights = lagrange(positions, &ids, positions[i]);
    let guess: f64 = ids.iter().zip(&weights).map(|(&j, w)| w * values[j]).sum();
    (values[i] - guess) / (1.0 + weights.iter().map(|w| w * w).sum::<f64>()).sqrt()
}

fn lagrange(positions: &[f64], ids: &[usize], at: f64) -> Vec<f64> {
    ids.iter()
        .map(|&j| {
            ids.iter()
                .filter(|&&k| k != j)
                .map(|&k| {
                    let gap = positions[j] - positions[k];
                    if gap == 0.0 { 0.0 } else { (at - positions[k]) / gap }
                })
                .product()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::family::Family;
    use nalgebra::{DMatrix, DVector};

    fn covariance(positions: &[f64], step: f64, shape: Shape) -> DMatrix<f64> {
        let n = positions.len();
        DMatrix::from_fn(n, n, |i, j| {
            let gap = (positions[i] - positions[j]).abs() / (step * shape.length_steps.max(1e-9));
            let kernel = if shape.smooth {
                (1.0 + 3f64.sqrt() * gap) * (-(3f64.sqrt()) * gap).exp()
            } else {
                (-gap).exp()
            };
            let white = if i == j { (1.0 - shape.correlated).max(LEAST_WHITE) } else { 0.0 };
            shape.correlated * kernel + white
        })
    }

    /// The filter is the Cholesky factor of the covariance: same quadratic form, same determinant, uneven rows.
    #[test]
    fn whitening_agrees_with_the_dense_covariance() {
        let positions: Vec<f64> = (0..40)
            .scan(0.0, |t, i| {
                *t += 0.1 * (1.0 + 0.5 * f64::from(i % 3));
                Some(*t)
            })
            .collect();
        let values: Vec<f64> = (0..40).map(|i| (f64::from(i) * 0.7).sin() + 0.1 * f64::from(i % 5)).collect();
        for shape in (1..Family::get().len())
            .step_by(23)
            .chain(Family::get().few().skip(1))
            .map(|n| Family::get().shape(n))
        {
            let dense = covariance(&positions, 0.15, shape).cholesky().expect("positive definite");
            let y = DVector::from_vec(values.clone());
            let form = y.dot(&dense.solve(&y));
            let log_determinant: f64 = 2.0 * dense.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
            let whitener = Whitener::new(&positions, 0.15, shape);
            let mut white = values.clone();
            whitener.whiten(&mut white);
            let fast: f64 = white.iter().map(|v| v * v).sum();
            approx::assert_relative_eq!(fast, form, max_relative = 1e-7);
            approx::assert_relative_eq!(whitener.log_determinant, log_determinant, epsilon = 1e-6);
            whitener.colour(&mut white);
            for (a, b) in white.iter().zip(&values) {
                approx::assert_relative_eq!(a, b, epsilon = 1e-9);
            }
        }
    }

    /// Errors that accumulate, of steps that forget or remember: the dense covariance again, and a shift of one row as whitening shows it.
    #[test]
    fn accumulated_errors_are_whitened_by_their_covariance() {
        for memory in [0.0, 0.6] {
            accumulated_errors_with(memory);
        }
    }

    fn accumulated_errors_with(memory: f64) {
        let accumulated: Vec<Vec<f64>> = (0..9)
            .map(|row| (0..7).map(|step| 0.4 * f64::from((row - step).max(0)).powf(1.3)).collect())
            .collect();
        let dense = DMatrix::from_fn(9, 9, |i, j| {
            let mut shared = f64::from(u8::from(i == j));
            for (step, a) in accumulated[i].iter().enumerate() {
                for (other, b) in accumulated[j].iter().enumerate() {
                    shared += a * b * memory.powf((step as f64 - other as f64).abs());
                }
            }
            shared
        });
        let factor = dense.cholesky().expect("positive definite");
        let whitener = Whitener::of_accumulated(&accumulated, memory);
        let y = DVector::from_fn(9, |i, _| (1.7 * i as f64).cos());
        let mut white = y.as_slice().to_vec();
        whitener.whiten(&mut white);
        let fast: f64 = white.iter().map(|v| v * v).sum();
        approx::assert_relative_eq!(fast, y.dot(&factor.solve(&y)), max_relative = 1e-12);
        let log_determinant: f64 = 2.0 * factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        approx::assert_relative_eq!(whitener.log_determinant, log_determinant, max_relative = 1e-12);
        whitener.colour(&mut white);
        approx::assert_relative_eq!(white.as_slice(), y.as_slice(), epsilon = 1e-12);
        let mut shifted = vec![0.0; 9];
        shifted[4] = 1.0;
        whitener.whiten(&mut shifted);
        assert_eq!(whitener.impulse(4, 9, 3), shifted[4..7]);
    }
}
