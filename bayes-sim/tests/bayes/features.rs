//! Products of random features against the kernels they stand for.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use bayes_sim::kernel::{Family, Form, Kernel};
use bayes_sim::random_features::{Draw, RandomFeatures};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn pairs(dim: usize, rng: &mut ChaCha8Rng) -> Vec<(Vec<f64>, Vec<f64>)> {
    let mut point = || (0..dim).map(|_| rng.random_range(-1.0..1.0)).collect::<Vec<f64>>();
    (0..40).map(|_| (point(), point())).collect()
}

/// Root mean square difference of the features' products to a kernel.
fn error(features: &RandomFeatures, kernel: &Kernel, pairs: &[(Vec<f64>, Vec<f64>)]) -> f64 {
    let (mut a, mut b) = (vec![0.0; features.len()], vec![0.0; features.len()]);
    let squares = pairs.iter().map(|(x, y)| {
        features.write(x, &mut a);
        features.write(y, &mut b);
        let product: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
        (product / (features.len() / 2) as f64 - kernel.correlation(x, y)).powi(2)
    });
    (squares.sum::<f64>() / pairs.len() as f64).sqrt()
}

#[test]
fn features_reproduce_their_kernel_and_not_the_other_form() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let pairs = pairs(3, &mut rng);
    for family in [Family::Rbf, Family::Matern32, Family::Matern52] {
        for form in [Form::Isotropic, Form::Product] {
            let kernel = Kernel { family, form, length_scale: 0.8 };
            for draw in [Draw::Random, Draw::QuasiRandom] {
                let features = RandomFeatures::draw(&kernel, 3, 20_000, draw, &mut rng).unwrap();
                let matching = error(&features, &kernel, &pairs);
                // The standard error of a mean of 20,000 cosines is at most 0.005.
                assert!(matching < 0.01, "{kernel:?} {draw:?}: {matching}");
                if family != Family::Rbf {
                    let other = if form == Form::Product { Form::Isotropic } else { Form::Product };
                    let wrong = error(&features, &Kernel { form: other, ..kernel }, &pairs);
                    assert!(wrong > 3.0 * matching, "{kernel:?} {draw:?}: {matching} {wrong}");
                }
            }
        }
    }
}

/// At equal number a lattice is closer to the kernel than independent draws, on average over seeds.
#[test]
fn quasi_random_draws_are_closer() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let pairs = pairs(2, &mut rng);
    let kernel = Kernel { family: Family::Matern52, form: Form::Isotropic, length_scale: 1.0 };
    let mean = |draw: Draw, rng: &mut ChaCha8Rng| {
        (0..20)
            .map(|_| error(&RandomFeatures::draw(&kernel, 2, 200, draw, rng).unwrap(), &kernel, &pairs))
            .sum::<f64>()
            / 20.0
    };
    let (random, quasi) = (mean(Draw::Random, &mut rng), mean(Draw::QuasiRandom, &mut rng));
    assert!(quasi < 0.5 * random, "{quasi} {random}");
}
