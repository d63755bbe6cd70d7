//! A whole diagnosis: nothing wrong, and drag; the verdict is printed beside.
#![allow(missing_docs, reason = "criterion's macros make undocumented functions")]
#![allow(clippy::print_stdout, reason = "quality stands beside time")]

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use missing_physics::engine::{Options, diagnose};
use missing_physics::observer::Silent;
use worlds::physics::flight::{Effects, FlightWorld, Measured};

fn diagnosis(c: &mut Criterion) {
    let mut group = c.benchmark_group("diagnosis");
    group.sample_size(10);
    for (name, k) in [("null", 0.0), ("drag", 0.02)] {
        for runs in [3_usize, 9] {
            let effects = Effects { quadratic_per_m: k, ..Effects::default() };
            let world = FlightWorld { runs, effects, ..FlightWorld::thrown(Measured::Position) };
            let (model, recording) = (examples::model(world.measured), examples::recording(&world, 4));
            let run = || diagnose(&model, &recording, &[], &Options::default(), &Silent);
            if let Ok(answer) = run() {
                println!("diagnosis/{name}/{runs} runs: {} {:?}", answer.verdict.word(), answer.chosen);
            }
            group.bench_with_input(BenchmarkId::new(name, runs), &runs, |b, _| b.iter(run));
        }
    }
    group.finish();
}

criterion_group!(benches, diagnosis);
criterion_main!(benches);
