//! Dynamics as a Gaussian process: a straight line, and a smooth rest with a squared-exponential kernel over the standardised
//! inputs (Rasmussen and Williams 2006, chapters 2 and 5).

use argmin::core::{CostFunction, Error, Executor, State as _};
use faer::linalg::solvers::{Llt, Solve};
use faer::{Col, Mat, Side};

use crate::powell::Powell;
use crate::predictor::{LearnError, Prediction, Predictor, Refit, enough, finite, nearest_m, row};
use crate::ridge::standards;
use crate::roll::{Action, Roll, State};

/// Rolls from which scale and noise are learned, at most: their marginal likelihood costs the cube of their number.
const MOST_FOR_SCALES: usize = 150;
/// Logarithms of length scale (in standard deviations of the inputs), and of noise over signal (standard deviations).
const LOW: [f64; 2] = [-0.7, -4.6];
const HIGH: [f64; 2] = [3.0, 1.6];
/// Prior standard deviation of the line's coefficients, in standard deviations of the change.
const LINE: f64 = 3.0;

const UNDETERMINED: LearnError = LearnError::Undetermined { degree: 1 };

/// A Gaussian process over state and action, one for each dimension's change with a common kernel.
#[derive(Debug, Clone)]
pub struct GaussianProcess {
    rolls: Vec<(Roll, f64)>,
    mean: [f64; 5],
    per_scale: [f64; 5],
    inputs: Vec<[f64; 5]>,
    /// Mean and standard deviation of each change.
    change: [[f64; 2]; 3],
    log: [f64; 2],
    weights: Mat<f64>,
    factor: Llt<f64>,
    /// Standard deviation of the signal, by dimension, in units of the change's.
    signal: [f64; 3],
}

fn kernel(a: &[f64; 5], b: &[f64; 5], length: f64) -> f64 {
    let (mut far, mut along) = (0.0, 1.0);
    for k in 0..5 {
        far += (a[k] - b[k]) * (a[k] - b[k]);
        along += a[k] * b[k];
    }
    (-0.5 * far / (length * length)).exp() + LINE * LINE * along
}

/// Cholesky factor of the covariance of some rolls, which only its lower half makes.
fn factor(inputs: &[[f64; 5]], noise: impl Fn(usize) -> f64, length: f64) -> Option<Llt<f64>> {
    let n = inputs.len();
    let mut gram = Mat::zeros(n, n);
    for j in 0..n {
        for i in j..n {
            gram[(i, j)] = kernel(&inputs[i], &inputs[j], length);
        }
        gram[(j, j)] += noise(j);
    }
    gram.llt(Side::Lower).ok()
}

/// Product of a column of one matrix with the same of another.
fn dot(a: &Mat<f64>, b: &Mat<f64>, column: usize) -> f64 {
    a.col(column).transpose() * b.col(column)
}

/// Minus the logarithm of the marginal likelihood of some rolls, the signal's size profiled.
struct Evidence {
    inputs: Vec<[f64; 5]>,
    targets: Mat<f64>,
}

impl CostFunction for Evidence {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, log: &Vec<f64>) -> Result<f64, Error> {
        let noise = (2.0 * log[1]).exp();
        let Some(factor) = factor(&self.inputs, |_| noise, log[0].exp()) else { return Ok(1e12) };
        let n = self.inputs.len() as f64;
        let determinant: f64 = factor.L().diagonal().column_vector().iter().map(|d| d.ln()).sum();
        let solved = factor.solve(&self.targets);
        let fits = (0..3).map(|k| {
            let square = dot(&self.targets, &solved, k) / n;
            0.5 * n * square.max(f64::MIN_POSITIVE).ln()
        });
        Ok(3.0 * determinant + fits.sum::<f64>())
    }
}

impl GaussianProcess {
    /// Learns from rolls, its length scale and noise by their marginal likelihood.
    ///
    /// # Errors
    /// [`LearnError`].
    pub fn learn(rolls: &[Roll]) -> Result<Self, LearnError> {
        enough(rolls, 6, 1)?;
        let (mean, per_scale) = standards(rolls);
        let n = rolls.len() as f64;
        let change = [0, 1, 2].map(|k| {
            let of = |r: &Roll| r.next[k] - r.state[k];
            let mean = rolls.iter().map(of).sum::<f64>() / n;
            let variance = rolls.iter().map(|r| (of(r) - mean).powi(2)).sum::<f64>() / n;
            [mean, variance.sqrt().max(1e-9)]
        });
        let mut learned = Self {
            rolls: rolls.iter().map(|r| (*r, 1.0)).collect(),
            mean,
            per_scale,
            inputs: Vec::new(),
            change,
            log: [0.5, -1.0],
            weights: Mat::zeros(0, 3),
            factor: Mat::<f64>::identity(1, 1).llt(Side::Lower).map_err(|_| UNDETERMINED)?,
            signal: [1.0; 3],
        };
        learned.inputs = rolls.iter().map(|r| learned.standardised(&r.state, &r.action)).collect();
        learned.scales()?;
        learned.refit()?;
        Ok(learned)
    }

