//! Parameters fitted with a leftover in the model.

use nalgebra::DMatrix;

use crate::adequacy::linearised::curves::Curves;
use crate::fit::bordered::BorderedNormal;
use crate::fit::columns::{add_nuisance_prior, whitened_columns};
use crate::fit::optimum::Fit;
use crate::leftover::process::Process;
use crate::linalg::{SemiCholesky, dot, gram, rank};
use crate::model::PredictError;
use crate::noise::rule::NoiseRule;
use crate::problem::{Problem, Selection};

/// Steps of a fit.
const STEPS: usize = 40;
/// Gain of a step in the sum of squares, in units of what is left of a value, after which a fit is at its end.
const NO_GAIN: f64 = 1e-4;
/// Halvings of a step that does not go down.
const HALVINGS: usize = 6;
/// Rounds in which process and parameters are fitted in turn.
const ROUNDS: usize = 3;

/// Fits parameters and leftover in turn, from a fit without any.
pub(crate) fn with_leftover(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    selection: &Selection,
    start: &Fit,
) -> Result<(Fit, Process), PredictError> {
    let curves = Curves::new(problem, start)?;
    let mut process = Process::estimate(problem, rule, selection, &curves, start)?;
    let mut fit = given(problem, selection, &curves, &process, start)?;
    for _ in 1..ROUNDS {
        let next = Process::estimate(problem, rule, selection, &curves, &fit)?;
        if next == process {
            break;
        }
        let refitted = given(problem, selection, &curves, &next, &fit)?;
        if refitted.log_likelihood + next.log_prior(problem)
            <= fit.log_likelihood + process.log_prior(problem)
        {
            break;
        }
        (fit, process) = (refitted, next);
    }
    Ok((fit, process))
}

/// Normal equations of all runs at a point, with the leftover's coefficients as shared parameters behind the others.
struct Normals {
    bordered: BorderedNormal,
    /// Sum of squares that is left once the leftover has its best coefficients, its prior included.
    chi2: f64,
    n_left: usize,
}

fn normals(
    problem: &Problem<'_>,
    selection: &Selection,
    curves: &Curves,
    process: &Process,
    shared: &[f64],
    nuisance: &[Vec<f64>],
) -> Result<Normals, PredictError> {
    let (n_nuisance, n_shared) = (selection.nuisance.len(), selection.shared.len());
    let of_run = |run: usize| {
        let values = &nuisance[run];
        let mut columns = whitened_columns(problem, selection, &process.noise, run, shared, values)?;
        let residual = columns.pop().unwrap_or_default();
        let (left, variances) = process.columns(problem, curves, run);
        columns.extend(left);
        columns.push(residual);
        let mut normal = gram(&columns);
        add_nuisance_prior(problem, selection, &mut normal, run, values);
        Ok((normal, variances))
    };
    let (runs, variances): (Vec<_>, Vec<_>) = problem.by_run(of_run)?.into_iter().unzip();
    let precisions: Vec<f64> = variances.last().into_iter().flatten().map(|v| 1.0 / v).collect();
    let n_left = precisions.len();
    let mut prior = DMatrix::zeros(n_shared + n_left, n_shared + n_left);
    precisions.iter().enumerate().for_each(|(i, p)| prior[(n_shared + i, n_shared + i)] = *p);
    let first = n_nuisance + n_shared;
    let last = first + n_left;
    let mut block = prior.view((n_shared, n_shared), (n_left, n_left)).into_owned();
    let (mut gradient, mut chi2) = (vec![0.0; n_left], 0.0);
    let mut bordered = BorderedNormal::with_prior(prior);
    for normal in &runs {
        block += normal.view((first, first), (n_left, n_left));
        gradient.iter_mut().enumerate().for_each(|(i, g)| *g += normal[(last, first + i)]);
        chi2 += normal[(last, last)];
        bordered.add(normal);
    }
    SemiCholesky::new(block, rank::FIT).forward(&mut gradient);
    Ok(Normals { bordered, chi2: chi2 - dot(&gradient, &gradient), n_left })
}

