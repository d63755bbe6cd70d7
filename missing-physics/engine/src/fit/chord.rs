//! Fits to parts of the data, from where a fit to all of them ends: Gauss-Newton steps along the derivatives that the model has there (chord
//! steps; Ortega and Rheinboldt 1970, Iterative Solution of Nonlinear Equations in Several Variables, section 7.1).

use nalgebra::DMatrix;

use crate::fit::columns::{add_nuisance_prior, whitened_columns};
use crate::fit::gauss_newton::{End, NOT_WORTH_ROUGHLY, solve_until};
use crate::fit::optimum::Fit;
use crate::fit::step::{NormalEquations, Step};
use crate::linalg::gram;
use crate::model::PredictError;
use crate::noise::rule::NoiseState;
use crate::problem::{Problem, Selection};

/// Steps at most; what has not settled by then is fitted with derivatives of its own.
const MOST: usize = 6;

/// Shared and nuisance parameters.
pub(crate) type Point = (Vec<f64>, Vec<Vec<f64>>);

/// Fits to some of the runs, from where a fit to all of them ends: along its derivatives where the model knows so many mechanisms that
/// derivatives at every step would take too long.
pub(crate) struct Chords<'a> {
    noise: &'a NoiseState,
    n_nuisance: usize,
    /// By run, whitened: of nuisance parameters, then of shared ones.
    columns: Option<Vec<Vec<Vec<f64>>>>,
}

impl<'a> Chords<'a> {
    /// About a fit to all runs.
    pub(crate) fn new(
        problem: &Problem<'_>,
        selection: &Selection,
        noise: &'a NoiseState,
        fit: &Fit,
    ) -> Result<Self, PredictError> {
        let of_run = |run: usize| {
            let nuisance = &fit.nuisance[run];
            let mut columns = whitened_columns(problem, selection, noise, run, &fit.shared, nuisance)?;
            columns.pop();
            Ok(columns)
        };
        let columns = problem.knows_many().then(|| problem.by_run(of_run)).transpose()?;
        Ok(Self { noise, n_nuisance: selection.nuisance.len(), columns })
    }

    /// Fits some of the runs (`part`, which are `runs` of all) from a point: all parameters of the selection, or its nuisance parameters
    /// alone where no shared one is selected.
    pub(crate) fn solve(
        &self,
        (part, runs): (&Problem<'_>, &[usize]),
        selection: &Selection,
        from: Point,
    ) -> Result<Point, PredictError> {
        let (from, settled) = self.along((part, runs), selection, from)?;
        if settled {
            return Ok(from);
        }
        let fit = solve_until(End::again(part), part, selection, self.noise, (&from.0, &from.1))?;
        Ok((fit.shared, fit.nuisance))
    }

    /// The same, with derivatives of its own where it ends.
    pub(crate) fn fit(
        &self,
        (part, runs): (&Problem<'_>, &[usize]),
        selection: &Selection,
        from: Point,
    ) -> Result<Fit, PredictError> {
        let (from, _) = self.along((part, runs), selection, from)?;
        solve_until(End::again(part), part, selection, self.noise, (&from.0, &from.1))
    }

    /// Where steps along the derivatives lead, and whether they settle there; nowhere without derivatives.
    fn along(
        &self,
        (part, runs): (&Problem<'_>, &[usize]),
        selection: &Selection,
        (mut shared, mut nuisance): Point,
    ) -> Result<(Point, bool), PredictError> {
        let Some(columns) = &self.columns else { return Ok(((shared, nuisance), false)) };
        let free = self.n_nuisance + selection.shared.len();
        let mine: Vec<&[Vec<f64>]> = runs.iter().map(|&run| &columns[run][..free]).collect();
        let normals = |shared: &[f64], nuisance: &[Vec<f64>]| {
            NormalEquations::with(part, |run| {
                self.normal(part, selection, mine[run], run, shared, &nuisance[run])
            })
        };
        let values: usize = (0..part.channels()).map(|c| part.count(c)).sum();
        let mut linear = normals(&shared, &nuisance)?;
        for _ in 0..MOST {
            let step = Step::new(part, selection, &linear, (&shared, &nuisance), 0.0);
            let left = (linear.chi2 / values.max(1) as f64).max(1.0);
            if !(step.predicted > NOT_WORTH_ROUGHLY * left) {
                return Ok(((shared, nuisance), true));
            }
            match normals(&step.shared, &step.nuisance) {
                Ok(next) if next.chi2 < linear.chi2 => {
                    (shared, nuisance, linear) = (step.shared, step.nuisance, next);
                }
                _ => break,
            }
        }
        Ok(((shared, nuisance), false))
    }

    /// One run's normal equations with the residual of a point.
    fn normal(
        &self,
        part: &Problem<'_>,
        selection: &Selection,
        columns: &[Vec<f64>],
        run: usize,
        shared: &[f64],
        nuisance: &[f64],
    ) -> Result<DMatrix<f64>, PredictError> {
        let residual = whitened_columns(part, &Selection::default(), self.noise, run, shared, nuisance)?;
        let columns: Vec<&[f64]> = columns.iter().chain(&residual).map(Vec::as_slice).collect();
        let mut normal = gram(&columns);
        add_nuisance_prior(part, selection, &mut normal, run, nuisance);
        Ok(normal)
    }
}
