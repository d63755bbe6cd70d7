//! Correlated Gaussian priors against closed forms.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use bayes_sim::error::Error;
use bayes_sim::mixture::Mixture;
use bayes_sim::points::Points;
use bayes_sim::posterior::Posterior;
use bayes_sim::prior::{Marginal, Prior};
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn covariance() -> DMatrix<f64> {
    DMatrix::from_row_slice(3, 3, &[4.0, 1.2, -0.3, 1.2, 1.0, 0.2, -0.3, 0.2, 0.25])
}

fn ln_gaussian(at: &DVector<f64>, mean: &DVector<f64>, covariance: &DMatrix<f64>) -> f64 {
    let off = at - mean;
    let squares = off.dot(&(covariance.clone().try_inverse().unwrap() * &off));
    -0.5 * (squares + (covariance * 2.0 * std::f64::consts::PI).determinant().ln())
}

#[test]
fn density_is_the_gaussians() {
    let mean = DVector::from_vec(vec![1.0, -2.0, 0.5]);
    let prior = Prior::gaussian(&mean, &covariance()).unwrap();
    for at in [[1.0, -2.0, 0.5], [4.0, -1.0, 0.0], [-3.0, 0.5, 2.0]] {
        let exact = ln_gaussian(&DVector::from_row_slice(&at), &mean, &covariance());
        approx::assert_abs_diff_eq!(prior.ln_density(&at).unwrap(), exact, epsilon = 1e-12);
    }
}

/// A flat parameter between two log-normal ones that are correlated.
#[test]
fn flat_and_log_normal_parameters_stand_side_by_side() {
    let marginals = vec![
        Marginal::LogNormal { mean: 0.3, sd: 0.5 },
        Marginal::Uniform { low: -1.0, high: 3.0 },
        Marginal::LogNormal { mean: -1.0, sd: 0.2 },
    ];
    let correlation = DMatrix::from_row_slice(3, 3, &[1.0, 0.0, -0.7, 0.0, 1.0, 0.0, -0.7, 0.0, 1.0]);
    let prior = Prior::correlated(marginals.clone(), &correlation).unwrap();
    let two = DMatrix::from_row_slice(2, 2, &[0.25, -0.07, -0.07, 0.04]);
    let at: [f64; 3] = [2.0, 0.1, 0.3];
    let logs = DVector::from_vec(vec![at[0].ln(), at[2].ln()]);
    let exact = ln_gaussian(&logs, &DVector::from_vec(vec![0.3, -1.0]), &two) - logs.sum() - 4.0_f64.ln();
    approx::assert_abs_diff_eq!(prior.ln_density(&at).unwrap(), exact, epsilon = 1e-12);
    assert!(prior.ln_density(&[2.0, 3.1, 0.3]).unwrap().is_infinite());

    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let n = 20_000;
    let mut product = 0.0;
    for _ in 0..n {
        let theta = prior.sample(&mut rng);
        assert!((-1.0..=3.0).contains(&theta[1]));
        product += (theta[0].ln() - 0.3) / 0.5 * (theta[2].ln() + 1.0) / 0.2 / f64::from(n);
    }
    // Five standard errors of a product of standard normals.
    assert!((product + 0.7).abs() < 5.0 * 1.22 / f64::from(n).sqrt(), "{product}");

    let correlated = DMatrix::from_row_slice(3, 3, &[1.0, 0.1, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0, 1.0]);
    assert!(matches!(Prior::correlated(marginals.clone(), &correlated), Err(Error::Correlation { .. })));
    let skew = DMatrix::from_row_slice(3, 3, &[1.0, 0.0, 0.5, 0.0, 1.0, 0.0, 0.4, 0.0, 1.0]);
    assert!(matches!(Prior::correlated(marginals.clone(), &skew), Err(Error::Correlation { .. })));
    let none = DMatrix::from_row_slice(3, 3, &[1.0, 0.0, 1.5, 0.0, 1.0, 0.0, 1.5, 0.0, 1.0]);
    assert!(matches!(Prior::correlated(marginals.clone(), &none), Err(Error::Correlation { .. })));
    let small = DMatrix::identity(2, 2);
    assert!(matches!(Prior::correlated(marginals, &small), Err(Error::Length { .. })));
}

/// The posterior of a Gaussian's mean under noise of one sigma is known; so is that of two observations together.
#[test]
fn a_product_divides_by_the_correlated_prior() {
    let mean = DVector::from_vec(vec![1.0, -2.0, 0.5]);
    let prior = Prior::gaussian(&mean, &covariance()).unwrap();
    let inner = covariance().try_inverse().unwrap();
    let after = |seen: &[DVector<f64>]| {
        let precision = &inner + DMatrix::identity(3, 3) * seen.len() as f64;
        let covariance = precision.try_inverse().unwrap();
        let centre = &covariance * (&inner * &mean + seen.iter().sum::<DVector<f64>>());
        (centre, covariance)
    };
    let posterior = |seen: &DVector<f64>| {
        let (centre, covariance) = after(std::slice::from_ref(seen));
        let means = Points::from_rows(3, [centre.as_slice()]).unwrap();
        let mixture = Mixture::new(&[1.0], &means, &[covariance.as_slice().to_vec()]).unwrap();
        Posterior::new(prior.clone(), mixture).unwrap()
    };
    let seen = [DVector::from_vec(vec![0.0, -1.0, 1.0]), DVector::from_vec(vec![2.0, -1.5, 0.0])];
    let both = Posterior::product(&[posterior(&seen[0]), posterior(&seen[1])]).unwrap();
    let (centre, covariance) = after(&seen);
    for at in [[1.0, -1.5, 0.5], [0.0, 0.0, 0.0]] {
        let exact = ln_gaussian(&DVector::from_row_slice(&at), &centre, &covariance);
        approx::assert_abs_diff_eq!(both.ln_density(&at).unwrap(), exact, epsilon = 1e-9);
    }
}
