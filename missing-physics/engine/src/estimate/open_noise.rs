//! What the shape of the noise leaves open of the parameters.

use nalgebra::DMatrix;

use crate::fit::gauss_newton::solve;
use crate::fit::optimum::{Fit, covariance};
use crate::model::PredictError;
use crate::noise::estimate::open_shapes;
use crate::noise::rule::{NoiseRule, NoiseState};
use crate::problem::Problem;
use crate::selection::candidate::Candidate;

/// A candidate with the information that is left once the shape of the noise is as open as the residuals leave it: the variance of
/// the parameters is its mean over the shapes, and what they move by with the shape (Hoeting et al. 1999,
/// doi:10.1214/ss/1009212519). `None` where that has no inverse.
pub(crate) fn with_open_noise(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    candidate: &Candidate,
) -> Option<Candidate> {
    let Candidate { selection, fit, .. } = candidate;
    let n = selection.shared.len();
    let chosen = covariance(&fit.information);
    let mut total = chosen.clone();
    let over = |noise: &NoiseState| -> Result<DMatrix<f64>, PredictError> {
        let there = solve(problem, selection, noise, &fit.shared, &fit.nuisance)?;
        let moved = |i: usize| there.shared[selection.shared[i]] - fit.shared[selection.shared[i]];
        let by = DMatrix::from_fn(n, n, |i, j| moved(i) * moved(j));
        Ok(covariance(&there.information) + by)
    };
    for (channel, shapes) in open_shapes(problem, selection, rule, fit).ok()?.iter().enumerate() {
        for open in shapes {
            let mut noise = fit.noise.clone();
            (noise.shape[channel], noise.sigma[channel]) = (open.shape, open.sigma);
            total += (over(&noise).ok()? - &chosen) * open.weight;
        }
    }
    let information = total.cholesky()?.inverse();
    let sound = information.iter().all(|v| v.is_finite());
    sound.then(|| Candidate { fit: Fit { information, ..fit.clone() }, ..candidate.clone() })
}
