//! The checks of a posterior pass for an exact one, and each fails for one that is wrong in its way.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use bayes_sim::calibration::{expected_coverage, local_c2st, predictive_check, sbc_ranks, tarp};
use bayes_sim::campaign::{SimulationFailure, Simulator};
use bayes_sim::error::Error;
use bayes_sim::novelty::Novelty;
use bayes_sim::points::Points;
use bayes_sim::posterior::ConditionalDensity;
use bayes_sim::prior::{Marginal, Prior};
use bayes_sim::simulations::Simulations;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Two means under standard normal priors, seen with noise 1: the posterior is normal about x / 2 with variance 1/2; this one may be
/// off by a factor in width and by a shift.
struct Conjugate {
    prior: Prior,
    width: f64,
    shift: f64,
}

impl Conjugate {
    fn new(width: f64, shift: f64) -> Self {
        Self { prior: Prior::new(vec![Marginal::Normal { mean: 0.0, sd: 1.0 }; 2]).unwrap(), width, shift }
    }
}

impl ConditionalDensity for Conjugate {
    fn prior(&self) -> &Prior {
        &self.prior
    }

    fn x_dim(&self) -> usize {
        2
    }

    fn ln_density(&self, theta: &[f64], x: &[f64]) -> Result<f64, Error> {
        let sd = self.width * 0.5_f64.sqrt();
        Ok(theta.iter().zip(x).map(|(t, x)| -0.5 * ((t - 0.5 * x - self.shift) / sd).powi(2) - sd.ln()).sum())
    }

    fn sample(&self, x: &[f64], count: usize, rng: &mut dyn Rng) -> Result<Points, Error> {
        let sd = self.width * 0.5_f64.sqrt();
        let values = (0..count).flat_map(|_| x.to_vec()).map(|x| {
            let z: f64 = StandardNormal.sample(rng);
            0.5 * x + self.shift + sd * z
        });
        Points::from_values(2, values.collect())
    }
}

struct Noisy;

impl Simulator for Noisy {
    fn x_dim(&self) -> usize {
        2
    }

    fn simulate(&self, theta: &[f64], rng: &mut ChaCha8Rng) -> Result<Vec<f64>, SimulationFailure> {
        Ok(theta
            .iter()
            .map(|t| {
                let z: f64 = StandardNormal.sample(rng);
                t + z
            })
            .collect())
    }
}

fn tests(count: usize, seed: u64) -> Simulations {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let prior = Conjugate::new(1.0, 0.0).prior;
    let (mut theta, mut x) = (Points::new(2), Points::new(2));
    for _ in 0..count {
        let t = prior.sample(&mut rng);
        x.push(&Noisy.simulate(&t, &mut rng).unwrap()).unwrap();
        theta.push(&t).unwrap();
    }
    Simulations::new(theta, x).unwrap()
}

#[test]
fn an_exact_posterior_passes_and_wrong_ones_fail() {
    let tests = tests(1500, 1);
    let exact = Conjugate::new(1.0, 0.0);
    assert!(sbc_ranks(&exact, &tests, 99, 1).unwrap().p_values().iter().all(|p| *p > 0.005));
    let coverage = expected_coverage(&exact, &tests, 200, 1).unwrap();
    // The 99.9 % quantile of the statistic is 1.95 / sqrt(1500) = 0.05.
    assert!(coverage.largest_error() < 0.05 && coverage.mean_error().abs() < 0.025);
    assert!(tarp(&exact, &tests, 200, 1).unwrap().largest_error() < 0.05);

    let narrow = Conjugate::new(0.7, 0.0);
    assert!(sbc_ranks(&narrow, &tests, 99, 1).unwrap().p_values().iter().all(|p| *p < 1e-6));
    assert!(expected_coverage(&narrow, &tests, 200, 1).unwrap().mean_error() < -0.1);
    assert!(tarp(&narrow, &tests, 200, 1).unwrap().largest_error() > 0.06);
    let wide = Conjugate::new(1.4, 0.0);
    assert!(expected_coverage(&wide, &tests, 200, 1).unwrap().mean_error() > 0.1);
    let shifted = Conjugate::new(1.0, 0.3);
    assert!(sbc_ranks(&shifted, &tests, 99, 1).unwrap().p_values().iter().all(|p| *p < 1e-6));
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_a_local_test_tells_a_wrong_posterior_from_an_exact_one() {
    let tests = tests(600, 2);
    let exact = local_c2st(&Conjugate::new(1.0, 0.0), &tests, &[0.5, -0.5], 19, 3).unwrap();
    let wrong = local_c2st(&Conjugate::new(1.0, 0.7), &tests, &[0.5, -0.5], 19, 3).unwrap();
    assert!(exact.p_value > 0.05 && wrong.p_value <= 0.05, "{exact:?} {wrong:?}");
    assert!(wrong.statistic > exact.statistic);
}

#[test]
fn predictions_tell_an_observation_that_the_model_cannot_make() {
    let density = Conjugate::new(1.0, 0.0);
    let good = predictive_check(&density, &Noisy, &[0.4, -1.0], 2000, 1).unwrap();
    assert!(good.p_value > 0.1, "{good:?}");
    let bad = predictive_check(&density, &Noisy, &[14.0, 0.0], 2000, 1).unwrap();
    assert!(bad.p_value < 0.01 && bad.below[0] > 0.99, "{bad:?}");
}

#[test]
fn an_observation_like_no_simulation_gets_a_warning() {
    let simulations = tests(3000, 4);
    let novelty = Novelty::new(simulations.x(), 1).unwrap();
    assert!(!novelty.compare(&[0.3, -0.8]).unwrap().is_doubtful());
    let far = novelty.compare(&[9.0, 0.0]).unwrap();
    assert!(far.is_doubtful() && far.beyond == [0], "{far:?}");
    assert!(matches!(novelty.compare(&[f64::NAN, 0.0]), Err(Error::NotFinite { .. })));
    // One in a hundred false alarms, on new simulations: 3000 of them give 30 +- 5.5, and the threshold itself is learned from 1500.
    let alarms = tests(3000, 5).x().rows().filter(|x| novelty.compare(x).unwrap().is_doubtful()).count();
    assert!((5..70).contains(&alarms), "{alarms}");
}
