//! One step of the bounded Gauss-Newton fit: every run's nuisance parameters eliminated, those that push against a bound held there.

use nalgebra::DMatrix;

use crate::fit::gauss_newton::NuisanceErrors;
use crate::linalg::{RANK_FLOOR, back_substitute, backward, cholesky, dot, forward, log_determinant};
use crate::problem::{Problem, Selection};

/// The normal equations at a point.
pub(crate) struct NormalEquations {
    /// Of each run: free nuisance parameters first, then free shared ones, then the residual.
    pub(crate) normals: Vec<DMatrix<f64>>,
    /// Sum of squares, the nuisance parameters' prior included.
    pub(crate) chi2: f64,
}

/// A run's nuisance parameters eliminated from its normal equations.
pub(crate) struct Eliminated {
    factor: DMatrix<f64>,
    kept: Vec<bool>,
    /// Forward-solved columns: nuisance by (shared and residual).
    border: Vec<Vec<f64>>,
    pub(crate) log_determinant: f64,
}

impl Eliminated {
    /// `held` nuisance parameters do not move.
    pub(crate) fn new(normal: &DMatrix<f64>, held: &[bool], damping: f64) -> Self {
        let (nuisance, total) = (held.len(), normal.nrows());
        let mut factor = normal.view((0, 0), (nuisance, nuisance)).into_owned();
        for (i, held) in held.iter().enumerate() {
            factor[(i, i)] *= 1.0 + damping;
            if *held {
                factor.row_mut(i).fill(0.0);
                factor.column_mut(i).fill(0.0);
            }
        }
        let kept = cholesky(&mut factor, RANK_FLOOR);
        let border = (nuisance..total)
            .map(|j| {
                let mut column: Vec<f64> = held
                    .iter()
                    .enumerate()
                    .map(|(i, held)| if *held { 0.0 } else { normal[(i, j)] })
                    .collect();
                forward(&factor, &kept, &mut column);
                column
            })
            .collect();
        let log_determinant = log_determinant(&factor, &kept);
        Self { factor, kept, border, log_determinant }
    }

    /// How well the run tells its nuisance parameters.
    pub(crate) fn nuisance_errors(&self, n_shared: usize) -> NuisanceErrors {
        let n = self.kept.len();
        let error = (0..n)
            .map(|i| {
                let mut unit = vec![0.0; n];
                unit[i] = 1.0;
                forward(&self.factor, &self.kept, &mut unit);
                if self.kept[i] { dot(&unit, &unit).sqrt() } else { f64::INFINITY }
            })
            .collect();
        let mut slope = vec![vec![0.0; n_shared]; n];
        for (j, border) in self.border.iter().take(n_shared).enumerate() {
            let mut column = border.clone();
            backward(&self.factor, &self.kept, &mut column);
            slope.iter_mut().zip(column).for_each(|(row, value)| row[j] = -value);
        }
        NuisanceErrors { error, slope }
    }

    /// By how much the run's nuisance parameters move with a step of the shared ones.
    fn moved(&self, shared_step: &[f64]) -> Vec<f64> {
        let right = self.border[shared_step.len()].clone();
        back_substitute(&self.factor, &self.kept, &self.border, right, shared_step)
    }
}

/// Schur complement over all runs: information of the shared parameters and their gradient.
pub(crate) fn reduce(
    linear: &NormalEquations,
    eliminated: &[Eliminated],
    nuisance: usize,
    shared: usize,
) -> (DMatrix<f64>, Vec<f64>) {
    let mut information = DMatrix::zeros(shared, shared);
    let mut gradient = vec![0.0; shared];
    for (gram, e) in linear.normals.iter().zip(eliminated) {
        for i in 0..shared {
            for j in 0..=i {
                information[(i, j)] += gram[(nuisance + i, nuisance + j)] - dot(&e.border[i], &e.border[j]);
            }
            gradient[i] += gram[(nuisance + i, nuisance + shared)] - dot(&e.border[i], &e.border[shared]);
        }
    }
    for i in 0..shared {
        for j in 0..i {
            information[(j, i)] = information[(i, j)];
        }
    }
    (information, gradient)
}

