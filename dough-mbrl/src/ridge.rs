//! The dynamics of [Matl 2021]: ridge regression on polynomial features, refitted roll by roll.
//!
//! Rolls go into sums (normal equations) as they come, so that a refit costs the same however many rolls there were, and equals the
//! fit to all of them at once. The sums are of 21 terms for degree 2: nalgebra's Cholesky factor of them takes microseconds.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::predictor::{LearnError, Prediction, Predictor, Refit, enough, finite, nearest_m, row};
use crate::roll::{Action, Roll, State};

/// Inputs: state and action.
const INPUTS: usize = 5;
/// Highest degree: 1287 terms.
pub const MOST_DEGREE: u8 = 8;

/// A term of the polynomial in an order in which each one is its parent times one input.
#[derive(Debug, Clone, Copy)]
struct Term {
    degree: usize,
    input: usize,
}

/// Ridge regression of the change on all monomials up to a degree.
#[derive(Debug, Clone)]
pub struct Ridge {
    degree: u8,
    ridge: f64,
    mean: [f64; INPUTS],
    per_scale: [f64; INPUTS],
    terms: Vec<Term>,
    coefficients: Vec<[f64; 3]>,
    /// Sums of w f f', w^2 f f', w f y, w y^2, w; number of rolls.
    gram: DMatrix<f64>,
    spread: DMatrix<f64>,
    moment: DMatrix<f64>,
    squares: [f64; 3],
    weight: f64,
    rolls: usize,
    states: Vec<State>,
    factor: Cholesky<f64, Dyn>,
    sigma: [f64; 3],
}

/// Monomials by depth first: the constant, x0, x0 x0, .., x0 x1, ..
fn terms(degree: u8) -> Vec<Term> {
    fn below(terms: &mut Vec<Term>, degree: usize, input: usize, most: usize) {
        terms.push(Term { degree, input });
        if degree < most {
            (input..INPUTS).for_each(|k| below(terms, degree + 1, k, most));
        }
    }
    let mut terms = Vec::new();
    below(&mut terms, 0, 0, usize::from(degree));
    terms
}

impl Ridge {
    /// Learns from rolls, all of weight 1. `ridge` is what a standardised coefficient's square costs, in units of the noise's variance
    /// (1e-6: next to nothing); the constant is free.
    ///
    /// # Errors
    /// [`LearnError::TooFew`] for fewer rolls than unknowns; [`LearnError::Undetermined`] for values that are no numbers, rolls
    /// that are too much alike, or a degree above [`MOST_DEGREE`].
    pub fn learn(rolls: &[Roll], degree: u8, ridge: f64) -> Result<Self, LearnError> {
        if degree > MOST_DEGREE || !(ridge >= 0.0 && ridge.is_finite()) {
            return Err(LearnError::Undetermined { degree });
        }
        let terms = terms(degree);
        let p = terms.len();
        enough(rolls, p, degree)?;
        let (mean, per_scale) = standards(rolls);
        let mut learned = Self {
            degree,
            ridge,
            mean,
            per_scale,
            terms,
            coefficients: vec![[0.0; 3]; p],
            gram: DMatrix::zeros(p, p),
            spread: DMatrix::zeros(p, p),
            moment: DMatrix::zeros(p, 3),
            squares: [0.0; 3],
            weight: 0.0,
            rolls: 0,
            states: Vec::with_capacity(2 * rolls.len()),
            factor: Cholesky::pack_dirty(DMatrix::identity(p, p)),
            sigma: [0.0; 3],
        };
        rolls.iter().try_for_each(|roll| learned.add(roll, 1.0))?;
        learned.refit()?;
        Ok(learned)
    }

    /// Number of coefficients of each dimension.
    pub fn coefficients(&self) -> usize {
        self.terms.len()
    }

    /// Sigma of what the polynomial leaves, by dimension, m.
    pub fn sigma_m(&self) -> [f64; 3] {
        self.sigma
    }

