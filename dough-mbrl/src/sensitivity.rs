//! By how much the innovations of a dough that is followed answer what its dynamics are made of.

use nalgebra::{Const, DMatrix, DVector, Dyn, Matrix3, OMatrix, Vector3};

use crate::filter::Step;

/// Innovations of a roll: three of the measurement after it, then three of the one before it.
pub const PER_ROLL: usize = 6;
/// Courses of a dough of its own: a level, and half a cosine, a whole one, one and a half along its rolls.
pub const COURSES: usize = 4;
/// What a dough may do for itself: a course of each dimension's change, and (the last) a part of every change, as softer dough does.
pub const OWN: usize = 3 * COURSES + 1;

/// The innovations of a dough, standardised: independent and of variance one where dynamics and noise are right.
pub fn white(steps: &[Step]) -> DVector<f64> {
    let rolls = steps.iter().flat_map(|s| [s.after.white(), s.before.white()]);
    DVector::from_iterator(PER_ROLL * steps.len(), rolls.flat_map(|w| [w[0], w[1], w[2]]))
}

/// How unlikely the innovations of a dough are: the two parts of minus twice the logarithm of their likelihood, but for a constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surprise {
    /// Logarithm of the determinant of their covariance.
    pub spread: f64,
    /// Sum of squares of [`white`].
    pub square: f64,
}

/// How unlikely innovations are.
pub fn surprise(steps: &[Step]) -> Surprise {
    let mut all = Surprise { spread: 0.0, square: 0.0 };
    for innovation in steps.iter().flat_map(|s| [&s.before, &s.after]) {
        all.spread += 2.0 * innovation.factor.diagonal().map(f64::ln).sum();
        all.square += innovation.white().norm_squared();
    }
    all
}

/// Derivatives of [`white`]: with respect to the coefficients of each dimension's change, one dimension after the other, and (the last
/// [`OWN`] columns) to what the dough does for itself.
///
/// `terms(i)` are what the coefficients of roll `i`'s change multiply, and what that counts for in each dimension (m); `response(i)` is
/// what of the change takes place.
pub fn sensitivity(
    steps: &[Step],
    terms: impl Fn(usize) -> (DVector<f64>, Vector3<f64>),
    response: impl Fn(usize) -> f64,
    coefficients: usize,
) -> DMatrix<f64> {
    let p = coefficients;
    let columns = 3 * p + OWN;
    let courses = courses(steps.len());
    let mut all = DMatrix::zeros(PER_ROLL * steps.len(), columns);
    // Of the predicted state.
    let mut moved = OMatrix::<f64, Const<3>, Dyn>::zeros(columns);
    for (i, step) in steps.iter().enumerate() {
        let row = PER_ROLL * i;
        write(&mut all, row + 3, &step.before.factor, &moved);
        moved -= step.before.gain * &moved;
        let mut state = moved.clone();
        moved = step.gradient * &moved;
        let ((terms, unit_m), response) = (terms(i), response(i));
        for k in 0..3 {
            for (j, term) in terms.iter().enumerate() {
                moved[(k, k * p + j)] += response * unit_m[k] * term;
            }
            for (c, course) in courses.iter().enumerate() {
                moved[(k, 3 * p + 3 * c + k)] += response * course[i];
            }
            if !courses.is_empty() {
                moved[(k, columns - 1)] += step.change[k];
            }
        }
        write(&mut all, row, &step.after.factor, &moved);
        state -= step.back * &moved;
        moved -= step.after.gain * &moved;
        moved = step.shares[0] * moved + step.shares[1] * state;
    }
    all
}

fn write(all: &mut DMatrix<f64>, row: usize, factor: &Matrix3<f64>, moved: &OMatrix<f64, Const<3>, Dyn>) {
    let mut white = -moved.clone();
    factor.solve_lower_triangular_mut(&mut white);
    all.view_mut((row, 0), (3, moved.ncols())).copy_from(&white);
}

/// What a dough may do for itself along its rolls, each of unit mean square: at most [`COURSES`], one for every five rolls and one
/// more; of a single roll nothing.
pub fn courses(rolls: usize) -> Vec<DVector<f64>> {
    let count = if rolls < 2 { 0 } else { (1 + rolls / 5).min(COURSES) };
    let course = |k: usize| {
        let phase = |i: usize| std::f64::consts::PI * k as f64 * (i as f64 + 0.5) / rolls as f64;
        let size = if k == 0 { 1.0 } else { std::f64::consts::SQRT_2 };
        DVector::from_fn(rolls, |i, _| size * phase(i).cos())
    };
    (0..count).map(course).collect()
}
