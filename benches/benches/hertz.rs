//! Fits of a curve of 2,000 samples, a relaxing history, and single forces; how far the fitted modulus is off stands beside.
#![allow(missing_docs, reason = "criterion's macros make undocumented functions")]
#![allow(clippy::print_stdout, reason = "quality stands beside time")]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use hertz_contact::fit::{Curve, Fit, LayerBelow, Loss, Noise, Workspace};
use hertz_contact::indenter::Indenter;
use hertz_contact::law::{Base, Elastic, Indentation, Law, Layer};
use hertz_contact::viscoelastic::{Contact, LinearSolid, Scratch};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const SPHERE: Indenter = Indenter::Sphere { radius_m: 0.01 };
const MODULUS_PA: f64 = 1e4;
const ROWS: usize = 2000;

fn fits(c: &mut Criterion) {
    let law = Elastic { indenter: SPHERE, modulus_pa: MODULUS_PA, poisson_ratio: 0.5 };
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut noise = || -> f64 { 4e-4 * Distribution::<f64>::sample(&StandardNormal, &mut rng) };
    let stage: Vec<f64> = (0..ROWS).map(|i| 1.5e-3 * i as f64 / ROWS as f64).collect();
    let force: Vec<f64> = stage.iter().map(|d| law.force(d - 0.4e-3) + noise()).collect();
    let curve = [Curve { indentation_m: &stage, force_n: &force, sigma_n: None }];
    let least_squares = Fit { loss: Loss::Square, ..Fit::new(SPHERE, 0.5) };
    let Ok(layer) = Layer::new(&SPHERE, 0.5, Base::Bonded) else { return };
    let mut group = c.benchmark_group("hertz/fit");
    for (name, fit) in [
        ("least squares", least_squares),
        ("Tukey", Fit::new(SPHERE, 0.5)),
        ("noise that grows", Fit { noise: Noise::Proportional, ..least_squares }),
        (
            "on a layer",
            Fit { layer: Some(LayerBelow { layer, inverse_thickness_per_m: 1.0 / 0.02 }), ..least_squares },
        ),
    ] {
        let mut workspace = Workspace::new();
        if let Ok(report) = fit.run(&curve, &mut workspace) {
            let (low, high) = report.modulus_interval_pa;
            println!("hertz/{name}: {:.0} Pa ({low:.0} to {high:.0}) of {MODULUS_PA:.0}", report.modulus_pa);
        }
        group.bench_function(BenchmarkId::new(name, ROWS), |b| {
            b.iter(|| fit.run(black_box(&curve), &mut workspace));
        });
    }
    group.finish();
}

fn laws(c: &mut Criterion) {
    let elastic = Indentation::elastic(SPHERE, MODULUS_PA, 0.5);
    let sticky = Indentation { work_of_adhesion_j_m2: 0.05, ..elastic };
    let given = Indentation { compliance_m_n: 1e-4, ..elastic };
    let mut group = c.benchmark_group("hertz/force");
    for (name, law) in [("elastic", elastic), ("adhesion", sticky), ("load cell that gives", given)] {
        group.bench_function(name, |b| b.iter(|| law.force(black_box(1e-3))));
    }
    group.finish();
    // In, held with a tremble, out.
    let times: Vec<f64> = (0..ROWS).map(|i| 1e-3 * i as f64).collect();
    let depth = |i: usize| match i {
        0..500 => 2e-6 * i as f64,
        500..1500 => 1e-3 + 1e-7 * (0.7 * i as f64).sin(),
        _ => 1e-3 - 2e-6 * (i - 1500) as f64,
    };
    let depths: Vec<f64> = (0..ROWS).map(depth).collect();
    let solid = LinearSolid { relaxed_fraction: 0.4, tau_s: 0.3 };
    let (mut scratch, mut out) = (Scratch::new(), vec![0.0; ROWS]);
    c.bench_function("hertz/relaxing history/2000", |b| {
        b.iter(|| {
            solid.forces(&elastic, Contact::Shrinks, black_box(&times), &depths, &mut scratch, &mut out)
        });
    });
}

criterion_group!(benches, fits, laws);
criterion_main!(benches);
