//! Dynamics of a dough, learned from rolls, with the uncertainty of what was learned.
//!
//! Relative changes are a polynomial of degree 2 of a dough's shape, its size and the action, and a remainder of degrees 3 and 4; the
//! prior variance of each degree's coefficients is learned with them. The coefficients are those that make the innovations of all
//! doughs most likely.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Vector3};

use crate::filter::{Noise, Step};
use crate::learning::{Learned, learn};
use crate::nuisance::{NUISANCES, NuisanceVariances};
use crate::predictor::{LearnError, Prediction, Predictor};
use crate::roll::{Action, Roll, State};
use crate::sensitivity::sensitivity;
use crate::surface::Surface;

/// Prior sigma of the part by which a roll does more or less than its dynamics.
const SCATTER: f64 = 0.01;

/// Learned dynamics.
#[derive(Debug, Clone)]
pub struct Dynamics {
    surface: Surface,
    noise: Noise,
    nuisance: NuisanceVariances,
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
        let surface = Surface::least_squares(&rolls)?;
        let measured = repeat_variance(doughs, &surface.residual_variance);
        let noise = Noise { measured, process: 0.1 * measured[1], scatter: SCATTER.powi(2) };
        let Learned { surface, noise, nuisance, precision } = learn(doughs, surface, noise)?;
        Ok(Self { surface, noise, nuisance, precision })
    }

    /// The change of a state by a roll.
    pub fn change(&self, state: &Vector3<f64>, action: &Action) -> Vector3<f64> {
        self.surface.change(state, action)
    }

    /// Noise of the measured states.
    pub fn noise(&self) -> &Noise {
        &self.noise
    }

    /// Variances of the nuisance parameters, from dough to dough.
    pub fn nuisance(&self) -> &NuisanceVariances {
        &self.nuisance
    }

    /// Sensitivity of a dough's innovations ([`whitened`](crate::sensitivity::whitened)) to what was not learned: one column for each
    /// independent direction of variance one. The first ones are common to all doughs, the last [`NUISANCES`] are this dough's.
    ///
    /// `response` is the part of each roll's change that takes place.
    pub fn unlearned(&self, steps: &[Step], rolls: &[Roll], response: impl Fn(usize) -> f64) -> DMatrix<f64> {
        let p = self.surface.terms_of_each();
        let all = sensitivity(steps, |i| self.surface.slopes(&steps[i].state, &rolls[i].action), response, p);
        let mut turned = all.transpose();
        self.precision.l_dirty().solve_lower_triangular_mut(&mut turned.rows_mut(0, 3 * p));
        for k in 0..NUISANCES {
            turned.row_mut(3 * p + k).scale_mut(self.nuisance.of(k).sqrt());
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
            let mut terms_of_k = DVector::zeros(3 * p);
            terms_of_k.rows_mut(k * p, p).copy_from(&(unit_m[k] * &terms));
            self.precision.l_dirty().solve_lower_triangular_mut(&mut terms_of_k);
            let scatter = self.noise.scatter * change[k] * change[k];
            let variance =
                terms_of_k.norm_squared() + self.noise.process[k] + scatter + self.noise.measured[1][k];
            Prediction { mean: state[k] + change[k], sigma: variance.sqrt() }
        })
    }
}

/// Variances of measurements, from states that were measured twice; from the residuals of the dynamics where none was.
fn repeat_variance(doughs: &[Vec<Roll>], residual_variance: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let pairs: Vec<Vector3<f64>> = doughs
        .iter()
        .flat_map(|d| d.windows(2))
        .map(|w| Vector3::from(w[1].state) - Vector3::from(w[0].next))
        .collect();
    let variance = if pairs.len() < 8 {
        *residual_variance
    } else {
        pairs.iter().map(|d| d.component_mul(d)).sum::<Vector3<f64>>() / pairs.len() as f64
    };
    // Half each; never nothing, lest a filter believe a number to its last digit.
    [variance.map(|v| (0.5 * v).max(1e-14)); 2]
}

impl Predictor for Dynamics {
    fn next(&self, state: &State, action: &Action) -> State {
        let change = self.change(&nalgebra::Vector3::from(*state), action);
        std::array::from_fn(|k| state[k] + change[k])
    }

    fn predict(&self, state: &State, action: &Action) -> [Prediction; 3] {
        Dynamics::predict(self, state, action)
    }
}
