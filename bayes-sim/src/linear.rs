//! Ridge regression: where a network's linear path starts.

use faer::linalg::matmul::matmul;
use faer::linalg::solvers::Solve;
use faer::{Accum, Mat, MatRef, Par, Side};

use crate::training::Pairs;

/// Most rows a regression looks at; more would not change where training starts.
const MOST_ROWS: usize = 20_000;

/// `target = intercept + coefficients . input`, and what is left.
#[derive(Debug, Clone)]
pub(crate) struct Regression {
    /// Input after input, for each target.
    pub(crate) coefficients: Mat<f64>,
    pub(crate) intercept: Vec<f64>,
    /// Root mean square of the residual of each target.
    pub(crate) residual_sd: Vec<f64>,
}

impl Regression {
    pub(crate) fn predict(&self, input: &[f64], target: usize) -> f64 {
        let dot: f64 = input.iter().enumerate().map(|(i, x)| x * self.coefficients[(i, target)]).sum();
        self.intercept[target] + dot
    }

    /// Mean over targets of `ln` of the root mean square error on other pairs.
    pub(crate) fn ln_error(&self, pairs: &Pairs) -> f64 {
        let targets = pairs.target_dim;
        let mut squares = vec![0.0; targets];
        for i in 0..pairs.len() {
            for (t, square) in squares.iter_mut().enumerate() {
                *square += (pairs.target(i)[t] - self.predict(pairs.input(i), t)).powi(2);
            }
        }
        squares.iter().map(|s| 0.5 * (s / pairs.len() as f64).max(1e-300).ln()).sum::<f64>() / targets as f64
    }
}

/// One regression a penalty; those whose matrix cannot be factored are left out.
pub(crate) fn ridge(pairs: &Pairs, penalties: &[f64]) -> Vec<Regression> {
    let n = pairs.len().min(MOST_ROWS);
    let (p, t) = (pairs.input_dim, pairs.target_dim);
    let x = MatRef::from_column_major_slice(&pairs.inputs[..n * p], p, n);
    let y = MatRef::from_column_major_slice(&pairs.targets[..n * t], t, n);
    let mean = |m: MatRef<'_, f64>| -> Vec<f64> {
        (0..m.nrows()).map(|i| m.row(i).iter().sum::<f64>() / n as f64).collect()
    };
    let (mean_x, mean_y) = (mean(x), mean(y));
    let xc = Mat::from_fn(p, n, |i, j| x[(i, j)] - mean_x[i]);
    let yc = Mat::from_fn(t, n, |i, j| y[(i, j)] - mean_y[i]);
    let mut gram = Mat::<f64>::zeros(p, p);
    matmul(gram.as_mut(), Accum::Replace, xc.as_ref(), xc.transpose(), 1.0, Par::Seq);
    let mut right = Mat::<f64>::zeros(p, t);
    matmul(right.as_mut(), Accum::Replace, xc.as_ref(), yc.transpose(), 1.0, Par::Seq);
    penalties
        .iter()
        .filter_map(|&penalty| {
            let mut matrix = gram.clone();
            (0..p).for_each(|i| matrix[(i, i)] += penalty);
            let coefficients = matrix.llt(Side::Lower).ok()?.solve(&right);
            let intercept: Vec<f64> = (0..t)
                .map(|k| mean_y[k] - (0..p).map(|i| mean_x[i] * coefficients[(i, k)]).sum::<f64>())
                .collect();
            let mut out = Regression { coefficients, intercept, residual_sd: vec![0.0; t] };
            for k in 0..t {
                let squares: f64 =
                    (0..n).map(|i| (pairs.target(i)[k] - out.predict(pairs.input(i), k)).powi(2)).sum();
                out.residual_sd[k] = (squares / n as f64).sqrt().max(1e-3);
            }
            Some(out)
        })
        .collect()
}
