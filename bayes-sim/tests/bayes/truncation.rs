//! Masses in boxes against closed forms, and draws that cannot hang.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use std::f64::consts::PI;

use bayes_sim::mixture::Mixture;
use bayes_sim::points::Points;
use bayes_sim::posterior::Posterior;
use bayes_sim::prior::Prior;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn equicorrelated(d: usize, rho: f64) -> Vec<f64> {
    (0..d * d).map(|n| if n / d == n % d { 1.0 } else { rho }).collect()
}

fn gaussian(mean: &[f64], covariance: Vec<f64>, bounds: &[[f64; 2]]) -> Posterior {
    let means = Points::from_rows(mean.len(), [mean]).unwrap();
    let mixture = Mixture::new(&[1.0], &means, &[covariance]).unwrap();
    Posterior::new(Prior::uniform(bounds).unwrap(), mixture).unwrap()
}

/// The share of the positive orthant: 1/4 + asin(rho) / 2 pi in two dimensions.
#[test]
fn two_dimensions_are_exact_however_correlated() {
    for rho in [-0.999_999, -0.7, 0.0, 0.3, 0.95, 0.999, 0.999_999_9_f64] {
        let mass = gaussian(&[0.0, 0.0], equicorrelated(2, rho), &[[0.0, 60.0]; 2]).mass();
        let exact = 0.25 + rho.asin() / (2.0 * PI);
        assert!((mass.value - exact).abs() < 1e-11, "{rho}: {} {exact}", mass.value);
    }
}

/// Far in a tail the quadrature keeps its relative accuracy: independent variables, 5 to 9 standard deviations out.
#[test]
fn two_dimensions_are_exact_far_out() {
    let mass = gaussian(&[0.0, 0.0], equicorrelated(2, 0.0), &[[5.0, 9.0], [-1.0, 1.0]]).mass();
    // scipy: (norm.sf(5) - norm.sf(9)) * (2 * norm.cdf(1) - 1)
    assert!(
        (mass.value / (2.866_515_718_791_939e-7 * 0.682_689_492_137_085_9) - 1.0).abs() < 1e-9,
        "{}",
        mass.value
    );
}

/// Correlation rho everywhere: 1/8 + 3 asin(rho) / 4 pi of the mass is in the positive octant; where the rule of few points does not do, the
/// lattice does.
#[test]
fn three_dimensions_are_within_their_stated_error() {
    for rho in [-0.49, -0.3, 0.0, 0.3, 0.7, 0.9, 0.99, 0.9999_f64] {
        let mass = gaussian(&[0.0; 3], equicorrelated(3, rho), &[[0.0, 60.0]; 3]).mass();
        let exact = 0.125 + 3.0 * rho.asin() / (4.0 * PI);
        assert!((mass.value - exact).abs() <= 1.5 * mass.error + 1e-12, "{rho}: {mass:?} {exact}");
        assert!(mass.error < 2e-4 * exact, "{rho}: {mass:?}");
    }
}

/// Correlation 1/2 everywhere: 1 / (d + 1) of the mass is in the positive orthant.
#[test]
fn more_dimensions_are_within_their_stated_error() {
    for d in [3, 5, 10] {
        let mass = gaussian(&vec![0.0; d], equicorrelated(d, 0.5), &vec![[0.0, 60.0]; d]).mass();
        let exact = 1.0 / (d as f64 + 1.0);
        // Stated are three standard errors.
        assert!((mass.value - exact).abs() < 1.5 * mass.error, "{d}: {mass:?} {exact}");
        assert!(mass.error < 2e-3 * exact, "{d}: {mass:?}");
    }
}

/// Ten standard deviations outside: the draws come, are inside, and are the right ones.
#[test]
fn draws_come_at_any_leakage() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    // Mean of a standard normal cut to [10, 11]: 10.098068 (scipy: truncnorm(10, 11).mean()).
    let posterior = gaussian(&[0.0, 0.0], equicorrelated(2, 0.0), &[[10.0, 11.0], [-5.0, 5.0]]);
    let draws = posterior.sample(4000, &mut rng);
    assert!(!draws.exact && draws.acceptance == 0.0 && draws.theta.len() == 4000);
    assert!(draws.theta.rows().all(|t| posterior.prior().contains(t)));
    let mean = draws.theta.column(0).iter().sum::<f64>() / 4000.0;
    assert!((mean - 10.098_068).abs() < 0.006, "{mean}");
    // Beyond what a number can tell from zero.
    let nowhere = gaussian(&[0.0; 6], equicorrelated(6, 0.3), &[[1e4, 2e4]; 6]);
    let draws = nowhere.sample(100, &mut rng);
    assert!(draws.theta.len() == 100 && draws.theta.rows().all(|t| nowhere.prior().contains(t)));
}

/// A density cut to its box integrates to one there.
#[test]
fn cut_densities_integrate_to_one() {
    let posterior = gaussian(&[0.8, -0.2], vec![0.5, 0.2, 0.2, 0.3], &[[-1.0, 1.0], [-0.5, 1.0]]);
    let (n, mut sum) = (400, 0.0);
    for i in 0..n {
        for j in 0..n {
            let t = [
                -1.0 + 2.0 * (f64::from(i) + 0.5) / f64::from(n),
                -0.5 + 1.5 * (f64::from(j) + 0.5) / f64::from(n),
            ];
            sum += posterior.ln_density(&t).unwrap().exp() * 3.0 / f64::from(n * n);
        }
    }
    assert!((sum - 1.0).abs() < 1e-5, "{sum}");
    assert_eq!(posterior.ln_density(&[1.1, 0.0]).unwrap(), f64::NEG_INFINITY);
}
