use bayes_sim::autoregressive::Autoregressive;
use bayes_sim::points::Points;
use bayes_sim::posterior::ConditionalDensity as _;
use bayes_sim::prior::Prior;
use bayes_sim::simulations::Simulations;
use granular_infer::posterior::settings;
use granular_infer::scene::{COUSCOUS, Grain};
use granular_infer::summary::COUNT;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use statrs::statistics::Statistics as _;

use crate::{Bench, HEIGHT_M, Outcome, spread};

/// Heaps that nothing is learned from.
const UNSEEN: usize = 50;
/// Draws whose mean is the estimate.
const DRAWS: usize = 2000;

/// Section 3.5: sliding friction as the only unknown, from 0.1 to 1, learned from few pours and from more.
pub(crate) fn print(bench: &Bench) -> Outcome<()> {
    let prior = Prior::uniform(&[[0.1, 1.0]])?;
    let unseen = bench.either(2, UNSEEN);
    let learned_from: &[usize] = if bench.small { &[50] } else { &[500, 1000] };
    let most = learned_from.iter().copied().max().unwrap_or(0);
    let mut rng = ChaCha8Rng::seed_from_u64(35);
    let drawn: Vec<f64> = (0..most + unseen).map(|_| prior.sample(&mut rng)[0]).collect();
    let poured: Vec<Option<[f64; COUNT]>> = drawn
        .par_iter()
        .enumerate()
        .map(|(i, &sliding_friction)| {
            bench.pour(&Grain { sliding_friction, ..COUSCOUS }, None, HEIGHT_M, 10_000 + i as u64)
        })
        .collect();
    let seen: Vec<Option<(f64, [f64; COUNT])>> =
        drawn.iter().zip(poured).map(|(mu, picture)| Some((*mu, picture?))).collect();
    let tests: Vec<_> = seen[most..].iter().flatten().collect();
    println!("\nSliding friction alone, over {} unseen heaps", tests.len());
    for &count in learned_from {
        let (mut theta, mut x) = (Points::new(1), Points::new(COUNT));
        for (mu, picture) in seen[..count].iter().flatten() {
            theta.push(&[*mu])?;
            x.push(picture)?;
        }
        let training = Simulations::new(theta, x)?;
        let density = Autoregressive::train(&prior, &training, &settings(), 1)?;
        let error = |(mu, picture): &&(f64, [f64; COUNT])| -> Outcome<f64> {
            let draws = density.sample(picture, DRAWS, &mut ChaCha8Rng::seed_from_u64(0))?;
            Ok(draws.column(0).mean() - mu)
        };
        let errors = tests.iter().map(error).collect::<Outcome<Vec<f64>>>()?;
        let published = match count {
            500 => "   [Matl 2021]: 0.0191 +- 0.0799",
            1000 => "   [Matl 2021]: 0.0062 +- 0.0018",
            _ => "",
        };
        println!("  learned from {:4}: {}{published}", training.len(), spread(&errors));
    }
    Ok(())
}
