//! A plain fit of a model's baseline, for a domain that prepares its model from the data.

use crate::data::Recording;
use crate::fit::gauss_newton::solve;
use crate::fit::prediction::residuals_at;
use crate::model::{Model, PredictError};
use crate::noise::rule::NoiseState;
use crate::problem::Problem;

/// Times that channels are weighted anew at the most.
const REWEIGHTED: usize = 4;
/// Weights that change by no more than this from channel to channel are found.
const ALIKE: f64 = 1.2;

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
    weighted(&problem, noise(&problem), shared, &problem.nuisance_start)
}

/// The same, each channel weighted by the root mean square that is left of it, where that is more than its noise: at the start, then by
/// the fit itself (iteratively reweighted: a maximum of the likelihood of channels of unknown variances). Where physics is missing, what a
/// precise channel lacks would otherwise be made up for at any cost to the others.
///
/// # Errors
/// [`PredictError`] where the model gives no prediction at the start.
pub fn reweighted_least_squares(
    model: &dyn Model,
    recording: &Recording,
    shared: &[f64],
) -> Result<LeastSquares, PredictError> {
    let problem = Problem::new(model, recording.clone());
    let noise = noise(&problem);
    let left = |shared: &[f64], nuisance: &[Vec<f64>]| -> Result<Vec<f64>, PredictError> {
        let left = residuals_at(&problem, shared, nuisance)?;
        let of_channel = |c: usize| {
            let squares: f64 = left.iter().flat_map(|run| &run[c]).map(|v| v * v).sum();
            (squares / problem.count(c).max(1) as f64).sqrt().max(noise[c])
        };
        Ok((0..noise.len()).map(of_channel).collect())
    };
    let mut sigma = left(shared, &problem.nuisance_start)?;
    let mut fit = weighted(&problem, sigma.clone(), shared, &problem.nuisance_start)?;
    for _ in 0..REWEIGHTED {
        let next = left(&fit.shared, &fit.nuisance)?;
        let change = next.iter().zip(&sigma).map(|(next, sigma)| next / sigma);
        let (least, most) = change.fold((f64::INFINITY, 0.0_f64), |(l, m), v| (l.min(v), m.max(v)));
        if most <= ALIKE * least {
            break;
        }
        sigma = next;
        fit = weighted(&problem, sigma.clone(), &fit.shared, &fit.nuisance)?;
    }
    Ok(fit)
}

/// A fit of the baseline beside white noise.
fn weighted(
    problem: &Problem<'_>,
    sigma: Vec<f64>,
    shared: &[f64],
    nuisance: &[Vec<f64>],
) -> Result<LeastSquares, PredictError> {
    let white = NoiseState { shape: vec![0; sigma.len()], sigma };
    let fit = solve(problem, &problem.select(&[], &[]), &white, shared, nuisance)?;
    Ok(LeastSquares { shared: fit.shared, nuisance: fit.nuisance, chi2: fit.chi2 })
}

/// Noise of each channel between its neighbouring rows.
fn noise(problem: &Problem<'_>) -> Vec<f64> {
    (0..problem.channels()).map(|c| sigma(problem, c)).collect()
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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use rand::SeedableRng as _;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution as _, Normal};

    use super::*;
    use crate::data::Run;
    use crate::model::{Quantity, Spec, SpecBuilder, UNBOUNDED};

    /// Two channels: `p x + q (x + 0.02 sin(9 x))` and `p x^2`.
    struct Ridge(Spec);

    impl Model for Ridge {
        fn spec(&self) -> &Spec {
            &self.0
        }

        fn predict(&self, run: &Run, shared: &[f64], _: &[f64], out: &mut [f64]) -> Result<(), PredictError> {
            let (one, other) = out.split_at_mut(run.len());
            for ((x, one), other) in run.inputs[0].iter().zip(one).zip(other) {
                *one = shared[0] * x + shared[1] * (x + 0.02 * (9.0 * x).sin());
                *other = shared[0] * x * x;
            }
            Ok(())
        }
    }

    /// What the model lacks of a channel of little noise is made up for at the cost of the other one, unless the channels are weighted by
    /// what is left of them.
    #[test]
    fn a_precise_channel_that_lacks_something_does_not_spoil_the_other() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut noise = |sigma: f64| Normal::new(0.0, sigma).unwrap().sample(&mut rng);
        let x: Vec<f64> = (0..400).map(|k| f64::from(k) / 400.0).collect();
        let lacking = |x: f64| 0.1 * (9.0 * x).sin() + 0.3 * (6.0 * x).cos();
        let one = |x: &f64| 2.0 * x + 0.02 * (9.0 * x).sin() + lacking(*x) + noise(1e-4);
        let one = x.iter().map(one).collect();
        let other = x.iter().map(|x| x * x + noise(1e-2)).collect();
        let run = Run { label: "1".into(), inputs: vec![x], outputs: vec![one, other], kind: 0 };
        let recording = Recording {
            channels: vec![Quantity::new("one", ""), Quantity::new("other", "")],
            variables: vec![Quantity::new("x", "")],
            runs: vec![run],
            noise_along: Some(0),
            calibration: vec![None; 2],
            resolution: vec![0.0; 2],
        };
        let mut spec = SpecBuilder::new("a ridge");
        let _ = ["p", "q"].map(|name| spec.shared(name, "", 1.0, UNBOUNDED, 0.1));
        let model = Ridge(spec.build().unwrap());
        let p = |fit: Result<LeastSquares, PredictError>| fit.unwrap().shared[0];
        assert!((p(least_squares(&model, &recording, &[1.0, 1.0])) - 1.0).abs() > 1.0);
        assert!((p(reweighted_least_squares(&model, &recording, &[1.0, 1.0])) - 1.0).abs() < 0.01);
    }
}
