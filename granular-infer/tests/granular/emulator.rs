//! An emulator learned from samples whose law is known.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use granular_infer::campaign::{Conditions, Ranges};
use granular_infer::emulator::{Emulator, EmulatorError, Sample};
use granular_infer::statistics::{COUNT, STATISTICS, Symmetry};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A law that the emulator's terms hold only in part: exponentials, products, and what turns with the tilt.
fn law(c: &Conditions, k: usize) -> f64 {
    let base = (0.1 * k as f64 + c.sliding_friction.ln()).sin() + (5.0 * c.height_m).exp() + c.restitution;
    let [x, y] = c.tilt_rad;
    let turning = 3.0 + c.sliding_friction.ln();
    match STATISTICS[k].1 {
        Symmetry::Scalar => {
            let rods = 0.4 * (c.aspect_ratio - 1.0) * c.restitution;
            let damped = 0.5 * (-8.0 * c.rolling_damping).exp();
            base + c.size_variation.powi(2) * 3.0 - 0.5 * c.ground_ratio.ln() - rods + damped
        }
        Symmetry::Vector => turning * x,
        Symmetry::Tensor => turning * (x * x - y * y),
        Symmetry::Second if STATISTICS[k - 1].1 == Symmetry::Vector => turning * y,
        Symmetry::Second => turning * 2.0 * x * y,
    }
}

/// Spread of a sample: larger from higher up.
fn sigma(c: &Conditions) -> f64 {
    0.05 * (8.0 * c.height_m).exp()
}

fn samples(ranges: &Ranges, count: u64) -> Vec<Sample> {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    (0..count)
        .map(|pour| {
            let conditions = ranges.draw(2, pour);
            let common: f64 = StandardNormal.sample(&mut rng);
            let statistics = std::array::from_fn(|k| {
                let own: f64 = StandardNormal.sample(&mut rng);
                law(&conditions, k) + sigma(&conditions) * (0.6 * common + 0.8 * own)
            });
            Sample { conditions, blur_px2: 0.0, statistics }
        })
        .collect()
}

/// Means within a small part of the spread, spreads within a few percent, correlations as they were put in.
#[test]
fn means_spreads_and_correlations_come_back() {
    let ranges = Ranges::default();
    let emulator = Emulator::learn(&ranges, &samples(&ranges, 3000)).unwrap();
    let mut ratio = 0.0;
    let (mut squares, mut n) = (0.0, 0.0);
    for pour in 5000..5300 {
        let c = ranges.draw(2, pour);
        let (mean, spread) = (emulator.mean(&c, 0.0), emulator.sigma(&c, 0.0));
        for k in 0..COUNT {
            squares += ((mean[k] - law(&c, k)) / sigma(&c)).powi(2);
            ratio += (spread[k] / sigma(&c)).ln();
            n += 1.0;
        }
    }
    assert!(squares / n < 0.1, "mean square error of the means: {} variances", squares / n);
    assert!((ratio / n).abs() < 0.05, "spread too large by {}", ratio / n);
    for i in 1..COUNT {
        // Clipping and the pull towards independence take a little.
        let c = emulator.correlation()[(i, 0)];
        assert!((c - 0.36).abs() < 0.06, "{i}: {c}");
    }
}

/// A polynomial of the fifth degree cannot follow a wave over the whole range; where pictures count for more it does.
#[test]
fn means_are_nearest_where_pictures_count_for_most() {
    let ranges = Ranges::default();
    let wave = |c: &Conditions| (8.0 * c.sliding_friction.ln()).sin();
    let samples: Vec<Sample> = (0..2000)
        .map(|pour| {
            let conditions = ranges.draw(2, pour);
            Sample { conditions, blur_px2: 0.0, statistics: [wave(&conditions); COUNT] }
        })
        .collect();
    let off = |c: &Conditions| (c.sliding_friction / 0.4).ln();
    let whole = Emulator::learn(&ranges, &samples).unwrap();
    let near =
        Emulator::learn_weighted(&ranges, &samples, |s| (-0.5 * (off(&s.conditions) / 0.3).powi(2)).exp())
            .unwrap();
    let error = |emulator: &Emulator| {
        let here: Vec<Conditions> =
            (5000..5400).map(|pour| ranges.draw(2, pour)).filter(|c| off(c).abs() < 0.3).collect();
        let squares = here.iter().map(|c| (emulator.mean(c, 0.0)[3] - wave(c)).powi(2));
        (squares.sum::<f64>() / here.len() as f64).sqrt()
    };
    let [whole, near] = [error(&whole), error(&near)];
    println!("error {whole:.4} of all alike, {near:.4} of those that count");
    assert!(near < 0.5 * whole, "{near} and {whole}");
    let none = Emulator::learn_weighted(&ranges, &samples, |_| 0.0);
    assert!(matches!(none, Err(EmulatorError::TooFew { received: 0, .. })));
}

#[test]
fn too_few_samples_are_an_error() {
    let ranges = Ranges::default();
    let result = Emulator::learn(&ranges, &samples(&ranges, 20));
    assert!(matches!(result, Err(EmulatorError::TooFew { received: 20, .. })));
    assert!(Emulator::learn(&ranges, &[]).is_err());
}
