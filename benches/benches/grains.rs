//! A picture of a heap of 600 grains, from rendering to the 16 statistics, and the posterior at them; a pour.
#![allow(missing_docs, reason = "criterion's macros make undocumented functions")]
#![allow(clippy::print_stdout, reason = "quality stands beside time")]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use granular_infer::posterior::GrainPosterior;
use granular_infer::scene::{COUSCOUS, Scene};
use granular_infer::summary::distance_correlation;
use granular_infer::view::View;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn grains(c: &mut Criterion) {
    let (scene, view) = (Scene::default(), View::default());
    let Ok(heap) = scene.grains(&COUSCOUS, 0.12, 1) else { return };
    let dice = || ChaCha8Rng::seed_from_u64(1);
    let mut group = c.benchmark_group("grains");
    group.sample_size(20);
    group.bench_function("look/256x256", |b| b.iter(|| view.look(black_box(&heap), &scene.rig, &mut dice())));
    let Ok((map, coloured)) = view.look(&heap, &scene.rig, &mut dice()) else { return };
    let statistics = || view.statistics(black_box(&map), &coloured, scene.rig.diameter_m);
    group.bench_function("statistics/256x256", |b| b.iter(statistics));
    let x: Vec<f64> = (0..10_000).map(|i| f64::from(i).sin()).collect();
    let y: Vec<f64> = x.iter().rev().copied().collect();
    group
        .bench_function("distance correlation/10000", |b| b.iter(|| distance_correlation(black_box(&x), &y)));
    if let (Ok(posterior), Ok(statistics)) = (GrainPosterior::shipped(), statistics()) {
        group.bench_function("posterior/draws of 4000", |b| {
            b.iter(|| posterior.infer(black_box(&statistics)).and_then(|i| i.estimate()));
        });
        if let Ok(estimate) = posterior.infer(&statistics).and_then(|i| i.estimate()) {
            println!("grains/posterior: {estimate:?} of {COUSCOUS:?}");
        }
    }
    group.sample_size(10);
    group.bench_function("pour/600", |b| b.iter(|| scene.grains(black_box(&COUSCOUS), 0.12, 1)));
    group.finish();
}

criterion_group!(benches, grains);
criterion_main!(benches);
