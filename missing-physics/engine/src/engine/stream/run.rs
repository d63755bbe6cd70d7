//! A run as the e-value sees it: linearised about the reference's fit, its own parameters eliminated.

use std::f64::consts::PI;

use nalgebra::DMatrix;

use super::change::{CURVES, What, directions};
use super::evidence::{Direction, RunGram};
use crate::data::Run;
use crate::engine::input::DiagnoseError;
use crate::fit::columns::whitened_columns;
use crate::fit::gauss_newton::solve;
use crate::fit::optimum::Fit;
use crate::linalg::{SemiCholesky, gram, rank};
use crate::model::PredictError;
use crate::noise::rule::NoiseState;
use crate::problem::{Problem, Selection};

/// What the reference settled: where the model is linearised, and how its noise is whitened.
pub(super) struct Setting<'a> {
    problem: Problem<'a>,
    /// Everything that the baseline or any mechanism frees; no run's own parameters but the baseline's.
    wide: Selection,
    /// The free shared parameters of the baseline, among those of `wide`.
    baseline: Vec<usize>,
    shared: Vec<f64>,
    nuisance: Vec<Vec<f64>>,
    noise: NoiseState,
}

impl<'a> Setting<'a> {
    /// The setting, and what may change.
    pub(super) fn new(problem: Problem<'a>, fit: &Fit) -> (Self, Vec<What>, Vec<Direction>) {
        let without = problem.select(&[], &[]);
        let all = problem.spec().named();
        let freed = problem.select(&all, &[]);
        let wide = Selection { nuisance: without.nuisance, added_nuisance: without.added_nuisance, ..freed };
        let baseline =
            without.shared.iter().filter_map(|slot| wide.shared.iter().position(|s| s == slot)).collect();
        let (names, found) = directions(&problem, &wide, &fit.shared).into_iter().unzip();
        let (shared, nuisance, noise) = (fit.shared.clone(), fit.nuisance.clone(), fit.noise.clone());
        (Self { problem, wide, baseline, shared, nuisance, noise }, names, found)
    }

    pub(super) fn shared(&self) -> usize {
        self.baseline.len()
    }

    pub(super) fn reference_runs(&self) -> usize {
        self.problem.rows.len()
    }

    pub(super) fn reference_gram(&self, run: usize) -> Result<RunGram, PredictError> {
        self.of(&self.problem, run, &self.nuisance[run])
    }

    /// A run that has come: its nuisance parameters are fitted to it alone.
    pub(super) fn gram(&self, run: &Run) -> Result<RunGram, DiagnoseError> {
        let mut recording = self.problem.recording.clone();
        recording.runs = vec![run.clone()];
        recording.check()?;
        let problem = self.problem.with(recording);
        let alone = self.wide.without_shared();
        let fit = solve(&problem, &alone, &self.noise, &self.shared, &problem.nuisance_start)?;
        let nuisance = fit.nuisance.first().map_or(&[][..], Vec::as_slice);
        Ok(self.of(&problem, 0, nuisance)?)
    }

    fn of(&self, problem: &Problem<'_>, run: usize, nuisance: &[f64]) -> Result<RunGram, PredictError> {
        let mut columns = whitened_columns(problem, &self.wide, &self.noise, run, &self.shared, nuisance)?;
        let residual = columns.pop().unwrap_or_default();
        let nuisances = self.wide.nuisance.len();
        let of_wide = columns.split_off(nuisances);
        let mut all = columns;
        all.extend(self.baseline.iter().map(|k| of_wide[*k].clone()));
        all.extend(of_wide);
        all.extend(self.curves(problem, run));
        let rows = residual.len() as f64;
        all.push(residual);
        let (gram, rank) = eliminate(&gram(&all), nuisances);
        Ok(RunGram { gram, freedom: rows - rank as f64 })
    }

    /// Cosines over a run's rows, channel by channel, whitened as the rows are.
    fn curves(&self, problem: &Problem<'_>, run: usize) -> Vec<Vec<f64>> {
        let counts: Vec<usize> = problem.rows[run].valid.iter().map(Vec::len).collect();
        let rows: usize = counts.iter().sum();
        let mut columns = Vec::with_capacity(counts.len() * CURVES);
        let mut start = 0;
        for (channel, &count) in counts.iter().enumerate() {
            for order in 0..CURVES {
                let cosine = |i: usize| (PI * order as f64 * (i as f64 + 0.5) / count.max(1) as f64).cos();
                let mut curve: Vec<f64> = (0..count).map(cosine).collect();
                problem.whitener(run, channel, self.noise.shape[channel]).whiten(&mut curve);
                let mut column = vec![0.0; rows];
                for (to, from) in column[start..].iter_mut().zip(curve) {
                    *to = from / self.noise.sigma[channel];
                }
                columns.push(column);
            }
            start += count;
        }
        columns
    }
}

/// What is left of a Gram matrix once its `first` leading columns have been projected away, and their rank.
fn eliminate(gram: &DMatrix<f64>, first: usize) -> (DMatrix<f64>, usize) {
    let rest = gram.nrows() - first;
    let factor = SemiCholesky::new(gram.view((0, 0), (first, first)).into_owned(), rank::DETERMINED);
    let mut half = vec![Vec::new(); rest];
    for (j, column) in half.iter_mut().enumerate() {
        *column = (0..first).map(|i| gram[(i, first + j)]).collect::<Vec<f64>>();
        factor.forward(column);
    }
    let left = DMatrix::from_fn(rest, rest, |i, j| {
        let explained: f64 = half[i].iter().zip(&half[j]).map(|(a, b)| a * b).sum();
        let value = gram[(first + i, first + j)] - explained;
        // A column that the run's nuisance parameters make is left with rounding alone.
        if i == j && value <= 1e-10 * gram[(first + i, first + i)] { 0.0 } else { value }
    });
    (left, factor.rank())
}
