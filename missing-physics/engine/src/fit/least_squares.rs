//! A plain fit of a model's baseline, for a domain that prepares its model from the data.

use crate::data::Recording;
use crate::fit::gauss_newton::solve;
use crate::model::{Model, PredictError};
use crate::noise::rule::NoiseState;
use crate::problem::Problem;

/// Where a least-squares fit ended.
#[derive(Debug, Clone, PartialEq)]
pub struct LeastSquares {
    /// The shared parameters, by slot.
    pub shared: Vec<f64>,
    /// The nuisance parameters of each run, by slot.
    pub nuisance: Vec<Vec<f64>>,
    /// Weighted sum of squared residuals.
    pub chi2: f64,
}

/// Fits the baseline (every mechanism off) to a recording by least squares from given shared parameters; each channel is weighted by the
/// noise between its neighbouring rows.
///
/// # Errors
/// [`PredictError`] where the model gives no prediction at the start.
pub fn least_squares(
    model: &dyn Model,
    recording: &Recording,
    shared: &[f64],
) -> Result<LeastSquares, PredictError> {
    let problem = Problem::new(model, recording.clone());
    let sigma = (0..recording.channels.len()).map(|c| sigma(&problem, c)).collect();
    let white = NoiseState { shape: vec![0; recording.channels.len()], sigma };
    let fit = solve(&problem, &problem.select(&[], &[]), &white, shared, &problem.nuisance_start)?;
    Ok(LeastSquares { shared: fit.shared, nuisance: fit.nuisance, chi2: fit.chi2 })
}

/// Root mean square over the runs of what differs between neighbouring rows of a channel, or its calibration.
fn sigma(problem: &Problem<'_>, channel: usize) -> f64 {
    if let Some(sigma) = problem.recording.calibration[channel] {
        return sigma;
    }
    let squares: Vec<f64> = problem.rough_sigmas(channel).iter().map(|s| s * s).collect();
    let mean = (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt();
    mean.max(problem.recording.resolution[channel] / 12_f64.sqrt()).max(f64::MIN_POSITIVE.sqrt())
}
