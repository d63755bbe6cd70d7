//! Training on 6,000 simulations of 4 features and 2 parameters, and a posterior from what was trained; the held-out loss is printed
//! beside the time. The mass of a mixture of three parameters within its prior.
#![allow(missing_docs, reason = "criterion's macros make undocumented functions")]
#![allow(clippy::print_stdout, reason = "quality stands beside time")]

use std::error::Error;
use std::hint::black_box;

use bayes_sim::mdn::{Mdn, MdnSettings, MixtureDensity};
use bayes_sim::mdrff::{Mdrff, MdrffSettings};
use bayes_sim::mixture::Mixture;
use bayes_sim::points::Points;
use bayes_sim::posterior::Posterior;
use bayes_sim::prior::Prior;
use bayes_sim::simulations::Simulations;
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Two parameters seen through four curved, noisy features.
fn simulations(prior: &Prior, count: usize) -> Result<Simulations, Box<dyn Error>> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (mut theta, mut x) = (Points::new(2), Points::new(4));
    for _ in 0..count {
        let t = prior.sample(&mut rng);
        let mut noise = || 0.1 * rng.random_range(-1.0..1.0);
        x.push(&[
            t[0] + noise(),
            t[0] * t[1] + noise(),
            (3.0 * t[1]).sin() + noise(),
            t[1] * t[1] + t[0] + noise(),
        ])?;
        theta.push(&t)?;
    }
    Ok(Simulations::new(theta, x)?)
}

fn bayes(c: &mut Criterion) {
    if let Err(error) = measured(c) {
        println!("not measured: {error}");
    }
}

fn measured(c: &mut Criterion) -> Result<(), Box<dyn Error>> {
    let prior = Prior::uniform(&[[-1.0, 1.0]; 2])?;
    let data = simulations(&prior, 6000)?;
    // One core: what is stated is stated for one.
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let (mdn, mdrff) = (MdnSettings::default(), MdrffSettings::default());
    let mut group = c.benchmark_group("train");
    group.sample_size(10);
    group.bench_with_input(BenchmarkId::new("mdn", 6000), &data, |b, data| {
        b.iter(|| one.install(|| Mdn::train(&prior, black_box(data), &mdn, 1)));
    });
    group.bench_with_input(BenchmarkId::new("mdrff", 6000), &data, |b, data| {
        b.iter(|| one.install(|| Mdrff::train(&prior, black_box(data), &mdrff, 1)));
    });
    group.finish();
    let densities: [(&str, Box<dyn MixtureDensity>); 2] = [
        ("mdn", Box::new(Mdn::train(&prior, &data, &mdn, 1)?)),
        ("mdrff", Box::new(Mdrff::train(&prior, &data, &mdrff, 1)?)),
    ];
    let mut group = c.benchmark_group("posterior");
    for (name, density) in &densities {
        let losses: Vec<f64> = density.reports().iter().map(|r| r.validation_loss).collect();
        println!("{name}: held-out losses {losses:.3?}");
        group.bench_function(BenchmarkId::new(*name, 4), |b| {
            b.iter(|| density.posterior(black_box(&[0.1, 0.2, 0.3, 0.4])));
        });
    }
    // Three parameters, a component in the box and one far outside: what every density of a cut mixture divides by.
    let means = Points::from_rows(3, [&[0.3, -0.2, 0.8], &[4.0, 2.0, 3.0]] as [&[f64]; 2])?;
    let wide = vec![0.3, 0.1, 0.05, 0.1, 0.4, 0.1, 0.05, 0.1, 0.2];
    let mixture = Mixture::new(&[0.9, 0.1], &means, &[wide.clone(), wide])?;
    let prior = Prior::uniform(&[[-1.0, 1.0]; 3])?;
    group.bench_function(BenchmarkId::new("mass", 3), |b| {
        b.iter(|| Posterior::new(prior.clone(), black_box(&mixture).clone()).map(|p| p.mass()));
    });
    group.finish();
    Ok(())
}

criterion_group!(benches, bayes);
criterion_main!(benches);
