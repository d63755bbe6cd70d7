//! Dynamics of a dough, learned from rolls, with the uncertainty of what was learned.
//!
//! Relative changes are a polynomial of degree 2 of a dough's shape, its size and the action, and a remainder of degrees 3 and 4; how
//! large the coefficients of each degree are is said by the rolls themselves. The coefficients are those that make the innovations of all
//! doughs most likely.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Vector3};

use crate::filter::{Noise, Step};
use crate::learning::{Learned, learn};
use crate::sensitivity::{COURSES, OWN, sensitivity};
use crate::surface::Surface;

/// Length, width and height of a dough, m.
pub type State = [f64; 3];
/// Throw and depth of the band, m.
pub type Action = [f64; 2];

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
        let all = sensitivity(steps, |i| self.surface.slopes(&steps[i].state, &rolls[i].action), response, p);
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
        let change = self.change(&state, action);
        let (terms, unit_m) = self.surface.slopes(&state, action);
        let p = terms.len();
        std::array::from_fn(|k| {
            let mut told = DVector::zeros(3 * p);
            told.rows_mut(k * p, p).copy_from(&(unit_m[k] * &terms));
            self.precision.l_dirty().solve_lower_triangular_mut(&mut told);
            let scatter = self.noise.scatter * change[k] * change[k];
            let variance = told.norm_squared() + self.noise.process[k] + scatter + self.noise.measured[1][k];
            Prediction { mean: state[k] + change[k], sigma: variance.sqrt() }
        })
    }
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
