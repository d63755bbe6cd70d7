//! The linearised model of one run: whitened columns, and the normal equations of them.

use nalgebra::DMatrix;

use crate::linalg::gram;
use crate::model::{LARGEST_PREDICTION, PredictError};
use crate::noise::rule::NoiseState;
use crate::problem::{Problem, Selection};

/// How wide the prior of a run's nuisance parameter is, in units of its scale.
const NUISANCE_PRIOR: f64 = 1e3;
/// How wide the prior of a nuisance parameter is that a mechanism adds, in units of its scale.
const ADDED_NUISANCE_PRIOR: f64 = 10.0;

/// Standard deviation of the prior of the `i`-th free nuisance parameter.
pub(crate) fn nuisance_prior_width(problem: &Problem<'_>, selection: &Selection, i: usize) -> f64 {
    let width = if selection.added_nuisance[i] { ADDED_NUISANCE_PRIOR } else { NUISANCE_PRIOR };
    width * problem.nuisance.scale[selection.nuisance[i]]
}

/// Whitened columns of one run: Jacobian by nuisance, by shared parameters, and the residual; channels one after the other.
pub(crate) fn whitened_columns(
    problem: &Problem<'_>,
    selection: &Selection,
    noise: &NoiseState,
    run: usize,
    shared: &[f64],
    nuisance: &[f64],
) -> Result<Vec<Vec<f64>>, PredictError> {
    let data = &problem.recording.runs[run];
    let rows = problem.channels() * data.len();
    let free = selection.shared.len() + selection.nuisance.len();
    let (mut out, mut jacobian) = (vec![0.0; rows], vec![0.0; rows * free]);
    problem.model.jacobian(
        data,
        shared,
        nuisance,
        &selection.shared,
        &selection.nuisance,
        &mut out,
        &mut jacobian,
    )?;
    let large = out.iter().find(|v| !(v.abs() <= LARGEST_PREDICTION));
    if let Some(bad) = large.or_else(|| jacobian.iter().find(|v| !v.is_finite())) {
        let reason = format!("the prediction holds {bad:e}, expected at most {LARGEST_PREDICTION:e}");
        return Err(PredictError { run: data.label.clone(), reason });
    }
    let mut columns = vec![Vec::with_capacity(rows); free + 1];
    for channel in 0..problem.channels() {
        let whitener = problem.whitener(run, channel, noise.shape[channel]);
        let inverse_sigma = 1.0 / noise.sigma[channel];
        // The model lists shared columns first; the normal equations eliminate nuisance ones first.
        let sources = (selection.shared.len()..free).chain(0..selection.shared.len());
        let mut picked: Vec<Vec<f64>> =
            sources.map(|k| problem.pick(run, channel, &jacobian[k * rows..(k + 1) * rows])).collect();
        let valid = problem.rows[run].valid[channel].iter();
        picked.push(valid.map(|&i| data.outputs[channel][i] - out[channel * data.len() + i]).collect());
        whitener.whiten_all(&mut picked);
        for (column, picked) in columns.iter_mut().zip(&picked) {
            column.extend(picked.iter().map(|v| v * inverse_sigma));
        }
    }
    Ok(columns)
}

/// What the prior of a run's nuisance parameters adds to the sum of squares.
pub(crate) fn nuisance_departure(
    problem: &Problem<'_>,
    selection: &Selection,
    run: usize,
    nuisance: &[f64],
) -> f64 {
    let square = |(i, &slot): (usize, &usize)| {
        let departure = problem.nuisance_start[run][slot] - nuisance[slot];
        (departure / nuisance_prior_width(problem, selection, i)).powi(2)
    };
    selection.nuisance.iter().enumerate().map(square).sum()
}

/// Normal equations of one run with the prior of its nuisance parameters, which come first, then the shared ones, then the residual.
pub(crate) fn normal_of_run(
    problem: &Problem<'_>,
    selection: &Selection,
    noise: &NoiseState,
    run: usize,
    shared: &[f64],
    nuisance: &[f64],
) -> Result<DMatrix<f64>, PredictError> {
    let mut normal = gram(&whitened_columns(problem, selection, noise, run, shared, nuisance)?);
    add_nuisance_prior(problem, selection, &mut normal, run, nuisance);
    Ok(normal)
}

/// Adds the prior of a run's nuisance parameters to its normal equations.
pub(crate) fn add_nuisance_prior(
    problem: &Problem<'_>,
    selection: &Selection,
    normal: &mut DMatrix<f64>,
    run: usize,
    nuisance: &[f64],
) {
    let last = normal.nrows() - 1;
    for (i, &slot) in selection.nuisance.iter().enumerate() {
        let precision = 1.0 / nuisance_prior_width(problem, selection, i).powi(2);
        let departure = problem.nuisance_start[run][slot] - nuisance[slot];
        normal[(i, i)] += precision;
        normal[(i, last)] += precision * departure;
        normal[(last, i)] += precision * departure;
        normal[(last, last)] += precision * departure * departure;
    }
}
