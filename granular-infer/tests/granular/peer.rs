//! Speed and shape of a pour for which numbers of another simulator are known.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use crate::common;
use granular_infer::campaign::MODULUS_PA;
use granular_infer::dem::{Funnel, Law, Pour, Rest};

/// Followed to its end, at the peers' step.
fn scene() -> Pour {
    let pour = common::pour(2000);
    Pour {
        funnel: Funnel { tube_radius_m: 0.04, outlet_height_m: 0.12, ..pour.funnel },
        step_s: Some(5e-5),
        rest: Some(Rest { kinetic_j: 1e-300, hold_s: 1.0 }),
        most_s: 2.5,
        ..pour
    }
}

/// The same in the setting that campaigns use: softer, at the longest stable step, until it rests.
fn campaign() -> Pour {
    let law = Law::Hertz { modulus_pa: MODULUS_PA, poisson_ratio: 0.25 };
    Pour { law, step_s: None, rest: None, ..scene() }
}

/// Seconds that this thread has run, or not a number where the system does not say.
fn cpu_s() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).map_or(f64::NAN, |ns| 1e-9 * ns)
}

fn mean_sd(values: &[f64]) -> String {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    format!("{mean:.2} +- {:.2}", square.sqrt())
}

/// Prints; LIGGGHTS takes 25 CPU s a seed and has mean radius 33.9 mm, height 23.5 mm.
#[test]
#[ignore = "by hand: a time depends on the machine"]
fn peer_scene() {
    for (name, pour) in [("fine", scene()), ("campaign", campaign())] {
        let (mut seconds, mut numbers) = (Vec::new(), [const { Vec::new() }; 4]);
        for seed in 1..=6 {
            let start = cpu_s();
            let poured = pour.run(seed).unwrap();
            seconds.push(cpu_s() - start);
            let heap = poured.heap().unwrap();
            let mm = [heap.mean_radius_m, heap.median_radius_m, heap.mean_height_m, heap.height_m];
            numbers.iter_mut().zip(mm).for_each(|(list, m)| list.push(1e3 * m));
        }
        let [mean, median, centre, top] = numbers.each_ref().map(|list| mean_sd(list));
        println!(
            "{name}: {} CPU s; mm: mean radius {mean}, median {median}, mean height {centre}, top {top}",
            mean_sd(&seconds)
        );
    }
}
