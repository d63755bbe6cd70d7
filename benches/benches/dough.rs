//! Dough: features of 100k points, refit, one predicted step, plans of ten rolls, a step of control; quality printed beside.
#![allow(missing_docs, reason = "criterion's macros make undocumented functions")]
#![allow(clippy::print_stdout, reason = "quality stands beside time")]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use dough_mbrl::dough::View;
use dough_mbrl::fake::{DoughKind, Effects};
use dough_mbrl::goal::Goal;
use dough_mbrl::mpc::{Mpc, MpcSettings};
use dough_mbrl::planner::cem::Cem;
use dough_mbrl::planner::powell::PowellPlanner;
use dough_mbrl::planner::{Chance, Objective, Planner, Task, VarianceGrowth};
use dough_mbrl::policy::Policy;
use dough_mbrl::predictor::{Predictor, Refit};
use dough_mbrl::ridge::Ridge;
use dough_mbrl::roll::{Limits, Roll};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A half cylinder of 100 by 30 mm on a table, one point in ten on it.
fn cloud(points: usize) -> Vec<[f64; 3]> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut uniform = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
    (0..points)
        .map(|i| {
            let noise = uniform(-6e-4, 6e-4);
            if i % 10 == 0 {
                let x = uniform(-0.015, 0.015);
                [x, uniform(-0.05, 0.05), 0.015 + (0.015_f64.powi(2) - x * x).sqrt() + noise]
            } else {
                [uniform(-0.2, 0.2), uniform(-0.15, 0.15), noise]
            }
        })
        .collect()
}

fn dough(c: &mut Criterion) {
    let cloud = cloud(100_000);
    let view = View::default();
    if let Ok(shape) = view.find(&cloud) {
        println!("dough/features: {:.1?} mm of [100, 30, 30]", shape.state().map(|v| 1e3 * v));
    }
    c.bench_function("dough/features/100000", |b| b.iter(|| view.find(black_box(&cloud))));

    let Ok(doughs) = examples::dough::explore(DoughKind::A, Effects::default(), 600, usize::MAX, 1) else {
        return;
    };
    let rolls: Vec<Roll> = examples::dough::rolls(&doughs);
    let Ok(ridge) = Ridge::learn(&rolls, 2, 1e-3) else { return };
    let (state, action) = ([0.09, 0.026, 0.026], [0.09, 0.015]);
    c.bench_function("dough/predict/degree2", |b| {
        b.iter(|| ridge.next(black_box(&state), black_box(&action)))
    });
    c.bench_function("dough/predict_with_spread/degree2", |b| {
        b.iter(|| ridge.predict(black_box(&state), black_box(&action)));
    });
    let mut growing = ridge.clone();
    c.bench_function("dough/refit/one_more_roll", |b| {
        b.iter(|| growing.add(black_box(&rolls[0]), 10.0).and_then(|()| growing.refit()));
    });

    let Ok(goal) = Goal::cylinder(0.2, 4e-5) else { return };
    let task =
        Task { dynamics: &ridge, state, goal, limits: Limits::default(), objective: Objective::default() };
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut costs = [0.0; 2];
    let (mut cem, mut powell) = (Cem::default(), PowellPlanner::default());
    let mut plan = Vec::new();
    c.bench_function("dough/cem/10", |b| {
        b.iter(|| {
            plan.clear();
            costs[0] = cem.plan(black_box(&task), &mut plan, &mut rng).unwrap_or(f64::NAN);
        });
    });
    c.bench_function("dough/powell/10", |b| {
        b.iter(|| {
            plan.clear();
            costs[1] = powell.plan(black_box(&task), &mut plan, &mut rng).unwrap_or(f64::NAN);
        });
    });
    plan.clear();
    plan.resize(task.len(), 0.5);
    println!(
        "dough: cost of the plan: middle {:.3}, CEM {:.3}, Powell {:.3}",
        task.cost(&plan),
        costs[0],
        costs[1]
    );
    let Ok(growth) = VarianceGrowth::of(&ridge, &rolls) else { return };
    c.bench_function("dough/variance_growth/600", |b| {
        b.iter(|| VarianceGrowth::of(black_box(&ridge), black_box(&rolls)));
    });
    let Ok(chance) = Chance::new(growth, 0.01) else { return };
    let constrained = Task { objective: Objective::constrained(chance), ..task };
    c.bench_function("dough/powell_chance/10", |b| {
        b.iter(|| {
            plan.clear();
            powell.plan(black_box(&constrained), &mut plan, &mut rng)
        });
    });
    let Ok(mut mpc) = Mpc::new(ridge.clone(), PowellPlanner::default(), MpcSettings::default()) else {
        return;
    };
    c.bench_function("dough/mpc_step/powell", |b| {
        b.iter(|| mpc.act(black_box(&state), &goal, &Limits::default(), &mut rng));
    });
}

criterion_group!(benches, dough);
criterion_main!(benches);
