//! A depth picture of 640 x 480 pixels to cloud, curvature and segments, all of it membrane; the ball's radius is printed beside.
#![allow(missing_docs, reason = "criterion's macros make undocumented functions")]
#![allow(clippy::print_stdout, reason = "quality stands beside time")]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use stretch::cloud::{Cloud, CloudSettings, Rest, Window};
use stretch::contact::{ball, points};
use stretch::fake::{DepthEye, Membrane, Shape, Sheet};
use stretch::segment::{SegmentSettings, Segmenter};

fn stretch(c: &mut Criterion) {
    // A sheet that fills the picture: 340 x 250 mm at 0.25 m.
    let sheet = Sheet { length_m: 0.36, breadth_m: 0.27, ..Sheet::matl_2021() };
    let mut membrane = Membrane::new(sheet, 0.0);
    membrane.press(&Shape::Ball { radius_m: 0.03 }, [0.0; 2], 0.02);
    let eye = DepthEye::sr305();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (Ok(picture), Ok(rest)) = (eye.picture(&membrane, &mut rng), Rest::level(eye.distance_m)) else {
        return;
    };
    let window = Window::whole(&picture);
    let (cloud_settings, segment_settings) = (CloudSettings::default(), SegmentSettings::default());
    let (mut cloud, mut segmenter) = (Cloud::default(), Segmenter::default());
    let mut group = c.benchmark_group("stretch");
    group.bench_function(BenchmarkId::new("cloud and segments", "640x480"), |b| {
        b.iter(|| {
            let filled = cloud.fill(black_box(&picture), &eye.intrinsics, &rest, window, &cloud_settings);
            filled.is_ok() && !segmenter.segment(&cloud, &segment_settings).is_empty()
        });
    });
    let touching = points(&cloud, &segmenter.states);
    if let Ok(b) = ball(&touching) {
        println!(
            "stretch/ball: {:.2} +- {:.2} mm of 30 from {} points",
            1e3 * b.radius_m,
            1e3 * b.radius_sigma_m,
            touching.len()
        );
    }
    group.bench_function(BenchmarkId::new("ball", touching.len()), |b| b.iter(|| ball(black_box(&touching))));
    group.finish();
}

criterion_group!(benches, stretch);
criterion_main!(benches);
