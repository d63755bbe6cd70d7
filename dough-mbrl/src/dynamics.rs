//! Dynamics of a dough, learned from rolls, with the uncertainty of what was learned.
//!
//! Least squares on the terms of degree 2 and less; ridge regression on those of degrees 3 and 4, its prior's size found by
//! the marginal likelihood (MacKay 1992, doi:10.1162/neco.1992.4.3.415).

use argmin::core::{CostFunction, Error, Executor, State as _};
use argmin::solver::brent::BrentOpt;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SymmetricEigen};

use crate::features::Polynomial;

/// Length, width and height of a dough, m.
pub type State = [f64; 3];
/// Throw and depth of the band, m.
pub type Action = [f64; 2];

/// Degree of the polynomial, and of its remainder.
const DEGREE: u8 = 2;
const REMAINDER: u8 = 4;

/// One roll as it was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Roll {
    /// Before it.
    pub state: State,
    /// What was done.
    pub action: Action,
    /// After it.
    pub next: State,
}

impl Roll {
    fn inputs(state: &State, action: &Action) -> Vec<f64> {
        state.iter().chain(action).copied().collect()
    }
}

/// Why nothing could be learned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LearnError {
    /// There are too few rolls for the coefficients.
    #[error("{rolls} rolls are too few for {coefficients} coefficients: at least {least} are needed")]
    TooFew {
        /// Rolls there are.
        rolls: usize,
        /// Coefficients of the polynomial.
        coefficients: usize,
        /// Rolls needed.
        least: usize,
    },
    /// A value is not finite, or all rolls are too much alike for their polynomial.
    #[error("the rolls do not determine a polynomial of degree {degree} of state and action")]
    Undetermined {
        /// The degree.
        degree: u8,
    },
}

/// A prediction of one output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// The mean.
    pub mean: f64,
    /// One sigma of what will be measured: noise and all that was not learned.
    pub sigma: f64,
}

/// One output's coefficients.
#[derive(Debug, Clone)]
struct Output {
    coefficients: DVector<f64>,
    sigma: f64,
    /// Factor of the precision of the coefficients, in units of the noise.
    precision: Cholesky<f64, Dyn>,
}

/// Three outputs of some inputs, learned.
#[derive(Debug, Clone)]
struct Surface {
    features: Polynomial,
    /// Scale of each term of the remainder.
    weights: DVector<f64>,
    outputs: [Output; 3],
}

impl Surface {
    /// Learns the changes `outputs` of the rows of inputs: a polynomial of one degree, and a remainder up to another.
    fn learn(rows: &[Vec<f64>], changes: &[State], [degree, remainder]: [u8; 2]) -> Result<Self, LearnError> {
        let features = Polynomial::standardised(rows, remainder);
        let free = features.up_to(degree);
        let least = 2 * free;
        if rows.len() < least {
            return Err(LearnError::TooFew { rolls: rows.len(), coefficients: free, least });
        }
        let undetermined = LearnError::Undetermined { degree };
        let mut design = DMatrix::from_row_iterator(
            rows.len(),
            features.len(),
            rows.iter().flat_map(|r| features.terms(r)),
        );
        let n = rows.len() as f64;
        let weights = DVector::from_fn(features.len(), |k, _| {
            let rms = (design.column(k).norm_squared() / n).sqrt();
            if k < free || rms <= 0.0 { 1.0 } else { 1.0 / rms }
        });
        design.column_iter_mut().zip(weights.iter()).for_each(|(mut c, w)| c *= *w);
        if design.iter().any(|v| !v.is_finite()) {
            return Err(undetermined);
        }
        let output = |k: usize| {
            let change = DVector::from_iterator(rows.len(), changes.iter().map(|c| c[k]));
            learn_output(&design, free, &change)
        };
        let [Some(length), Some(width), Some(height)] = [output(0), output(1), output(2)] else {
            return Err(undetermined);
        };
        Ok(Self { features, weights, outputs: [length, width, height] })
    }

    fn terms(&self, inputs: &[f64]) -> DVector<f64> {
        DVector::from_vec(self.features.terms(inputs)).component_mul(&self.weights)
    }
}

/// Learned dynamics.
#[derive(Debug, Clone)]
pub struct Dynamics {
    surface: Surface,
}

/// What a measured state says of the true one, learned from states that were measured twice.
///
/// Length, width and height hang together, so that each corrects the others' noise. A roll changes the true state; that the
/// next measurement also undoes the noise of this one is no part of the change.
#[derive(Debug, Clone)]
pub struct Likely {
    surface: Surface,
}

impl Likely {
    /// Learns from pairs of independent measurements of the same states.
    ///
    /// # Errors
    /// [`LearnError`].
    pub fn learn(pairs: &[[State; 2]]) -> Result<Self, LearnError> {
        let rows: Vec<Vec<f64>> = pairs.iter().map(|[state, _]| state.to_vec()).collect();
        let changes: Vec<State> =
            pairs.iter().map(|[state, again]| std::array::from_fn(|k| again[k] - state[k])).collect();
        Ok(Self { surface: Surface::learn(&rows, &changes, [1, 2])? })
    }

    /// The mean of the true state, given a measured one.
    pub fn state(&self, measured: &State) -> State {
        let terms = self.surface.terms(measured);
        std::array::from_fn(|k| measured[k] + terms.dot(&self.surface.outputs[k].coefficients))
    }
}