/// Where the next step leads.
pub(crate) struct Step {
    pub(crate) shared: Vec<f64>,
    pub(crate) nuisance: Vec<Vec<f64>>,
    /// By how much the linearised sum of squares falls.
    pub(crate) predicted: f64,
    /// The free shared parameters that are held at a bound.
    pub(crate) held: Vec<bool>,
}

impl Step {
    /// From the point (`shared`, `nuisance`) at which the normal equations were made.
    pub(crate) fn new(
        problem: &Problem<'_>,
        selection: &Selection,
        linear: &NormalEquations,
        (shared, nuisance): (&[f64], &[Vec<f64>]),
        damping: f64,
    ) -> Self {
        let n_nuisance = selection.nuisance.len();
        let mut nuisance_held = vec![vec![false; n_nuisance]; nuisance.len()];
        // Each round holds at least one more; mostly there is none.
        for _ in 0..n_nuisance {
            let (step, pushing) =
                Self::holding(problem, selection, linear, (shared, nuisance), damping, &nuisance_held);
            if pushing.is_empty() {
                return step;
            }
            for (run, i) in pushing {
                nuisance_held[run][i] = true;
            }
        }
        Self::holding(problem, selection, linear, (shared, nuisance), damping, &nuisance_held).0
    }

    /// A step, and which of the nuisance parameters (run, number) it pushes beyond a bound that they stand at.
    fn holding(
        problem: &Problem<'_>,
        selection: &Selection,
        linear: &NormalEquations,
        (shared, nuisance): (&[f64], &[Vec<f64>]),
        damping: f64,
        nuisance_held: &[Vec<bool>],
    ) -> (Self, Vec<(usize, usize)>) {
        let (n_nuisance, n_shared) = (selection.nuisance.len(), selection.shared.len());
        let eliminated: Vec<Eliminated> = linear
            .normals
            .iter()
            .zip(nuisance_held)
            .map(|(n, held)| Eliminated::new(n, held, damping))
            .collect();
        let (mut information, mut step) = reduce(linear, &eliminated, n_nuisance, n_shared);
        let mut held = vec![false; n_shared];
        for (i, &slot) in selection.shared.iter().enumerate() {
            let (table, x) = (&problem.shared, shared[slot]);
            held[i] = (x <= table.lower[slot] && step[i] < 0.0) || (x >= table.upper[slot] && step[i] > 0.0);
            information[(i, i)] = information[(i, i)] * (1.0 + damping) + 1e-12 / table.scale[slot].powi(2);
            if held[i] {
                step[i] = 0.0;
                information.row_mut(i).fill(0.0);
                information.column_mut(i).fill(0.0);
            }
        }
        let gradient = step.clone();
        let kept = cholesky(&mut information, RANK_FLOOR);
        forward(&information, &kept, &mut step);
        backward(&information, &kept, &mut step);
        let mut predicted = dot(&gradient, &step);
        let mut next_shared = shared.to_vec();
        for (step, &slot) in step.iter().zip(&selection.shared) {
            next_shared[slot] =
                (shared[slot] + step).clamp(problem.shared.lower[slot], problem.shared.upper[slot]);
        }
        let mut next_nuisance = nuisance.to_vec();
        let mut pushing = Vec::new();
        for (run, (e, values)) in eliminated.iter().zip(&mut next_nuisance).enumerate() {
            predicted += dot(&e.border[n_shared], &e.border[n_shared]);
            for (i, (moved, &slot)) in e.moved(&step).into_iter().zip(&selection.nuisance).enumerate() {
                let (low, high, x) =
                    (problem.nuisance.lower[slot], problem.nuisance.upper[slot], values[slot]);
                if !nuisance_held[run][i] && ((x <= low && moved < 0.0) || (x >= high && moved > 0.0)) {
                    pushing.push((run, i));
                }
                values[slot] = (x + moved).clamp(low, high);
            }
        }
        (Self { shared: next_shared, nuisance: next_nuisance, predicted, held }, pushing)
    }
}
