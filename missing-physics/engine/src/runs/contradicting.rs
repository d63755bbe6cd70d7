//! Runs that hold most of what is left, while the others agree.

use crate::fit::gauss_newton::solve;
use crate::fit::optimum::Fit;
use crate::fit::prediction::residuals;
use crate::model::PredictError;
use crate::noise::rule::NoiseState;
use crate::problem::{Problem, Selection};
use crate::statistics::median;

/// With fewer runs it is open which contradict which.
const FEWEST_RUNS: usize = 4;
/// At most this part of the runs contradicts the rest.
const MOST: f64 = 1.0 / 3.0;
/// The part of what is left that lies in them.
const SHARE: f64 = 0.5;
/// Their mean square over the median of all runs'.
const LARGER: f64 = 4.0;
/// Standard deviations by which their sum of squares exceeds the noise's.
const CLEAR: f64 = 5.0;
/// Times that the others are fitted anew, and runs judged by that fit.
const ROUNDS: usize = 4;

/// Runs, and the part of the squared misfit that lies in them.
pub(crate) struct Contradicting {
    /// Indices, rising.
    pub(crate) runs: Vec<usize>,
    pub(crate) share: f64,
}

/// The runs that miss a model fitted to the others, where they are few and hold most of what is left; `None` where there are none.
pub(crate) fn contradicting(
    problem: &Problem<'_>,
    selection: &Selection,
    near: &Fit,
    sigma: &[f64],
) -> Result<Option<Contradicting>, PredictError> {
    let runs = problem.rows.len();
    if runs < FEWEST_RUNS {
        return Ok(None);
    }
    let white = NoiseState { shape: vec![0; sigma.len()], sigma: sigma.to_vec() };
    let known = selection.without_shared();
    let mut found: Vec<usize> = Vec::new();
    for _ in 0..ROUNDS {
        let others: Vec<usize> = (0..runs).filter(|r| !found.contains(r)).collect();
        let nuisance: Vec<Vec<f64>> = others.iter().map(|&r| near.nuisance[r].clone()).collect();
        let trained = solve(&problem.of_runs(&others), selection, &white, &near.shared, &nuisance)?;
        let tested = solve(problem, &known, &white, &trained.shared, &near.nuisance)?;
        let left = residuals(problem, &tested)?;
        let of_run = |run: &Vec<Vec<f64>>| -> (f64, f64) {
            let rows = run.iter().map(Vec::len).sum::<usize>() as f64;
            let squares =
                |(column, sigma): (&Vec<f64>, &f64)| column.iter().map(|v| (v / sigma).powi(2)).sum::<f64>();
            (run.iter().zip(sigma).map(squares).sum(), rows.max(1.0))
        };
        let judged: Vec<(f64, f64)> = left.iter().map(of_run).collect();
        let mut means: Vec<f64> = judged.iter().map(|(squares, rows)| squares / rows).collect();
        let usual = median(&mut means).unwrap_or(1.0).max(1.0);
        let excess = |r: usize| judged[r].0 - judged[r].1;
        let clear = |&r: &usize| {
            let (squares, rows) = judged[r];
            squares / rows > LARGER * usual && excess(r) > CLEAR * (2.0 * rows).sqrt()
        };
        let now: Vec<usize> = (0..runs).filter(clear).collect();
        if now.is_empty() || now.len() as f64 > MOST * runs as f64 || runs - now.len() < FEWEST_RUNS - 1 {
            return Ok(None);
        }
        if now == found {
            let all: f64 = (0..runs).map(|r| excess(r).max(0.0)).sum();
            let share = now.iter().map(|&r| excess(r)).sum::<f64>() / all;
            return Ok((share >= SHARE).then_some(Contradicting { runs: found, share }));
        }
        found = now;
    }
    Ok(None)
}
