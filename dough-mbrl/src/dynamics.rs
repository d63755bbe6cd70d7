//! Dynamics of a dough, learned from rolls, with the uncertainty of what was learned.
//!
//! A polynomial of degree 2, and a remainder of degrees 3 and 4; the size of each degree's coefficients is said by the rolls themselves.
//! The coefficients are those that make the innovations of all doughs most likely.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Vector3};

use crate::features::Polynomial;
use crate::filter::{Noise, Step};
use crate::learning::{Learned, learn};
use crate::sensitivity::{COURSES, OWN, sensitivity};

/// Length, width and height of a dough, m.
pub type State = [f64; 3];
/// Throw and depth of the band, m.
pub type Action = [f64; 2];

/// Degree of the polynomial, and of its remainder.
const DEGREE: u8 = 2;
const REMAINDER: u8 = 4;
/// By which part a roll is held to do more or less before anything is learned.
const SCATTER: f64 = 0.01;

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

/// The change of a state by a roll: a polynomial of state and action for each dimension.
#[derive(Debug, Clone)]
pub(crate) struct Surface {
    features: Polynomial,
    /// Scale of each term, so that each is of unit mean square over the rolls that were learned from.
    weights: DVector<f64>,
    coefficients: DMatrix<f64>,
    /// Mean square of what the polynomial without its remainder leaves, by dimension, m^2.
    pub(crate) left: Vector3<f64>,
}

impl Surface {
    /// Least squares on measured states, without a remainder: where learning begins.
    fn measured(rolls: &[&Roll]) -> Result<Self, LearnError> {
        let rows: Vec<Vec<f64>> = rolls.iter().map(|r| inputs(&Vector3::from(r.state), &r.action)).collect();
        let features = Polynomial::standardised(&rows, REMAINDER);
        let free = features.up_to(DEGREE);
        let least = 2 * free;
        if rows.len() < least {
            return Err(LearnError::TooFew { rolls: rows.len(), coefficients: free, least });
        }
        let n = rows.len();
        let mut design =
            DMatrix::from_row_iterator(n, features.len(), rows.iter().flat_map(|r| features.terms(r)));
        let change = DMatrix::from_fn(n, 3, |i, k| rolls[i].next[k] - rolls[i].state[k]);
        if design.iter().chain(change.iter()).any(|v| !v.is_finite()) {
            return Err(Self::undetermined());
        }
        let weights = DVector::from_fn(features.len(), |k, _| {
            let rms = (design.column(k).norm_squared() / n as f64).sqrt();
            if rms > 0.0 { 1.0 / rms } else { 1.0 }
        });
        design.column_iter_mut().zip(weights.iter()).for_each(|(mut c, w)| c *= *w);
        let polynomial = design.columns(0, free).into_owned();
        let qr = polynomial.clone().qr();
        let r = qr.r();
        let largest = r.diagonal().amax();
        if r.diagonal().iter().any(|d| !(d.abs() > 1e-10 * largest)) {
            return Err(Self::undetermined());
        }
        let found = r.solve_upper_triangular(&qr.q().tr_mul(&change)).ok_or_else(Self::undetermined)?;
        let rest = change - polynomial * &found;
        let left = Vector3::from_fn(|k, _| (rest.column(k).norm_squared() / (n - free) as f64).max(1e-16));
        let mut coefficients = DMatrix::zeros(features.len(), 3);
        coefficients.rows_mut(0, free).copy_from(&found);
        Ok(Self { features, weights, coefficients, left })
    }

    pub(crate) fn undetermined() -> LearnError {
        LearnError::Undetermined { degree: DEGREE }
    }

    pub(crate) fn change(&self, state: &Vector3<f64>, action: &Action) -> Vector3<f64> {
        let change = self.coefficients.tr_mul(&self.terms(state, action));
        Vector3::new(change[0], change[1], change[2])
    }

    pub(crate) fn terms(&self, state: &Vector3<f64>, action: &Action) -> DVector<f64> {
        DVector::from_vec(self.features.terms(&inputs(state, action))).component_mul(&self.weights)
    }

    /// Number of coefficients of each dimension.
    pub(crate) fn terms_of_each(&self) -> usize {
        self.weights.len()
    }

    /// Where the terms of each degree from 1 are.
    pub(crate) fn degrees(&self) -> Vec<std::ops::Range<usize>> {
        (0..REMAINDER).map(|d| self.features.up_to(d)..self.features.up_to(d + 1)).collect()
    }

    /// All coefficients, one dimension after the other.
    pub(crate) fn flat(&self) -> DVector<f64> {
        DVector::from_column_slice(self.coefficients.as_slice())
    }