    fn standardised(&self, state: &State, action: &Action) -> [f64; 5] {
        let x = row(state, action);
        std::array::from_fn(|k| (x[k] - self.mean[k]) * self.per_scale[k])
    }

    fn target(&self, roll: &Roll, k: usize) -> f64 {
        (roll.next[k] - roll.state[k] - self.change[k][0]) / self.change[k][1]
    }

    /// Length scale and noise, from some of the rolls.
    fn scales(&mut self) -> Result<(), LearnError> {
        let step = self.rolls.len().div_ceil(MOST_FOR_SCALES);
        let some: Vec<usize> = (0..self.rolls.len()).step_by(step).collect();
        let inputs: Vec<[f64; 5]> = some.iter().map(|&i| self.inputs[i]).collect();
        let targets = Mat::from_fn(some.len(), 3, |i, k| self.target(&self.rolls[some[i]].0, k));
        let powell = Powell::new(LOW.to_vec(), HIGH.to_vec(), 1e-5).map_err(|_| UNDETERMINED)?;
        let found = Executor::new(Evidence { inputs, targets }, powell)
            .configure(|s| s.param(self.log.to_vec()).max_iters(8))
            .timer(false)
            .ctrlc(false)
            .run()
            .map_err(|_| UNDETERMINED)?;
        if let Some(&[length, noise]) = found.state().get_best_param().map(Vec::as_slice) {
            self.log = [length, noise];
        }
        Ok(())
    }

    fn mean_change(&self, input: &[f64; 5]) -> State {
        let length = self.log[0].exp();
        let mut sum = [0.0; 3];
        for (i, other) in self.inputs.iter().enumerate() {
            let k = kernel(input, other, length);
            (0..3).for_each(|d| sum[d] += k * self.weights[(i, d)]);
        }
        std::array::from_fn(|d| self.change[d][0] + self.change[d][1] * sum[d])
    }
}

impl Predictor for GaussianProcess {
    fn next(&self, state: &State, action: &Action) -> State {
        let change = self.mean_change(&self.standardised(state, action));
        std::array::from_fn(|k| state[k] + change[k])
    }

    fn predict(&self, state: &State, action: &Action) -> [Prediction; 3] {
        let input = self.standardised(state, action);
        let (length, noise) = (self.log[0].exp(), (2.0 * self.log[1]).exp());
        let mut cross = Col::from_fn(self.inputs.len(), |i| kernel(&input, &self.inputs[i], length));
        self.factor.L().solve_lower_triangular_in_place(cross.as_mat_mut());
        let unsure = (kernel(&input, &input, length) - cross.squared_norm_l2()).max(0.0);
        let change = self.mean_change(&input);
        std::array::from_fn(|k| Prediction {
            mean: state[k] + change[k],
            sigma: self.change[k][1] * self.signal[k] * (unsure + noise).sqrt(),
        })
    }
}

/// A roll of weight w counts as one with 1/w of the noise's variance; a refit costs the cube of the number of rolls.
impl Refit for GaussianProcess {
    fn add(&mut self, roll: &Roll, weight: f64) -> Result<(), LearnError> {
        if !(finite(roll) && weight > 0.0 && weight.is_finite()) {
            return Err(UNDETERMINED);
        }
        self.rolls.push((*roll, weight));
        Ok(())
    }

    fn refit(&mut self) -> Result<(), LearnError> {
        let inputs: Vec<[f64; 5]> =
            self.rolls.iter().map(|(r, _)| self.standardised(&r.state, &r.action)).collect();
        let noise = (2.0 * self.log[1]).exp();
        let factor = factor(&inputs, |i| noise / self.rolls[i].1, self.log[0].exp()).ok_or(UNDETERMINED)?;
        let targets = Mat::from_fn(inputs.len(), 3, |i, k| self.target(&self.rolls[i].0, k));
        self.weights = factor.solve(&targets);
        let n = inputs.len() as f64;
        self.signal = [0, 1, 2].map(|k| (dot(&targets, &self.weights, k) / n).max(0.0).sqrt());
        (self.inputs, self.factor) = (inputs, factor);
        Ok(())
    }

    fn distance_m(&self, state: &State) -> f64 {
        let states: Vec<State> = self.rolls.iter().map(|(r, _)| r.state).collect();
        nearest_m(&states, state)
    }
}
