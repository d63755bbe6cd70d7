//! A flight of 20, 100 and 500 rows: closed form and integrated; the error against a tighter sampling is printed beside.
#![allow(missing_docs, reason = "criterion's macros make undocumented functions")]
#![allow(clippy::print_stdout, reason = "quality stands beside time")]

use std::hint::black_box;

use bounce_audio::flight::{Flight, State};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};

fn flight(c: &mut Criterion) {
    let start = State { position: [0.0, 0.0, 1.5], velocity: [6.0, 1.0, 4.0] };
    let mut drag = Flight::ballistic(9.80665);
    drag.quadratic_per_m = 0.02;
    let mut linear = Flight::ballistic(9.80665);
    linear.linear_per_s = 0.1;
    let mut group = c.benchmark_group("flight");
    for rows in [20_usize, 100, 500] {
        let times: Vec<f64> = (0..rows).map(|i| i as f64 / rows as f64).collect();
        let mut out = vec![start; rows];
        for (name, flight) in [("quadratic", &drag), ("linear", &linear)] {
            group.bench_with_input(BenchmarkId::new(name, rows), &rows, |b, _| {
                b.iter(|| flight.states(black_box(&start), &times, &mut out));
            });
        }
        let dense: Vec<f64> = (0..=100 * (rows - 1)).map(|i| i as f64 / (100 * rows) as f64).collect();
        let mut fine = vec![start; dense.len()];
        if drag.states(&start, &times, &mut out).is_ok() && drag.states(&start, &dense, &mut fine).is_ok() {
            let last = rows - 1;
            let error = (0..3)
                .map(|i| f64::abs(out[last].position[i] - fine[100 * last].position[i]))
                .fold(0.0, f64::max);
            println!("flight/quadratic/{rows}: largest difference to steps 100 times finer: {error:.1e} m");
        }
    }
    group.finish();
}

criterion_group!(benches, flight);
criterion_main!(benches);
