//! Parameters and noise fitted in turn.

use crate::fit::gauss_newton::solve;
use crate::fit::optimum::Fit;
use crate::model::PredictError;
use crate::noise::estimate::estimate_noise;
use crate::noise::rule::{NoiseRule, NoiseState};
use crate::problem::{Problem, Selection};

/// Fits parameters and noise in turn until neither moves.
pub(crate) fn fit(
    problem: &Problem<'_>,
    selection: &Selection,
    rule: &NoiseRule,
    start: (&[f64], &[Vec<f64>]),
    noise: Option<&NoiseState>,
) -> Result<Fit, PredictError> {
    let first = match noise {
        Some(noise) => noise.clone(),
        None => {
            let sigma = rule.fixed_sigma.iter().zip(&rule.floor).map(|(s, f)| s.unwrap_or(*f)).collect();
            NoiseState { shape: vec![0; problem.channels()], sigma }
        }
    };
    let best = solve(problem, selection, &first, start.0, start.1)?;
    in_turn(problem, selection, rule, best)
}

/// The same from a rough fit for a given noise.
pub(crate) fn fit_from(
    problem: &Problem<'_>,
    selection: &Selection,
    rule: &NoiseRule,
    rough: &Fit,
) -> Result<Fit, PredictError> {
    let noise = estimate_noise(problem, selection, rule, &rough.shared, &rough.nuisance)?;
    let best = solve(problem, selection, &noise, &rough.shared, &rough.nuisance)?;
    in_turn(problem, selection, rule, best)
}

fn in_turn(
    problem: &Problem<'_>,
    selection: &Selection,
    rule: &NoiseRule,
    mut best: Fit,
) -> Result<Fit, PredictError> {
    for _ in 0..6 {
        let noise = estimate_noise(problem, selection, rule, &best.shared, &best.nuisance)?;
        let still = noise.shape == best.noise.shape
            && noise.sigma.iter().zip(&best.noise.sigma).all(|(a, b)| (a / b - 1.0).abs() < 1e-4);
        if still {
            break;
        }
        best = solve(problem, selection, &noise, &best.shared, &best.nuisance)?;
    }
    Ok(best)
}
