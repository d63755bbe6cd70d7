//! Mixtures as values, against quadrature, draws and conjugate posteriors.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use bayes_sim::error::Error;
use bayes_sim::mixture::Mixture;
use bayes_sim::points::Points;
use bayes_sim::posterior::Posterior;
use bayes_sim::prior::{Marginal, Prior};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn two() -> Mixture {
    let means = Points::from_values(2, vec![-1.0, 0.5, 2.0, -0.3]).unwrap();
    Mixture::new(&[1.0, 3.0], &means, &[vec![0.5, 0.3, 0.3, 0.4], vec![1.0, -0.6, -0.6, 0.9]]).unwrap()
}

#[test]
fn densities_integrate_to_one_and_to_the_moments() {
    let m = two();
    let (h, mut sum, mut mean, mut second) = (0.04, 0.0, [0.0; 2], [0.0; 4]);
    for i in -200..200 {
        for j in -200..200 {
            let p = [f64::from(i) * h, f64::from(j) * h];
            let mass = h * h * m.ln_density(&p).unwrap().exp();
            sum += mass;
            for a in 0..2 {
                mean[a] += mass * p[a];
                (0..2).for_each(|b| second[2 * a + b] += mass * p[a] * p[b]);
            }
        }
    }
    assert!((sum - 1.0).abs() < 1e-6);
    for a in 0..2 {
        assert!((mean[a] - m.mean()[a]).abs() < 1e-6);
        for b in 0..2 {
            assert!((second[2 * a + b] - mean[a] * mean[b] - m.covariance()[2 * a + b]).abs() < 1e-5);
        }
    }
    let projected = m.projection().unwrap();
    assert_eq!(projected.len(), 1);
    assert!(projected.covariance().iter().zip(m.covariance()).all(|(a, b)| (a - b).abs() < 1e-12));
}

#[test]
fn draws_have_the_mixtures_moments() {
    let (m, n) = (two(), 200_000);
    let draws = m.sample(n, &mut ChaCha8Rng::seed_from_u64(1));
    for j in 0..2 {
        let column = draws.column(j);
        let mean = column.iter().sum::<f64>() / n as f64;
        let variance = column.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n as f64;
        // Five standard errors.
        assert!((mean - m.mean()[j]).abs() < 5.0 * (m.covariance()[3 * j] / n as f64).sqrt());
        assert!((variance / m.covariance()[3 * j] - 1.0).abs() < 0.02);
    }
}

#[test]
fn modes_are_maxima_and_equal_components_share_one() {
    let modes = two().modes();
    assert_eq!(modes.len(), 2);
    for mode in &modes {
        for (dx, dy) in [(1e-3, 0.0), (-1e-3, 0.0), (0.0, 1e-3), (0.0, -1e-3)] {
            let near = two().ln_density(&[mode.at[0] + dx, mode.at[1] + dy]).unwrap();
            assert!(near < mode.ln_density);
        }
    }
    let same = Points::from_values(1, vec![0.0, 0.1]).unwrap();
    assert_eq!(Mixture::new(&[1.0, 1.0], &same, &[vec![1.0], vec![1.0]]).unwrap().modes().len(), 1);
}

proptest! {
    /// p(a, b) = p(b) p(a | b), for every split of four dimensions.
    #[test]
    fn joint_is_marginal_times_conditional(seed in 0_u64..500, first in 0_usize..4, second in 0_usize..4) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut z = || -> f64 { StandardNormal.sample(&mut rng) };
        let means = Points::from_values(4, (0..12).map(|_| z()).collect()).unwrap();
        let covariances: Vec<Vec<f64>> = (0..3).map(|_| {
            let a: Vec<f64> = (0..16).map(|_| z()).collect();
            let entry = |i: usize, j: usize| (0..4).map(|k| a[4 * i + k] * a[4 * j + k]).sum::<f64>() + f64::from(u8::from(i == j));
            (0..16).map(|n| entry(n / 4, n % 4)).collect()
        }).collect();
        let m = Mixture::new(&[0.2, 1.0, 0.5], &means, &covariances).unwrap();
        let x: Vec<f64> = (0..4).map(|_| z()).collect();
        let known: Vec<usize> = if first == second { vec![first] } else { vec![first, second] };
        let values: Vec<f64> = known.iter().map(|&i| x[i]).collect();
        let rest: Vec<f64> = (0..4).filter(|i| !known.contains(i)).map(|i| x[i]).collect();
        let product = m.marginal(&known).unwrap().ln_density(&values).unwrap()
            + m.conditional(&known, &values).unwrap().ln_density(&rest).unwrap();
        let joint = m.ln_density(&x).unwrap();
        prop_assert!((joint - product).abs() < 1e-8 * joint.abs().max(1.0));
    }

    /// Merging keeps mean and covariance, however few are left.
    #[test]
    fn merging_keeps_the_moments(most in 1_usize..4) {
        let means = Points::from_values(1, vec![-2.0, -1.9, 0.4, 3.0, 3.3]).unwrap();
        let m = Mixture::new(&[1.0, 2.0, 0.5, 1.0, 1.0], &means, &vec![vec![0.3]; 5]).unwrap();
        let fewer = m.reduced(most);
        prop_assert_eq!(fewer.len(), most);
        prop_assert!((fewer.mean()[0] - m.mean()[0]).abs() < 1e-12);
        prop_assert!((fewer.covariance()[0] - m.covariance()[0]).abs() < 1e-12);
    }
}

