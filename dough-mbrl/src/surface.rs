//! What a roll does: the relative change of each dimension, a polynomial of the dough's shape, its size and the action.
//!
//! A dough keeps its volume while it is rolled, so that of its three dimensions only shapes are learned: how what is smaller, or larger,
//! answers is known from a few doughs that differ by a few hundredths. Written with relative changes, a shape that is learned is learned
//! for all sizes, and what size does beyond that counts as not known.

use nalgebra::{DMatrix, DVector, Vector3};

use crate::features::Polynomial;
use crate::predictor::LearnError;
use crate::roll::{Action, Roll};

/// Degree of the polynomial, and of its remainder.
const DEGREE: u8 = 2;
const REMAINDER: u8 = 4;
/// Dimensions below this are none, m.
const LEAST_M: f64 = 1e-4;
/// Where the size is among the variables.
const SIZE: usize = 2;

/// Shape and size of a dough, all logarithms of lengths.
#[derive(Debug, Clone, Copy)]
struct Body {
    /// Length over the mean of width and height.
    long: f64,
    /// Width over height.
    oval: f64,
    /// Cube root of the product of all three.
    size: f64,
}

impl Body {
    fn of(state: &Vector3<f64>) -> Self {
        let [l, w, h] = [0, 1, 2].map(|k| state[k].max(LEAST_M).ln());
        Self { long: l - 0.5 * (w + h), oval: w - h, size: (l + w + h) / 3.0 }
    }
}

/// The change of a state by a roll: a response surface.
#[derive(Debug, Clone)]
pub(crate) struct Surface {
    features: Polynomial,
    /// How the size of a dough of constant volume goes with how long it is: a parabola, as its ends are round.
    usual: [f64; 3],
    /// Mean state, m.
    mean_m: Vector3<f64>,
    /// Scale of each term, so that each is of unit mean square over the rolls that were learned from.
    weights: DVector<f64>,
    coefficients: DMatrix<f64>,
    /// Variance of the residuals of the polynomial without its remainder, by dimension, m^2.
    pub(crate) residual_variance: Vector3<f64>,
}

impl Surface {
    /// Least squares on measured states, without a remainder and without the size: where learning begins.
    pub(crate) fn least_squares(rolls: &[&Roll]) -> Result<Self, LearnError> {
        let n = rolls.len();
        let states: Vec<Vector3<f64>> = rolls.iter().map(|r| Vector3::from(r.state)).collect();
        let mean_m = states.iter().sum::<Vector3<f64>>() / n.max(1) as f64;
        let usual = usual_size(&states).unwrap_or_default();
        let rows: Vec<Vec<f64>> =
            rolls.iter().zip(&states).map(|(r, s)| inputs(s, &r.action, &usual)).collect();
        let mut features = Polynomial::standardised(&rows, REMAINDER);
        // A size is as much as the same ratio of lengths.
        features.scale_as(SIZE, 0);
        let free = features.up_to(DEGREE);
        if n < 2 * free {
            return Err(LearnError::TooFew { rolls: n, coefficients: free, least: 2 * free });
        }
        let weights = weights(&features, &rows);
        let sizeless: Vec<usize> = (0..free).filter(|&term| features.power(term, SIZE) == 0).collect();
        let terms: Vec<Vec<f64>> = rows.iter().map(|r| features.terms(r)).collect();
        let design = DMatrix::from_fn(n, sizeless.len(), |i, j| terms[i][sizeless[j]] * weights[sizeless[j]]);
        let change = DMatrix::from_fn(n, 3, |i, k| (rolls[i].next[k] / rolls[i].state[k] - 1.0) * mean_m[k]);
        if design.iter().chain(change.iter()).any(|v| !v.is_finite()) {
            return Err(Self::undetermined());
        }
        let qr = design.clone().qr();
        let r = qr.r();
        let largest = r.diagonal().amax();
        if r.diagonal().iter().any(|d| !(d.abs() > 1e-10 * largest)) {
            return Err(Self::undetermined());
        }
        let found = r.solve_upper_triangular(&qr.q().tr_mul(&change)).ok_or_else(Self::undetermined)?;
        let rest = change - design * &found;
        let residual_variance =
            Vector3::from_fn(|k, _| (rest.column(k).norm_squared() / (n - free) as f64).max(1e-16));
        let mut coefficients = DMatrix::zeros(features.len(), 3);
        for (j, &term) in sizeless.iter().enumerate() {
            coefficients.row_mut(term).copy_from(&found.row(j));
        }
        Ok(Self { features, usual, mean_m, weights, coefficients, residual_variance })
    }

    pub(crate) fn undetermined() -> LearnError {
        LearnError::Undetermined { degree: DEGREE }
    }

    pub(crate) fn change(&self, state: &Vector3<f64>, action: &Action) -> Vector3<f64> {
        let (terms, unit_m) = self.slopes(state, action);
        let change = self.coefficients.tr_mul(&terms);
        Vector3::new(change[0], change[1], change[2]).component_mul(&unit_m)
    }

    /// By how much the change answers coefficients: their terms, and what these count for in each dimension.
    pub(crate) fn slopes(&self, state: &Vector3<f64>, action: &Action) -> (DVector<f64>, Vector3<f64>) {
        let terms = self.features.terms(&inputs(state, action, &self.usual));
        (DVector::from_vec(terms).component_mul(&self.weights), state.component_div(&self.mean_m))
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

fn inputs(state: &Vector3<f64>, action: &Action, usual: &[f64; 3]) -> Vec<f64> {
    let Body { long, oval, size } = Body::of(state);
    let [a, b, c] = usual;
    vec![long, oval, size - (a + (b + c * long) * long), action[0], action[1]]
}

/// The parabola on which the sizes of some doughs lie, over how long they are; none where they are all alike.
fn usual_size(states: &[Vector3<f64>]) -> Option<[f64; 3]> {
    let bodies: Vec<Body> = states.iter().map(Body::of).collect();
    let design = DMatrix::from_fn(bodies.len(), 3, |i, j| bodies[i].long.powi(j as i32));
    let sizes = DVector::from_fn(bodies.len(), |i, _| bodies[i].size);
    let found = (design.tr_mul(&design)).cholesky()?.solve(&design.tr_mul(&sizes));
    found.iter().all(|v| v.is_finite()).then(|| [found[0], found[1], found[2]])
}

/// One over the root mean square of each term, over rolls of doughs that are all off in size by its scale: their own sizes hardly differ.
fn weights(features: &Polynomial, rows: &[Vec<f64>]) -> DVector<f64> {
    let mut squares = DVector::<f64>::zeros(features.len());
    for row in rows {
        let mut row = row.clone();
        row[SIZE] = features.one_off(SIZE);
        squares.iter_mut().zip(features.terms(&row)).for_each(|(s, term)| *s += term * term);
    }
    squares.map(|s| if s > 0.0 { (rows.len() as f64 / s).sqrt() } else { 1.0 })
}