impl Dynamics {
    /// Learns from rolls; the change of each dimension is what is learned.
    ///
    /// # Errors
    /// [`LearnError`].
    pub fn learn(rolls: &[Roll]) -> Result<Self, LearnError> {
        let rows: Vec<Vec<f64>> = rolls.iter().map(|r| Roll::inputs(&r.state, &r.action)).collect();
        let changes: Vec<State> =
            rolls.iter().map(|r| std::array::from_fn(|k| r.next[k] - r.state[k])).collect();
        Ok(Self { surface: Surface::learn(&rows, &changes, [DEGREE, REMAINDER])? })
    }

    fn terms(&self, state: &State, action: &Action) -> DVector<f64> {
        self.surface.terms(&Roll::inputs(state, action))
    }

    /// The next state.
    pub fn predict(&self, state: &State, action: &Action) -> [Prediction; 3] {
        let terms = self.terms(state, action);
        std::array::from_fn(|k| {
            let output = &self.surface.outputs[k];
            let spread = 1.0 + terms.dot(&output.precision.solve(&terms));
            Prediction {
                mean: state[k] + terms.dot(&output.coefficients),
                sigma: output.sigma * spread.sqrt(),
            }
        })
    }

    /// One sigma of the noise of each output, measured states included.
    pub fn noise(&self) -> [f64; 3] {
        std::array::from_fn(|k| self.surface.outputs[k].sigma)
    }

    /// Covariance of the errors of predictions of an output (0 to 2) at several rolls, in units of its noise's variance:
    /// what was not learned is common to all of them, noise is each one's own.
    pub fn covariance(&self, output: usize, rolls: &[(State, Action)]) -> DMatrix<f64> {
        let terms: Vec<DVector<f64>> = rolls.iter().map(|(s, a)| self.terms(s, a)).collect();
        let precision = &self.surface.outputs[output].precision;
        let mut told = DMatrix::from_columns(&terms);
        precision.l_dirty().solve_lower_triangular_mut(&mut told);
        told.tr_mul(&told) + DMatrix::identity(rolls.len(), rolls.len())
    }
}

/// The coefficients of one output; the first `free` columns have no prior.
fn learn_output(design: &DMatrix<f64>, free: usize, change: &DVector<f64>) -> Option<Output> {
    let rows = design.nrows();
    let polynomial = design.columns(0, free).into_owned();
    let qr = polynomial.qr();
    let basis = qr.q();
    let r = qr.r();
    let largest = r.diagonal().amax();
    if r.diagonal().iter().any(|d| d.abs() < 1e-10 * largest) {
        return None;
    }
    // What the polynomial leaves of the change and of the remainder's terms.
    let rest = design.columns(free, design.ncols() - free).into_owned();
    let rest = &rest - &basis * basis.tr_mul(&rest);
    let left = change - &basis * basis.tr_mul(change);
    let eigen = SymmetricEigen::new(rest.tr_mul(&rest));
    let pulled = eigen.eigenvectors.tr_mul(&rest.tr_mul(&left));
    let floor = 1e-10 * eigen.eigenvalues.amax();
    let parts: Vec<(f64, f64)> = eigen
        .eigenvalues
        .iter()
        .zip(pulled.iter())
        .filter(|(value, _)| **value > floor)
        .map(|(&value, pull)| (value, pull * pull / value))
        .collect();
    let evidence = Evidence { parts, total: left.norm_squared(), freedom: (rows - free) as f64 };
    let log_ratio = evidence.best();
    let sigma = evidence.variance(log_ratio).sqrt();
    let mut precision = design.tr_mul(design);
    for k in free..design.ncols() {
        precision[(k, k)] += (-log_ratio).exp();
    }
    let precision = precision.cholesky()?;
    let coefficients = precision.solve(&design.tr_mul(change));
    (sigma.is_finite() && coefficients.iter().all(|c| c.is_finite())).then_some(Output {
        coefficients,
        sigma: sigma.max(f64::MIN_POSITIVE),
        precision,
    })
}

/// Marginal likelihood of what the polynomial leaves.
#[derive(Clone)]
struct Evidence {
    /// Eigenvalue of the remainder's terms, and the square that lies along its direction.
    parts: Vec<(f64, f64)>,
    total: f64,
    freedom: f64,
}

/// Logarithm of the variance of a coefficient of the remainder over that of the noise.
const LOG_RATIO: [f64; 2] = [-25.0, 5.0];

impl Evidence {
    /// The noise's variance at a ratio, profiled.
    fn variance(&self, log_ratio: f64) -> f64 {
        let ratio = log_ratio.exp();
        let along: f64 = self.parts.iter().map(|(value, square)| square / (1.0 + ratio * value)).sum();
        let beside = self.total - self.parts.iter().map(|(_, square)| square).sum::<f64>();
        (along + beside.max(0.0)) / self.freedom
    }

    fn best(&self) -> f64 {
        let [low, high] = LOG_RATIO;
        let found =
            Executor::new(self.clone(), BrentOpt::new(low, high)).configure(|s| s.max_iters(200)).run();
        found.ok().and_then(|r| r.state().get_best_param().copied()).unwrap_or(low)
    }
}

impl CostFunction for Evidence {
    type Param = f64;
    type Output = f64;

    /// Minus twice the logarithm, up to a constant.
    fn cost(&self, log_ratio: &f64) -> Result<f64, Error> {
        let ratio = log_ratio.exp();
        let spread: f64 = self.parts.iter().map(|(value, _)| (ratio * value).ln_1p()).sum();
        Ok(self.freedom * self.variance(*log_ratio).max(f64::MIN_POSITIVE).ln() + spread)
    }
}