/// Posterior of a mean from one datum of noise 0.5, as two components with the same sum.
fn from_datum(prior: &Prior, datum: f64) -> Posterior {
    let (mean, variance) = match prior.marginals()[0] {
        Marginal::Normal { mean, sd } => {
            let precision = 4.0 + 1.0 / (sd * sd);
            ((4.0 * datum + mean / (sd * sd)) / precision, 1.0 / precision)
        }
        _ => (datum, 0.25),
    };
    let means = Points::from_values(1, vec![mean, mean]).unwrap();
    let mixture = Mixture::new(&[0.3, 0.7], &means, &[vec![variance], vec![variance]]).unwrap();
    Posterior::new(prior.clone(), mixture).unwrap()
}

#[test]
fn products_are_conjugate_posteriors_and_contract_as_the_root_of_their_number() {
    let gaussian = Prior::new(vec![Marginal::Normal { mean: 1.0, sd: 0.8 }]).unwrap();
    let flat = Prior::uniform(&[[-20.0, 20.0]]).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let data: Vec<f64> = (0..400)
        .map(|_| {
            let z: f64 = StandardNormal.sample(&mut rng);
            0.3 + 0.5 * z
        })
        .collect();
    for (prior, mean0, precision0) in [(gaussian, 1.0, 1.0 / 0.64), (flat, 0.0, 0.0)] {
        for n in [1, 4, 25, 100, 400] {
            let each: Vec<Posterior> = data[..n].iter().map(|&d| from_datum(&prior, d)).collect();
            let all = Posterior::product(&each).unwrap();
            let precision = precision0 + 4.0 * n as f64;
            let mean = (mean0 * precision0 + 4.0 * data[..n].iter().sum::<f64>()) / precision;
            assert!((all.mixture().mean()[0] - mean).abs() < 1e-9, "{n}");
            assert!((all.mixture().covariance()[0] * precision - 1.0).abs() < 1e-9, "{n}");
        }
    }
}

/// Two humps in each posterior, one of them common: the product keeps the common one.
#[test]
fn a_product_finds_the_common_hump() {
    let prior = Prior::uniform(&[[-10.0, 10.0]]).unwrap();
    let hump = |other: f64| {
        let means = Points::from_values(1, vec![1.0, other]).unwrap();
        let mixture = Mixture::new(&[0.5, 0.5], &means, &[vec![0.09], vec![0.09]]).unwrap();
        Posterior::new(prior.clone(), mixture).unwrap()
    };
    let all = Posterior::product(&[hump(-3.0), hump(4.0), hump(-6.0), hump(7.0)]).unwrap();
    assert!((all.mixture().mean()[0] - 1.0).abs() < 1e-6);
    assert!((all.mixture().covariance()[0] - 0.09 / 4.0).abs() < 1e-6);
}

#[test]
fn a_product_that_is_no_density_is_an_error() {
    let prior = Prior::new(vec![Marginal::Normal { mean: 0.0, sd: 1.0 }]).unwrap();
    let wide = Mixture::new(&[1.0], &Points::from_values(1, vec![0.0]).unwrap(), &[vec![4.0]]).unwrap();
    let each = vec![Posterior::new(prior, wide).unwrap(); 3];
    assert!(matches!(Posterior::product(&each), Err(Error::ImproperProduct { count: 3 })));
}

#[test]
fn wrong_mixtures_are_errors() {
    let one = Points::from_values(2, vec![0.0, 0.0]).unwrap();
    let singular = Mixture::new(&[1.0], &one, &[vec![1.0, 1.0, 1.0, 1.0]]);
    assert!(matches!(singular, Err(Error::NotPositiveDefinite { component: 0 })));
    assert!(matches!(Mixture::new(&[0.0], &one, &[vec![1.0, 0.0, 0.0, 1.0]]), Err(Error::Setting { .. })));
    assert!(matches!(two().marginal(&[0, 0]), Err(Error::Indices { .. })));
    assert!(matches!(two().conditional(&[0, 1], &[0.0, 0.0]), Err(Error::Indices { .. })));
    assert!(matches!(two().ln_density(&[0.0]), Err(Error::Length { .. })));
}

/// A standard normal: its 90 % region and interval are known.
#[test]
fn regions_of_highest_density_are_the_known_ones() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let prior = Prior::uniform(&[[-50.0, 50.0]]).unwrap();
    let means = Points::from_values(1, vec![-10.0, 10.0]).unwrap();
    let humps =
        Posterior::new(prior.clone(), Mixture::new(&[1.0, 1.0], &means, &[vec![1.0], vec![1.0]]).unwrap())
            .unwrap();
    let intervals = humps.intervals(0, 0.9, &mut rng).unwrap();
    assert_eq!(intervals.len(), 2, "{intervals:?}");
    for (interval, centre) in intervals.iter().zip([-10.0, 10.0]) {
        assert!((interval[0] - centre + 1.645).abs() < 0.15 && (interval[1] - centre - 1.645).abs() < 0.15);
    }
    let region = humps.highest_density(0.9, 20_000, &mut rng).unwrap();
    let expected = humps.ln_density(&[10.0 + 1.645]).unwrap();
    assert!((region.ln_threshold - expected).abs() < 0.05);
}
