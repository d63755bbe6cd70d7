//! Levenberg and Marquardt's method for a handful of parameters, and errors that hold where the noise is coloured.
//!
//! argmin 0.11 has Gauss and Newton's method, undamped; the crate `levenberg-marquardt` (0.15) is on nalgebra 0.34, which the tree would
//! then hold beside 0.35.

use nalgebra::{DMatrix, DVector};

/// Most accepted or refused steps.
const MOST_STEPS: usize = 200;
/// Relative gain of the sum of squares below which the search has ended.
const STILL: f64 = 1e-12;

/// Where a search ended.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fit {
    pub(super) params: DVector<f64>,
    /// Measured less modelled.
    pub(super) residuals: DVector<f64>,
    /// Derivatives of the model, a row a reading.
    pub(super) jacobian: DMatrix<f64>,
}

impl Fit {
    pub(super) fn squares(&self) -> f64 {
        self.residuals.norm_squared()
    }

    /// Standard deviation of the residuals.
    pub(super) fn sigma(&self) -> f64 {
        let freedom = self.residuals.len().saturating_sub(self.params.len()).max(1);
        (self.squares() / freedom as f64).sqrt()
    }
}

/// The least squares of `measured` less a model near `start`: the model writes its values and their derivatives.
///
/// `None` where a value at the start is no number.
pub(super) fn least_squares(
    measured: &[f64],
    start: DVector<f64>,
    model: impl Fn(&DVector<f64>, &mut DVector<f64>, &mut DMatrix<f64>),
) -> Option<Fit> {
    let (rows, columns) = (measured.len(), start.len());
    let evaluate = |params: DVector<f64>| {
        let mut values = DVector::zeros(rows);
        let mut jacobian = DMatrix::zeros(rows, columns);
        model(&params, &mut values, &mut jacobian);
        let residuals = DVector::from_iterator(rows, measured.iter().zip(&values).map(|(y, f)| y - f));
        Fit { params, residuals, jacobian }
    };
    let mut best = evaluate(start);
    if !best.squares().is_finite() {
        return None;
    }
    let mut damping = 1e-3;
    for _ in 0..MOST_STEPS {
        let normal = best.jacobian.tr_mul(&best.jacobian);
        let gradient = best.jacobian.tr_mul(&best.residuals);
        let mut damped = normal.clone();
        for i in 0..columns {
            // Marquardt's scaling; a parameter without influence stays where it is.
            damped[(i, i)] += damping * normal[(i, i)].max(f64::MIN_POSITIVE);
        }
        let Some(step) = damped.cholesky().map(|c| c.solve(&gradient)) else {
            damping *= 10.0;
            continue;
        };
        let next = evaluate(&best.params + step);
        if next.squares() <= best.squares() {
            let gain = best.squares() - next.squares();
            best = next;
            damping = (0.2 * damping).max(1e-12);
            if gain <= STILL * best.squares() {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > 1e12 {
                break;
            }
        }
    }
    Some(best)
}

/// Covariance of the parameters where neighbouring residuals may be correlated: Newey and West's (1987, doi:10.2307/1913610) with
/// Bartlett's window, as wide as Andrews's rule has it for a first-order process (1991, doi:10.2307/2938229, eqs 6.2, 6.4).
///
/// `None` where the readings do not determine the parameters.
pub(super) fn covariance(fit: &Fit) -> Option<DMatrix<f64>> {
    let (rows, columns) = fit.jacobian.shape();
    let inverse = fit.jacobian.tr_mul(&fit.jacobian).try_inverse()?;
    let r = fit.residuals.as_slice();
    let (mut along, mut whole) = (0.0, 0.0);
    for pair in r.windows(2) {
        along += pair[0] * pair[1];
        whole += pair[0] * pair[0];
    }
    let rho = if whole > 0.0 { (along / whole).clamp(-0.97, 0.97) } else { 0.0 };
    let alpha = 4.0 * rho * rho / ((1.0 - rho) * (1.0 + rho)).powi(2);
    let width = (1.1447 * (alpha * rows as f64).cbrt()).floor().min(rows as f64 / 4.0) as usize;
    let scores = DMatrix::from_fn(rows, columns, |i, j| fit.jacobian[(i, j)] * fit.residuals[i]);
    let mut middle = scores.tr_mul(&scores);
    for lag in 1..=width {
        let weight = 1.0 - lag as f64 / (width as f64 + 1.0);
        let lagged = scores.rows(lag, rows - lag).tr_mul(&scores.rows(0, rows - lag));
        middle += (&lagged + lagged.transpose()) * weight;
    }
    let correction = rows as f64 / rows.saturating_sub(columns).max(1) as f64;
    Some(&inverse * middle * &inverse * correction)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    fn decay(t: &[f64]) -> impl Fn(&DVector<f64>, &mut DVector<f64>, &mut DMatrix<f64>) + '_ {
        move |p, values, jacobian| {
            for (i, t) in t.iter().enumerate() {
                let e = (-p[1] * t).exp();
                values[i] = p[0] * e;
                jacobian[(i, 0)] = e;
                jacobian[(i, 1)] = -p[0] * t * e;
            }
        }
    }

    /// Without noise the parameters come back to rounding; with noise of first-order colour the errors hold, where those for
    /// white noise are far too small.
    #[test]
    fn errors_hold_in_coloured_noise() {
        let t: Vec<f64> = (0..400).map(|i| f64::from(i) * 0.01).collect();
        let exact: Vec<f64> = t.iter().map(|t| 2.0 * (-0.7 * t).exp()).collect();
        let start = || DVector::from_vec(vec![1.0, 0.2]);
        let fit = least_squares(&exact, start(), decay(&t)).unwrap();
        assert!((fit.params[0] - 2.0).abs() < 1e-9 && (fit.params[1] - 0.7).abs() < 1e-9);
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let (mut inside, mut naive) = (0, 0);
        for _ in 0..400 {
            let mut noise = 0.0;
            let noisy: Vec<f64> = exact
                .iter()
                .map(|x| {
                    let step: f64 = StandardNormal.sample(&mut rng);
                    noise = 0.8 * noise + 0.03 * step;
                    x + noise
                })
                .collect();
            let fit = least_squares(&noisy, start(), decay(&t)).unwrap();
            let off = (fit.params[1] - 0.7).abs();
            inside += usize::from(off < 1.96 * covariance(&fit).unwrap()[(1, 1)].sqrt());
            let white =
                fit.jacobian.tr_mul(&fit.jacobian).try_inverse().unwrap()[(1, 1)].sqrt() * fit.sigma();
            naive += usize::from(off < 1.96 * white);
        }
        assert!((348..=392).contains(&inside), "{inside} of 400 in 95 % intervals");
        assert!(naive < 300, "{naive}");
    }
}
