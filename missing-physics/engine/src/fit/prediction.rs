//! What a fit predicts, and what it leaves.

use crate::fit::optimum::Fit;
use crate::model::PredictError;
use crate::problem::Problem;

/// Predictions of a fit, `[run][channel][row]`.
pub(crate) fn predictions(problem: &Problem<'_>, fit: &Fit) -> Result<Vec<Vec<Vec<f64>>>, PredictError> {
    problem.by_run(|run| {
        let data = &problem.recording.runs[run];
        let n = data.len();
        let mut out = vec![0.0; n * problem.channels()];
        problem.model.predict(data, &fit.shared, &fit.nuisance[run], &mut out)?;
        Ok((0..problem.channels()).map(|c| out[c * n..(c + 1) * n].to_vec()).collect())
    })
}

/// Measured less predicted, `[run][channel]`, measured rows only.
pub(crate) fn residuals(problem: &Problem<'_>, fit: &Fit) -> Result<Vec<Vec<Vec<f64>>>, PredictError> {
    residuals_at(problem, &fit.shared, &fit.nuisance)
}

/// The same at a point, shared and nuisance parameters.
pub(crate) fn residuals_at(
    problem: &Problem<'_>,
    shared: &[f64],
    nuisance: &[Vec<f64>],
) -> Result<Vec<Vec<Vec<f64>>>, PredictError> {
    problem.by_run(|run| {
        let data = &problem.recording.runs[run];
        let n = data.len();
        let mut out = vec![0.0; n * problem.channels()];
        problem.model.predict(data, shared, &nuisance[run], &mut out)?;
        let of_channel = |c: usize| {
            problem.rows[run].valid[c].iter().map(|&i| data.outputs[c][i] - out[c * n + i]).collect()
        };
        Ok((0..problem.channels()).map(of_channel).collect())
    })
}
