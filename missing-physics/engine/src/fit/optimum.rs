//! What a fit found.

use nalgebra::DMatrix;

use crate::fit::bordered::NuisanceErrors;
use crate::linalg::{SemiCholesky, rank};
use crate::noise::rule::NoiseState;

/// A point in parameter space and what the data say there.
#[derive(Debug, Clone)]
pub(crate) struct Fit {
    pub(crate) shared: Vec<f64>,
    pub(crate) nuisance: Vec<Vec<f64>>,
    pub(crate) noise: NoiseState,
    /// Weighted sum of squared residuals.
    pub(crate) chi2: f64,
    /// Log likelihood with the runs' nuisance parameters integrated out over a wide prior.
    pub(crate) log_likelihood: f64,
    /// How well each run determines its nuisance parameters.
    pub(crate) nuisance_errors: Vec<NuisanceErrors>,
    /// Information matrix of the free shared parameters (nuisance ones eliminated).
    pub(crate) information: DMatrix<f64>,
    pub(crate) converged: bool,
    /// Free shared slots that ended at a bound.
    pub(crate) at_bound: Vec<usize>,
}

/// The covariance of the free shared parameters; infinite variance where the data do not determine one of them.
pub(crate) fn covariance(information: &DMatrix<f64>) -> DMatrix<f64> {
    let n = information.nrows();
    let factor = SemiCholesky::new(information.clone(), rank::DETERMINED);
    let mut inverse = DMatrix::zeros(n, n);
    for j in 0..n {
        if !factor.keeps(j) {
            inverse[(j, j)] = f64::INFINITY;
            continue;
        }
        let mut column = vec![0.0; n];
        column[j] = 1.0;
        factor.solve(&mut column);
        inverse.column_mut(j).copy_from_slice(&column);
    }
    inverse
}
