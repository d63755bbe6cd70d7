//! 640 x 480 pixels with 100 markers: finding them, following them, judging their motion; errors are printed beside.
#![allow(missing_docs, reason = "criterion's macros make undocumented functions")]
#![allow(clippy::print_stdout, reason = "quality stands beside time")]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use hw_traits::camera::Camera;
use softcell::fake::Bench;
use softcell::field::{Kernel, Plan};
use softcell::flow::{Tracker, TrackerSettings};
use softcell::markers::{MarkerSettings, find};
use softcell::shear::{MotionSettings, Moved, motion};

fn softcell(c: &mut Criterion) {
    let mut bench = Bench::matl_2021(1);
    bench.holds_box = false;
    bench.touch.indentation_m = 3e-3;
    bench.dome.cover(0.0036, 1.1);
    bench.eye.marker_m = 0.0007;
    bench.dome.markers.truncate(100);
    let (Ok(first), home) = (bench.picture(), bench.markers_px()) else { return };
    bench.touch.shear_m = [1e-3, 0.5e-3];
    let (Ok(second), truth) = (bench.picture(), bench.markers_px()) else { return };
    let Ok(tracker) = Tracker::new(&first.value, TrackerSettings::default()) else { return };
    let n = tracker.tracks().len();

    let mut group = c.benchmark_group("softcell");
    group.bench_function(BenchmarkId::new("find", n), |b| {
        b.iter(|| find(black_box(&first.value), &MarkerSettings::default()));
    });
    // There and back again: two pictures a round.
    let mut running = tracker.clone();
    group.bench_function(BenchmarkId::new("track, two pictures", n), |b| {
        b.iter(|| {
            let there = running.next(black_box(&second.value)).is_ok();
            there && running.next(black_box(&first.value)).is_ok()
        });
    });
    let mut once = tracker;
    if let Ok(tracks) = once.next(&second.value) {
        let error = |at: [f64; 2], places: &[[f64; 2]]| {
            places.iter().map(|p| (p[0] - at[0]).hypot(p[1] - at[1])).fold(f64::INFINITY, f64::min)
        };
        let mut errors: Vec<f64> = tracks.iter().map(|t| error(t.at_px, &truth)).collect();
        errors.sort_by(f64::total_cmp);
        let seen = tracks.iter().filter(|t| t.seen()).count();
        println!(
            "softcell/track: {seen} of {} markers seen, error {:.3} px median, {:.3} px worst",
            home.len(),
            errors[errors.len() / 2],
            errors[errors.len() - 1]
        );
        let moved: Vec<Moved> = tracks.iter().map(|t| Moved { home: t.home_px, by: t.by_px() }).collect();
        let settings = MotionSettings::new(0.1);
        group.bench_function(BenchmarkId::new("motion", n), |b| {
            b.iter(|| motion(black_box(&moved), &settings))
        });
        let places: Vec<[f64; 2]> = moved.iter().map(|m| m.home).collect();
        group.bench_function(BenchmarkId::new("field, plan", n), |b| {
            b.iter(|| Plan::new(black_box(&places), Kernel::ThinPlate, 0.0));
        });
    }
    group.finish();
}

criterion_group!(benches, softcell);
criterion_main!(benches);