    pub(crate) fn set(&mut self, flat: &DVector<f64>) {
        self.coefficients.copy_from_slice(flat.as_slice());
    }
}

/// Variances of what each dough does for itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Own {
    /// Of each course ([`courses`](crate::sensitivity::courses)) along its rolls, by dimension, m^2.
    pub courses: Vector3<f64>,
    /// Of the part by which all its rolls do more or less.
    pub softness: f64,
}

impl Own {
    /// Of one of the [`OWN`] columns.
    pub(crate) fn of(&self, column: usize) -> f64 {
        if column < 3 * COURSES { self.courses[column % 3] } else { self.softness }
    }
}

/// Learned dynamics.
#[derive(Debug, Clone)]
pub struct Dynamics {
    surface: Surface,
    noise: Noise,
    own: Own,
    precision: Cholesky<f64, Dyn>,
}

impl Dynamics {
    /// Learns from the rolls of several doughs, each in its order.
    ///
    /// Measured states are noisy, and a regression on noisy states learns something else than the dynamics (Fuller 1987,
    /// doi:10.1002/9780470316665). Each dough is therefore followed through its rolls by a Kalman filter, and the dynamics
    /// are those whose innovations are most likely.
    ///
    /// # Errors
    /// [`LearnError`].
    pub fn learn(doughs: &[Vec<Roll>]) -> Result<Self, LearnError> {
        let rolls: Vec<&Roll> = doughs.iter().flatten().collect();
        let surface = Surface::measured(&rolls)?;
        let measured = twice_measured(doughs, &surface.left);
        let noise = Noise { measured, process: 0.1 * measured[1], scatter: SCATTER.powi(2) };
        let Learned { surface, noise, own, precision } = learn(doughs, surface, noise)?;
        Ok(Self { surface, noise, own, precision })
    }

    /// The change of a state by a roll.
    pub fn change(&self, state: &Vector3<f64>, action: &Action) -> Vector3<f64> {
        self.surface.change(state, action)
    }

    /// What scatters the measured states.
    pub fn noise(&self) -> &Noise {
        &self.noise
    }

    /// What each dough does for itself.
    pub fn own(&self) -> &Own {
        &self.own
    }

    /// By how much the innovations of a dough ([`white`](crate::sensitivity::white)) answer what was not learned: directions
    /// that are independent and of variance one. The first ones are common to all doughs, the last [`OWN`] this dough's.
    ///
    /// `response` is what of each roll's change takes place.
    pub fn unlearned(&self, steps: &[Step], rolls: &[Roll], response: impl Fn(usize) -> f64) -> DMatrix<f64> {
        let p = self.surface.terms_of_each();
        let terms = |i: usize| self.surface.terms(&steps[i].state, &rolls[i].action);
        let all = sensitivity(steps, terms, response, p);
        let mut turned = all.transpose();
        self.precision.l_dirty().solve_lower_triangular_mut(&mut turned.rows_mut(0, 3 * p));
        for k in 0..OWN {
            turned.row_mut(3 * p + k).scale_mut(self.own.of(k).sqrt());
        }
        turned.transpose()
    }

    /// The next state, from a state that is known.
    pub fn predict(&self, state: &State, action: &Action) -> [Prediction; 3] {
        let state = Vector3::from(*state);
        let (change, terms) = (self.change(&state, action), self.surface.terms(&state, action));
        let p = terms.len();
        std::array::from_fn(|k| {
            let mut told = DVector::zeros(3 * p);
            told.rows_mut(k * p, p).copy_from(&terms);
            self.precision.l_dirty().solve_lower_triangular_mut(&mut told);
            let scatter = self.noise.scatter * change[k] * change[k];
            let variance = told.norm_squared() + self.noise.process[k] + scatter + self.noise.measured[1][k];
            Prediction { mean: state[k] + change[k], sigma: variance.sqrt() }
        })
    }
}

fn inputs(state: &Vector3<f64>, action: &Action) -> Vec<f64> {
    state.iter().chain(action).copied().collect()
}

/// Variances of measurements, from states that were measured twice; from what the dynamics leave where none was.
fn twice_measured(doughs: &[Vec<Roll>], left: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let pairs: Vec<Vector3<f64>> = doughs
        .iter()
        .flat_map(|d| d.windows(2))
        .map(|w| Vector3::from(w[1].state) - Vector3::from(w[0].next))
        .collect();
    let variance = if pairs.len() < 8 {
        *left
    } else {
        pairs.iter().map(|d| d.component_mul(d)).sum::<Vector3<f64>>() / pairs.len() as f64
    };
    // Half each; never nothing, lest a filter believe a number to its last digit.
    [variance.map(|v| (0.5 * v).max(1e-14)); 2]
}
