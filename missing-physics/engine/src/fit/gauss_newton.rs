//! Bounded Gauss-Newton for a given noise.

use crate::fit::columns::normal_of_run;
use crate::fit::optimum::Fit;
use crate::fit::step::{NormalEquations, Step};
use crate::model::PredictError;
use crate::noise::rule::NoiseState;
use crate::problem::{Problem, Selection};

const MAX_ITERATIONS: usize = 60;

pub(crate) fn linearise(
    problem: &Problem<'_>,
    selection: &Selection,
    noise: &NoiseState,
    shared: &[f64],
    nuisance: &[Vec<f64>],
) -> Result<NormalEquations, PredictError> {
    let mut normals = Vec::with_capacity(nuisance.len());
    let mut chi2 = 0.0;
    for (run, values) in nuisance.iter().enumerate() {
        let gram = normal_of_run(problem, selection, noise, run, shared, values)?;
        let last = gram.nrows() - 1;
        chi2 += gram[(last, last)];
        normals.push(gram);
    }
    Ok(NormalEquations { normals, chi2 })
}

/// Fits the free parameters for a given noise, from a given start.
pub(crate) fn solve(
    problem: &Problem<'_>,
    selection: &Selection,
    noise: &NoiseState,
    shared: &[f64],
    nuisance: &[Vec<f64>],
) -> Result<Fit, PredictError> {
    solve_within(MAX_ITERATIONS, problem, selection, noise, (shared, nuisance))
}

/// The same in at most so many iterations.
pub(crate) fn solve_within(
    iterations: usize,
    problem: &Problem<'_>,
    selection: &Selection,
    noise: &NoiseState,
    (shared, nuisance): (&[f64], &[Vec<f64>]),
) -> Result<Fit, PredictError> {
    let n_shared = selection.shared.len();
    let (mut shared, mut nuisance) = (shared.to_vec(), nuisance.to_vec());
    let mut linear = linearise(problem, selection, noise, &shared, &nuisance)?;
    let mut damping = 0.0;
    let mut converged = false;
    let mut held = vec![false; n_shared];
    for _ in 0..iterations {
        let step = Step::new(problem, selection, &linear, (&shared, &nuisance), damping);
        let predicted = step.predicted;
        held = step.held;
        if !(predicted > 1e-9 * (1.0 + 1e-6 * linear.chi2)) {
            converged = true;
            break;
        }
        match linearise(problem, selection, noise, &step.shared, &step.nuisance) {
            Ok(next) if next.chi2 <= linear.chi2 * (1.0 + 1e-14) => {
                let gained = linear.chi2 - next.chi2;
                (shared, nuisance, linear) = (step.shared, step.nuisance, next);
                damping = if damping < 1e-6 { 0.0 } else { damping * 0.1 };
                if gained < 1e-7 && predicted < 1e-5 {
                    converged = true;
                    break;
                }
            }
            _ if damping > 1e8 => {
                // No step goes down any more: rounding, a bound of a nuisance parameter, or a kink.
                converged = predicted < 1e-4 * (1.0 + linear.chi2);
                break;
            }
            _ => damping = if damping == 0.0 { 1e-3 } else { damping * 10.0 },
        }
    }
    let bordered = linear.bordered(n_shared);
    let mut log_likelihood = -0.5 * linear.chi2;
    for run in bordered.runs() {
        log_likelihood -= 0.5 * run.log_determinant();
    }
    for channel in 0..problem.channels() {
        log_likelihood -= problem.count(channel) as f64 * noise.sigma[channel].ln();
        for run in 0..problem.rows.len() {
            log_likelihood -= 0.5 * problem.whitener(run, channel, noise.shape[channel]).log_determinant;
        }
    }
    let nuisance_errors = bordered.runs().iter().map(|run| run.errors(n_shared)).collect();
    let at_bound = (0..n_shared).filter(|&i| held[i]).map(|i| selection.shared[i]).collect();
    Ok(Fit {
        shared,
        nuisance,
        noise: noise.clone(),
        chi2: linear.chi2,
        log_likelihood,
        nuisance_errors,
        information: bordered.information(),
        converged,
        at_bound,
    })
}