/// Fits the free parameters with a given leftover process in the model.
pub(crate) fn given(
    problem: &Problem<'_>,
    selection: &Selection,
    curves: &Curves,
    process: &Process,
    start: &Fit,
) -> Result<Fit, PredictError> {
    let n_shared = selection.shared.len();
    let (mut shared, mut nuisance) = (start.shared.clone(), start.nuisance.clone());
    let mut here = normals(problem, selection, curves, process, &shared, &nuisance)?;
    let values = (0..problem.channels()).map(|c| problem.count(c)).sum::<usize>().max(1);
    let mut held = vec![false; n_shared];
    let mut converged = false;
    for _ in 0..STEPS {
        let (step, pushing) = step(problem, selection, &here, &shared);
        held = pushing;
        let moves = here.bordered.coefficients(&step);
        let at = |part: f64| -> (Vec<f64>, Vec<Vec<f64>>) {
            let mut next = (shared.clone(), nuisance.clone());
            let clamp = |x: f64, low: &[f64], high: &[f64], slot: usize| x.clamp(low[slot], high[slot]);
            for (&slot, moved) in selection.shared.iter().zip(&step) {
                let table = &problem.shared;
                next.0[slot] = clamp(shared[slot] + part * moved, &table.lower, &table.upper, slot);
            }
            for (values, moved) in next.1.iter_mut().zip(&moves) {
                for (&slot, moved) in selection.nuisance.iter().zip(moved) {
                    let table = &problem.nuisance;
                    values[slot] = clamp(values[slot] + part * moved, &table.lower, &table.upper, slot);
                }
            }
            next
        };
        let mut gained = None;
        for halving in 0..HALVINGS {
            let (s, n) = at(0.5f64.powi(halving as i32));
            if let Ok(next) = normals(problem, selection, curves, process, &s, &n)
                && next.chi2 <= here.chi2 * (1.0 + 1e-14)
            {
                gained = Some(here.chi2 - next.chi2);
                (shared, nuisance, here) = (s, n, next);
                break;
            }
        }
        let left = (here.chi2 / values as f64).max(1.0);
        if gained.is_none_or(|gained| gained < NO_GAIN * left) {
            converged = true;
            break;
        }
    }
    Ok(finished(problem, selection, process, here, (shared, nuisance), (held, converged)))
}

/// The full step of the shared parameters and of the leftover's coefficients; which shared parameters push against a bound.
fn step(
    problem: &Problem<'_>,
    selection: &Selection,
    here: &Normals,
    shared: &[f64],
) -> (Vec<f64>, Vec<bool>) {
    let (mut information, mut step) = (here.bordered.information(), here.bordered.gradient().to_vec());
    let table = &problem.shared;
    let mut held = vec![false; selection.shared.len()];
    for (i, &slot) in selection.shared.iter().enumerate() {
        let x = shared[slot];
        held[i] = (x <= table.lower[slot] && step[i] < 0.0) || (x >= table.upper[slot] && step[i] > 0.0);
        information[(i, i)] += 1e-12 / table.scale[slot].powi(2);
        if held[i] {
            step[i] = 0.0;
            information.row_mut(i).fill(0.0);
            information.column_mut(i).fill(0.0);
        }
    }
    SemiCholesky::new(information, rank::FIT).solve(&mut step);
    (step, held)
}

/// The fit at its end: the leftover's coefficients are integrated out.
fn finished(
    problem: &Problem<'_>,
    selection: &Selection,
    process: &Process,
    here: Normals,
    (shared, nuisance): (Vec<f64>, Vec<Vec<f64>>),
    (held, converged): (Vec<bool>, bool),
) -> Fit {
    let n_shared = selection.shared.len();
    let Normals { bordered, chi2, n_left } = here;
    let all = bordered.information();
    let block = SemiCholesky::new(all.view((n_shared, n_shared), (n_left, n_left)).into_owned(), rank::FIT);
    let borders: Vec<Vec<f64>> = (0..n_shared)
        .map(|i| {
            let mut column: Vec<f64> = (0..n_left).map(|k| all[(n_shared + k, i)]).collect();
            block.forward(&mut column);
            column
        })
        .collect();
    let information =
        DMatrix::from_fn(n_shared, n_shared, |i, j| all[(i, j)] - dot(&borders[i], &borders[j]));
    let mut log_likelihood = -0.5 * chi2 - 0.5 * block.log_determinant();
    for smooth in process.smooth.iter().flatten() {
        log_likelihood -= 0.5 * (smooth.degree + 1) as f64 * smooth.variance.ln();
    }
    log_likelihood -= bordered.runs().iter().map(|run| 0.5 * run.log_determinant()).sum::<f64>();
    for channel in 0..problem.channels() {
        log_likelihood -= problem.count(channel) as f64 * process.noise.sigma[channel].ln();
        for run in 0..problem.rows.len() {
            let whitener = problem.whitener(run, channel, process.noise.shape[channel]);
            log_likelihood -= 0.5 * whitener.log_determinant;
        }
    }
    Fit {
        nuisance_errors: bordered.runs().iter().map(|run| run.errors(n_shared)).collect(),
        at_bound: (0..n_shared).filter(|&i| held[i]).map(|i| selection.shared[i]).collect(),
        noise: process.noise.clone(),
        shared,
        nuisance,
        chi2,
        log_likelihood,
        information,
        converged,
    }
}
