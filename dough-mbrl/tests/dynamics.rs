//! Dynamics learned from rolls whose law is known.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use dough_mbrl::dynamics::{Dynamics, LearnError, Roll};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const SIGMA: f64 = 4e-4;

fn law(state: [f64; 3], action: [f64; 2], cubic: f64) -> [f64; 3] {
    let [l, w, h] = state;
    let press = action[1] * (1.0 + 5.0 * (action[0] - 0.04));
    let push = 0.3 * press * (h / 0.04) + cubic * press * press * press / (0.03 * 0.03);
    [l + push, w - 0.3 * push, h - 0.4 * push * (w / 0.04)]
}

fn rolls(n: usize, cubic: f64, sigma: f64, rng: &mut ChaCha8Rng) -> Vec<Roll> {
    (0..n)
        .map(|_| {
            let state =
                [rng.random_range(0.04..0.08), rng.random_range(0.03..0.042), rng.random_range(0.028..0.042)];
            let action = [rng.random_range(0.04..0.12), rng.random_range(0.01..0.04)];
            let next = law(state, action, cubic).map(|x| {
                let z: f64 = StandardNormal.sample(rng);
                x + sigma * z
            });
            Roll { state, action, next }
        })
        .collect()
}

#[test]
fn predictions_are_off_by_as_much_as_they_say() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for cubic in [0.0, 0.5] {
        let (mut squares, mut count) = (0.0, 0.0);
        for _ in 0..20 {
            let dynamics = Dynamics::learn(&rolls(300, cubic, SIGMA, &mut rng)).unwrap();
            for roll in rolls(50, cubic, SIGMA, &mut rng) {
                for (k, p) in dynamics.predict(&roll.state, &roll.action).iter().enumerate() {
                    squares += ((roll.next[k] - p.mean) / p.sigma).powi(2);
                    count += 1.0;
                }
            }
            for sigma in dynamics.noise() {
                assert!((0.85..1.15).contains(&(sigma / SIGMA)), "{sigma}");
            }
        }
        // 3,000 standardised errors: their mean square is 1 within 4 sigma, tied errors allowed for twice over.
        let mean: f64 = squares / count;
        assert!((mean - 1.0).abs() < 0.2, "cubic {cubic}: {mean}");
    }
}

#[test]
fn what_was_not_learned_is_common_to_all_rolls() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let dynamics = Dynamics::learn(&rolls(60, 0.0, SIGMA, &mut rng)).unwrap();
    let roll = ([0.06, 0.036, 0.034], [0.08, 0.02]);
    let covariance = dynamics.covariance(0, &[roll, roll]);
    let sigma = dynamics.predict(&roll.0, &roll.1)[0].sigma / dynamics.noise()[0];
    approx::assert_relative_eq!(covariance[(0, 0)], sigma * sigma, max_relative = 1e-9);
    approx::assert_relative_eq!(covariance[(0, 1)], sigma * sigma - 1.0, max_relative = 1e-6);
    assert!(covariance[(0, 1)] > 0.01);
}

#[test]
fn too_few_rolls_and_rolls_that_are_all_alike_are_errors() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let few = rolls(30, 0.0, SIGMA, &mut rng);
    assert!(matches!(
        Dynamics::learn(&few),
        Err(LearnError::TooFew { rolls: 30, coefficients: 21, least: 42 })
    ));
    let alike = vec![few[0]; 100];
    assert!(matches!(Dynamics::learn(&alike), Err(LearnError::Undetermined { degree: 2 })));
}