    /// Hands each term's value to a function, in order; allocates nothing.
    #[inline]
    fn each(&self, state: &State, action: &Action, mut f: impl FnMut(usize, f64)) {
        let x = row(state, action);
        let z: [f64; INPUTS] = std::array::from_fn(|k| (x[k] - self.mean[k]) * self.per_scale[k]);
        let mut product = [1.0; MOST_DEGREE as usize + 1];
        for (k, term) in self.terms.iter().enumerate() {
            // The constant is its own parent.
            let value = if term.degree == 0 { 1.0 } else { product[term.degree - 1] * z[term.input] };
            product[term.degree] = value;
            f(k, value);
        }
    }

    fn features(&self, state: &State, action: &Action) -> DVector<f64> {
        let mut features = DVector::zeros(self.terms.len());
        self.each(state, action, |k, v| features[k] = v);
        features
    }
}

/// Mean of each input, and one over its spread.
pub(crate) fn standards(rolls: &[Roll]) -> ([f64; INPUTS], [f64; INPUTS]) {
    let n = rolls.len().max(1) as f64;
    let rows = || rolls.iter().map(|r| row(&r.state, &r.action));
    let mean: [f64; INPUTS] = std::array::from_fn(|k| rows().map(|x| x[k]).sum::<f64>() / n);
    let per_scale = std::array::from_fn(|k| {
        let sigma = (rows().map(|x| (x[k] - mean[k]).powi(2)).sum::<f64>() / n).sqrt();
        if sigma > 1e-9 { 1.0 / sigma } else { 1.0 }
    });
    (mean, per_scale)
}

impl Predictor for Ridge {
    fn next(&self, state: &State, action: &Action) -> State {
        let mut next = *state;
        self.each(state, action, |k, v| {
            let c = &self.coefficients[k];
            (0..3).for_each(|d| next[d] += v * c[d]);
        });
        next
    }

    /// Noise and coefficients both count; weights make no rolls that were not rolled (sandwich estimator, White 1980,
    /// doi:10.2307/1912934).
    fn predict(&self, state: &State, action: &Action) -> [Prediction; 3] {
        let solved = self.factor.solve(&self.features(state, action));
        let unsure = solved.dot(&(&self.spread * &solved));
        let next = self.next(state, action);
        std::array::from_fn(|k| Prediction { mean: next[k], sigma: self.sigma[k] * (1.0 + unsure).sqrt() })
    }
}

impl Refit for Ridge {
    fn add(&mut self, roll: &Roll, weight: f64) -> Result<(), LearnError> {
        if !(finite(roll) && weight > 0.0 && weight.is_finite()) {
            return Err(LearnError::Undetermined { degree: self.degree });
        }
        let features = self.features(&roll.state, &roll.action);
        self.gram.ger(weight, &features, &features, 1.0);
        self.spread.ger(weight * weight, &features, &features, 1.0);
        for k in 0..3 {
            let change = roll.next[k] - roll.state[k];
            self.moment.column_mut(k).axpy(weight * change, &features, 1.0);
            self.squares[k] += weight * change * change;
        }
        self.weight += weight;
        self.rolls += 1;
        self.states.push(roll.state);
        Ok(())
    }

    fn refit(&mut self) -> Result<(), LearnError> {
        let mut normal = self.gram.clone();
        (1..normal.nrows()).for_each(|k| normal[(k, k)] += self.ridge);
        let undetermined = LearnError::Undetermined { degree: self.degree };
        let largest = normal.diagonal().amax();
        let factor = normal.cholesky().ok_or(undetermined.clone())?;
        if factor.l_dirty().diagonal().iter().any(|d| !(d * d > 1e-14 * largest)) {
            return Err(undetermined);
        }
        let solution = factor.solve(&self.moment);
        let n = self.rolls as f64;
        // Rolls beyond the unknowns tell the noise; with none to spare it is as unsure as one.
        let spare = (n - self.terms.len() as f64).max(1.0);
        self.sigma = std::array::from_fn(|k| {
            let c = solution.column(k);
            let left = self.squares[k] - 2.0 * c.dot(&self.moment.column(k)) + c.dot(&(&self.gram * c));
            (left.max(0.0) / self.weight * n / spare).sqrt()
        });
        for (k, c) in self.coefficients.iter_mut().enumerate() {
            *c = std::array::from_fn(|d| solution[(k, d)]);
        }
        self.factor = factor;
        Ok(())
    }

    fn distance_m(&self, state: &State) -> f64 {
        nearest_m(&self.states, state)
    }
}
