//! Posteriors over (e, log10 kappa): the exact one is calibrated, the learned one comes near it.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use bayes_sim::campaign::Simulator;
use bayes_sim::mdn::{Mdn, MdnSettings, MixtureDensity};
use bayes_sim::points::Points;
use bayes_sim::simulations::Simulations;
use bounce_audio::drop::each;
use bounce_audio::exact::{ExactModel, exact_posterior};
use bounce_audio::features::{Features, Scale};
use bounce_audio::posterior::{BOUNDS, DropSimulator, marginal_peak, prior, projected_product};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn model(simulator: &DropSimulator) -> ExactModel {
    ExactModel::new(simulator.release.position_m[2], simulator.release.velocity_sigma_m_s, 9.80665).unwrap()
}

/// Drops of balls from the prior.
fn drawn(simulator: &DropSimulator, count: usize, seed: u64) -> Vec<([f64; 2], Features)> {
    let prior = prior().unwrap();
    each(count, seed, |_, rng| {
        let theta = prior.sample(rng);
        ([theta[0], theta[1]], simulator.features(&theta, rng).unwrap())
    })
}

/// Simulation-based calibration: under the exact posterior the truth's rank is uniform. A wrong factor anywhere in the likelihood that
/// depends on e or kappa would bend it.
#[test]
fn the_exact_posterior_is_calibrated() {
    let simulator = DropSimulator::new();
    let model = model(&simulator);
    for first in [1, 2] {
        let drawn = drawn(&simulator, 150, first);
        let ranks: Vec<[f64; 2]> = each(drawn.len(), 0, |i, _| {
            let (theta, x) = &drawn[i];
            let posterior = exact_posterior(&model, &[*x], BOUNDS).unwrap();
            [posterior.below(0, theta[0]), posterior.below(1, theta[1])]
        });
        for k in 0..2 {
            let mut u: Vec<f64> = ranks.iter().map(|r| r[k]).collect();
            u.sort_by(f64::total_cmp);
            let n = u.len() as f64;
            let far = u.iter().enumerate().map(|(i, u)| (u - (i as f64 + 0.5) / n).abs()).fold(0.0, f64::max);
            println!("parameter {k}: distance from uniform {far:.3}");
            assert!(far < 1.63 / n.sqrt(), "parameter {k}: ranks are {far} from uniform");
        }
    }
}

/// Many drops of one ball: the posterior contracts about the truth.
#[test]
fn a_hundred_drops_pin_the_ball_down() {
    let simulator = DropSimulator::new();
    let model = model(&simulator);
    for (k, theta) in [[0.75, 3.2], [0.9, 1.6]].into_iter().enumerate() {
        let drops: Vec<Features> = each(100, k as u64, |_, rng| simulator.features(&theta, rng).unwrap());
        let posterior = exact_posterior(&model, &drops, BOUNDS).unwrap();
        let (mean, sigma) = (posterior.mean(), posterior.sigma());
        println!("{theta:?}: {mean:.6?} +- {sigma:.6?}");
        for i in 0..2 {
            assert!((mean[i] - theta[i]).abs() < 4.0 * sigma[i], "{mean:?} +- {sigma:?} of {theta:?}");
        }
        assert!(sigma[0] < 1e-3 && sigma[1] < 0.1, "{sigma:?}");
    }
    // No ball of the box drops so.
    let odd = Features { time_ratio: 1.5, d1_m: 0.1, d2_m: 0.4, alpha_rad: 0.1 };
    assert!(exact_posterior(&model, &[odd], BOUNDS).is_none());
}

/// Trained on few simulations, in logarithms: near the truth, never better than the exact posterior, and its product contracts.
#[test]
fn a_learned_posterior_comes_near_the_exact_one() {
    let simulator = DropSimulator { scale: Scale::Logarithms, ..DropSimulator::new() };
    let model = model(&simulator);
    let train = drawn(&simulator, 1_500, 3);
    let (mut theta, mut x) = (Points::new(2), Points::new(simulator.x_dim()));
    for (t, f) in &train {
        theta.push(t).unwrap();
        x.push(&f.numbers(simulator.observed, simulator.scale)).unwrap();
    }
    let mut settings = MdnSettings { members: 1, ..MdnSettings::default() };
    settings.training.max_epochs = 150;
    let data = Simulations::new(theta, x).unwrap();
    let density = Mdn::train(&prior().unwrap(), &data, &settings, 1).unwrap();

    let tests = drawn(&simulator, 100, 4);
    let (mut off, mut learned, mut exact) = ([0.0; 2], 0.0, 0.0);
    for (t, f) in &tests {
        let posterior = density.posterior(&f.numbers(simulator.observed, simulator.scale)).unwrap();
        for (k, off) in off.iter_mut().enumerate() {
            *off += (marginal_peak(&posterior, k).unwrap() - t[k]).abs() / 100.0;
        }
        learned += posterior.ln_density(t).unwrap() / 100.0;
        exact += exact_posterior(&model, &[*f], BOUNDS).unwrap().ln_density(&model, &[*f], *t) / 100.0;
    }
    println!("mean errors {off:.4?}; mean log density at the truth: learned {learned:.2}, exact {exact:.2}");
    // A guess of the prior's middle is off by 0.1 and 1.
    assert!(off[0] < 0.02 && off[1] < 0.45, "{off:?}");
    assert!(exact > learned, "nothing beats the exact posterior: {exact} and {learned}");

    let ball = [0.8, 2.5];
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let posteriors: Vec<_> =
        (0..40).map(|_| density.posterior(&simulator.simulate(&ball, &mut rng).unwrap()).unwrap()).collect();
    let spread = |n: usize| projected_product(&posteriors[..n]).unwrap().mixture().covariance();
    let (few, many) = (spread(10), spread(40));
    for k in [0, 3] {
        assert!(many[k] < few[k], "{many:?} and {few:?}");
    }
}

#[test]
fn nonsense_is_an_error() {
    for (h, sigma, g) in [(0.0, 0.1, 9.8), (0.26, 0.0, 9.8), (0.26, 0.1, f64::NAN), (-1.0, 0.1, 9.8)] {
        assert!(ExactModel::new(h, sigma, g).is_err(), "{h} {sigma} {g}");
    }
    let simulator = DropSimulator::new();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for theta in [&[0.8][..], &[1.2, 2.0], &[0.8, f64::NAN], &[0.0, 2.0]] {
        assert!(simulator.simulate(theta, &mut rng).is_err(), "{theta:?}");
    }
}
