//! What part of the misfit a set of mechanisms takes away on data that it has not seen.

use rayon::prelude::*;

use crate::fit::chord::Chords;
use crate::fit::gauss_newton::{End, solve_until};
use crate::fit::optimum::Fit;
use crate::fit::prediction::residuals_at;
use crate::model::PredictError;
use crate::noise::rough::RoughNoise;
use crate::noise::rule::NoiseState;
use crate::problem::{Problem, Selection};

/// Groups in which runs, or the rows of a single run, are left out.
const FOLDS: usize = 5;

/// Times by which the standard error of a nuisance parameter is larger without the rows that are left out from which on the others do not tell it: a
/// start that has faded by the end of the first piece.
const UNTOLD: f64 = 10.0;

/// Into what the rows of a single run are cut, before every fifth piece is left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cut {
    /// Five pieces: what is left out lies far from what is seen. Of a motion that dies away the first one holds what no other shows.
    Fifths,
    /// A hundred pieces: what lasts for a few of them is both seen and left out.
    Hundredths,
}

impl Cut {
    fn pieces(self) -> usize {
        match self {
            Self::Fifths => FOLDS,
            Self::Hundredths => 100,
        }
    }
}

/// How unseen data are looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Look {
    pub(crate) cut: Cut,
    /// The mean of so many neighbouring rows is one reading: what is slow stands out against less noise.
    pub(crate) block: usize,
}

/// Sum of squares, in units of the noise beside which slow effects are seen, by which a fit misses readings beyond the noise, `[run][channel][row]`.
pub(crate) fn misfit(
    residual: &[Vec<Vec<f64>>],
    white: &NoiseState,
    rough: &RoughNoise,
    block: usize,
) -> f64 {
    let of_column = |(channel, column): (usize, &Vec<f64>)| {
        // The same for all blocks but the last one, which may be shorter.
        let of_noise = rough.block(channel, block);
        let of_block = |rows: &[f64]| {
            let sum = rows.iter().sum::<f64>() / white.sigma[channel];
            let noise = if rows.len() == block { of_noise } else { rough.block(channel, rows.len()) };
            sum * sum / rows.len() as f64 - noise
        };
        column.chunks(block).map(of_block).sum::<f64>()
    };
    residual.iter().flat_map(|run| run.iter().enumerate()).map(of_column).sum()
}

/// The [`misfit`] of unseen data.
///
/// Each run (or each of five groups of runs) is left out in turn, its nuisance parameters then fitted to it; of a single run, every fifth
/// of its pieces, its nuisance parameters then fitted to all of it where the rest of the rows does not tell them. Fits are plain least squares: a slow misfit is not taken for noise.
pub(crate) fn unseen_misfit(
    problem: &Problem<'_>,
    selection: &Selection,
    fit: &Fit,
    rough: &RoughNoise,
    Look { cut, block }: Look,
) -> Result<f64, PredictError> {
    let white = &fit.noise;
    let miss = |residual: &[Vec<Vec<f64>>]| misfit(residual, white, rough, block);
    let runs = problem.recording.runs.len();
    let known = selection.without_shared();
    let folds = if runs > 1 { runs.min(FOLDS) } else { FOLDS };
    let of_runs = |chords: &Chords<'_>, fold: usize| -> Result<f64, PredictError> {
        let (test, train): (Vec<usize>, Vec<usize>) = (0..runs).partition(|r| r % folds == fold);
        let nuisance =
            |ids: &[usize]| -> Vec<Vec<f64>> { ids.iter().map(|&r| fit.nuisance[r].clone()).collect() };
        let seen = problem.of_runs(&train);
        let (shared, _) = chords.solve((&seen, &train), selection, (fit.shared.clone(), nuisance(&train)))?;
        let unseen = problem.of_runs(&test);
        let (shared, nuisance) = chords.solve((&unseen, &test), &known, (shared, nuisance(&test)))?;
        Ok(miss(&residuals_at(&unseen, &shared, &nuisance)?))
    };
    let of_rows = |fold: usize| -> Result<f64, PredictError> {
        let rows = problem.recording.runs[0].len();
        let left_out = |row: usize| row * cut.pieces() / rows % FOLDS == fold;
        let without = |inside: bool| {
            let mut recording = problem.recording.clone();
            for column in &mut recording.runs[0].outputs {
                let rows = column.iter_mut().enumerate().filter(|(i, _)| left_out(*i) == inside);
                rows.for_each(|(_, v)| *v = f64::NAN);
            }
            problem.with(recording)
        };
        let (others, start) = (without(true), (&fit.shared[..], &fit.nuisance[..]));
        let trained = solve_until(End::again(problem), &others, selection, white, start)?;
        let error = |fit: &Fit, i: usize| fit.nuisance_errors[0].error[i];
        let told = |i: usize| error(&trained, i) < UNTOLD * error(fit, i);
        let nuisance = if (0..selection.nuisance.len()).all(told) {
            trained.nuisance
        } else {
            let start = (&trained.shared[..], &trained.nuisance[..]);
            solve_until(End::again(problem), problem, &known, white, start)?.nuisance
        };
        Ok(miss(&residuals_at(&without(false), &trained.shared, &nuisance)?))
    };
    let chords = (runs > 1).then(|| Chords::new(problem, selection, white, fit)).transpose()?;
    let of_fold = |fold: usize| chords.as_ref().map_or_else(|| of_rows(fold), |chords| of_runs(chords, fold));
    let misfits: Vec<f64> = (0..folds).into_par_iter().map(of_fold).collect::<Result<_, _>>()?;
    Ok(misfits.into_iter().sum::<f64>().max(0.0))
}
