//! How well a fit predicts what it has not seen.

use rayon::prelude::*;

use crate::fit::chord::Chords;
use crate::fit::gauss_newton::solve;
use crate::fit::prediction::{residuals, residuals_at};
use crate::model::PredictError;
use crate::noise::rule::NoiseState;
use crate::problem::{Problem, Selection};
use crate::selection::candidate::Candidate;
use crate::selection::evidence::bounded_marginal;

/// Groups in which runs are left out.
const FOLDS: usize = 5;

/// What a fit predicts of data that it has not seen.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct HeldOut {
    /// Log density of the unseen data.
    pub(crate) log_score: f64,
    /// Root mean square error, by channel.
    pub(crate) rmse: Vec<f64>,
}

/// Leaves out each run (or each of five groups of runs) in turn; a single run's end is predicted from its beginning.
///
/// The density of unseen data is the ratio of two marginal likelihoods, with and without them (Dawid 1984,
/// doi:10.2307/2981683): what the seen data leave open counts. With the best values alone in its place, an effect that half
/// of a recording cannot size loses to a baseline whose noise is as large as its misfit.
pub(crate) fn held_out(problem: &Problem<'_>, candidate: &Candidate) -> Result<HeldOut, PredictError> {
    let noise = &candidate.fit.noise;
    let known = candidate.selection.without_shared();
    let mut out = LeavingOut { problem, candidate, noise, known, log_score: 0.0, squares: Vec::new() };
    out.squares = vec![(0.0, 0); problem.channels()];
    if problem.recording.runs.len() > 1 {
        out.groups_of_runs()?
    } else {
        out.ends_of_a_run()?
    }
    let rmse = out.squares.iter().map(|(sum, n)| (sum / (*n).max(1) as f64).sqrt()).collect();
    Ok(HeldOut { log_score: out.log_score, rmse })
}

/// What has been found with parts of the data left out.
struct LeavingOut<'a> {
    problem: &'a Problem<'a>,
    candidate: &'a Candidate,
    noise: &'a NoiseState,
    /// What is free where the shared parameters are known.
    known: Selection,
    log_score: f64,
    /// By channel: sum of squares of the errors of unseen data, and how many there are.
    squares: Vec<(f64, usize)>,
}

impl LeavingOut<'_> {
    /// Leaves out each run in turn, or each of five groups of runs.
    fn groups_of_runs(&mut self) -> Result<(), PredictError> {
        let Self { problem, candidate, noise, .. } = *self;
        let whole = bounded_marginal(problem, &candidate.selection, &candidate.fit);
        let runs = problem.recording.runs.len();
        let folds = runs.min(FOLDS);
        let part = |ids: &[usize]| -> (Problem<'_>, Vec<Vec<f64>>) {
            let nuisance = ids.iter().map(|&r| candidate.fit.nuisance[r].clone()).collect();
            (problem.of_runs(ids), nuisance)
        };
        let (selection, fit) = (&candidate.selection, &candidate.fit);
        let chords = Chords::new(problem, selection, noise, fit)?;
        let of_fold = |fold: usize| -> Result<_, PredictError> {
            let (test, train): (Vec<usize>, Vec<usize>) = (0..runs).partition(|r| r % folds == fold);
            let (seen, nuisance) = part(&train);
            let trained = chords.fit((&seen, &train), selection, (fit.shared.clone(), nuisance))?;
            let (unseen, nuisance) = part(&test);
            let known = (trained.shared.clone(), nuisance);
            let (shared, nuisance) = chords.solve((&unseen, &test), &self.known, known)?;
            let score = whole - bounded_marginal(&seen, selection, &trained);
            Ok((score, residuals_at(&unseen, &shared, &nuisance)?))
        };
        let of_folds: Vec<_> = (0..folds).into_par_iter().map(of_fold).collect::<Result<_, _>>()?;
        for (score, left) in of_folds {
            self.log_score += score;
            self.add(&left, |_, _| true);
        }
        Ok(())
    }

    /// Predicts the third and the fourth quarter of a single run from what is before.
    fn ends_of_a_run(&mut self) -> Result<(), PredictError> {
        let Self { problem, candidate, noise, .. } = *self;
        let (selection, fit) = (&candidate.selection, &candidate.fit);
        let rows = problem.recording.runs[0].len();
        let cut = |end: usize| {
            let mut recording = problem.recording.clone();
            for column in &mut recording.runs[0].outputs {
                column[end..].fill(f64::NAN);
            }
            problem.with(recording)
        };
        for (seen, until) in [(rows / 2, rows * 3 / 4), (rows * 3 / 4, rows)] {
            let (begin, both) = (cut(seen), cut(until));
            let trained = solve(&begin, selection, noise, &fit.shared, &fit.nuisance)?;
            let tested = solve(&begin, &self.known, noise, &trained.shared, &trained.nuisance)?;
            let longer = solve(&both, selection, noise, &trained.shared, &trained.nuisance)?;
            self.log_score +=
                bounded_marginal(&both, selection, &longer) - bounded_marginal(&begin, selection, &trained);
            let valid = &both.rows[0].valid;
            self.add(&residuals(&both, &tested)?, |c, i| valid[c][i] >= seen);
        }
        Ok(())
    }

    /// Counts the errors (`[run][channel]`, measured rows) of which `unseen` (channel, row) says so.
    fn add(&mut self, residual: &[Vec<Vec<f64>>], unseen: impl Fn(usize, usize) -> bool) {
        for row in residual {
            for (c, column) in row.iter().enumerate() {
                for (_, v) in column.iter().enumerate().filter(|(i, _)| unseen(c, *i)) {
                    self.squares[c].0 += v * v;
                    self.squares[c].1 += 1;
                }
            }
        }
    }
}
