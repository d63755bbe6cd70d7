//! One step of the bounded Gauss-Newton fit: every run's nuisance parameters eliminated, those that push against a bound held there.

use nalgebra::DMatrix;

use crate::fit::bordered::BorderedNormal;
use crate::linalg::{SemiCholesky, dot, rank};
use crate::model::PredictError;
use crate::problem::{Problem, Selection};

/// The normal equations at a point.
pub(crate) struct NormalEquations {
    /// Each run's normal equations: free nuisance parameters first, then free shared ones, then the residual.
    pub(crate) normals: Vec<DMatrix<f64>>,
    /// Sum of squares, the nuisance parameters' prior included.
    pub(crate) chi2: f64,
}

impl NormalEquations {
    /// Of a problem, from each run's.
    pub(crate) fn with(
        problem: &Problem<'_>,
        of_run: impl Fn(usize) -> Result<DMatrix<f64>, PredictError> + Sync + Send,
    ) -> Result<Self, PredictError> {
        Ok(Self::of_runs(problem.by_run(of_run)?))
    }

    fn of_runs(normals: Vec<DMatrix<f64>>) -> Self {
        let chi2 = normals.iter().map(|normal| normal[(normal.nrows() - 1, normal.nrows() - 1)]).sum();
        Self { normals, chi2 }
    }

    /// Those of the other parameters where one of them (a column of each run's) is moved by so much, as the linearised model has it.
    pub(crate) fn moved(&self, column: usize, by: f64) -> Self {
        let of_run = |normal: &DMatrix<f64>| {
            let last = normal.nrows() - 1;
            let mut moved = normal.clone();
            for i in (0..last).filter(|i| *i != column) {
                let with_residual = normal[(last, i)] - by * normal[(column.max(i), column.min(i))];
                (moved[(last, i)], moved[(i, last)]) = (with_residual, with_residual);
            }
            moved[(last, last)] += by * (by * normal[(column, column)] - 2.0 * normal[(last, column)]);
            moved.remove_row(column).remove_column(column)
        };
        Self::of_runs(self.normals.iter().map(of_run).collect())
    }

    /// The nuisance parameters of all runs eliminated.
    pub(crate) fn bordered(&self, n_shared: usize) -> BorderedNormal {
        let mut bordered = BorderedNormal::new(n_shared);
        self.normals.iter().for_each(|normal| bordered.add(normal));
        bordered
    }
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

    /// A part of the step, in (0, 1], from the point that it leads from.
    pub(crate) fn part(mut self, length: f64, shared: &[f64], nuisance: &[Vec<f64>]) -> Self {
        let shorten = |to: &mut f64, from: &f64| *to = from + length * (*to - from);
        if length < 1.0 {
            self.shared.iter_mut().zip(shared).for_each(|(to, from)| shorten(to, from));
            let nuisance = nuisance.iter().flatten();
            self.nuisance.iter_mut().flatten().zip(nuisance).for_each(|(to, from)| shorten(to, from));
        }
        self
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
        let n_shared = selection.shared.len();
        let mut bordered = BorderedNormal::new(n_shared);
        for (normal, held) in linear.normals.iter().zip(nuisance_held) {
            bordered.add_holding(normal, held, damping);
        }
        let (mut information, mut step) = (bordered.information(), bordered.gradient().to_vec());
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
        SemiCholesky::new(information, rank::FIT).solve(&mut step);
        let mut predicted = dot(&gradient, &step);
        let mut next_shared = shared.to_vec();
        for (step, &slot) in step.iter().zip(&selection.shared) {
            next_shared[slot] =
                (shared[slot] + step).clamp(problem.shared.lower[slot], problem.shared.upper[slot]);
        }
        let mut next_nuisance = nuisance.to_vec();
        let mut pushing = Vec::new();
        for (run, (eliminated, values)) in bordered.runs().iter().zip(&mut next_nuisance).enumerate() {
            predicted += eliminated.explained();
            for (i, (moved, &slot)) in
                eliminated.back_substitute(&step).into_iter().zip(&selection.nuisance).enumerate()
            {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::gram;

    /// A column that is moved by so much and held takes as much of itself from the residual.
    #[test]
    fn equations_of_a_moved_parameter_are_those_of_the_rest() {
        let column = |k: usize| -> Vec<f64> { (0..9).map(|i| ((3 * k + i * i) as f64).sin()).collect() };
        let columns: Vec<Vec<f64>> = (0..4).map(column).collect();
        let whole = gram(&columns);
        let chi2 = whole[(3, 3)];
        let equations = NormalEquations { normals: vec![whole.clone(), whole], chi2: 2.0 * chi2 };
        for (held, by) in [(0, 0.7), (1, -2.0), (2, 0.3)] {
            let moved = equations.moved(held, by);
            let mut others = columns.clone();
            let gone = others.remove(held);
            others[2].iter_mut().zip(&gone).for_each(|(residual, c)| *residual -= by * c);
            let expected = gram(&others);
            approx::assert_relative_eq!(moved.normals[1], expected, epsilon = 1e-12);
            approx::assert_relative_eq!(moved.chi2, 2.0 * expected[(2, 2)], epsilon = 1e-12);
        }
    }
}
