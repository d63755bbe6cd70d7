//! Speed and shape of a pour for which numbers of another simulator are known.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use granular_infer::dem::{Coefficients, Funnel, Law, Pour, Rest};

fn scene() -> Pour {
    let dry = Coefficients::dry(0.5, 0.5, 0.2);
    Pour {
        count: 2000,
        diameter_m: 4e-3,
        size_variation: 0.0,
        density_kg_m3: 1300.0,
        law: Law::Hertz { modulus_pa: 5e6, poisson_ratio: 0.25 },
        grains: dry,
        ground: dry,
        funnel: Funnel {
            outlet_radius_m: 0.014,
            cone_half_angle_rad: std::f64::consts::FRAC_PI_4,
            tube_radius_m: 0.04,
            outlet_height_m: 0.12,
            axis_m: [0.0; 2],
        },
        gravity_m_s2: [0.0, 0.0, -9.81],
        drag_per_m: 0.0,
        closed_s: 0.0,
        step_s: Some(5e-5),
        rest: Some(Rest { kinetic_j: 1e-300, hold_s: 1.0 }),
        most_s: 2.5,
    }
}

/// Seconds that this thread has run, or not a number where the system does not say.
fn cpu_s() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).map_or(f64::NAN, |ns| 1e-9 * ns)
}

/// Prints; LIGGGHTS takes 25 CPU s a seed and has mean radius 33.9 mm, height 23.5 mm.
#[test]
#[ignore = "a timing, for an optimised build"]
fn peer_scene() {
    for rest in [Some(Rest { kinetic_j: 1e-300, hold_s: 1.0 }), None] {
        for seed in 1..=3 {
            let start = cpu_s();
            let poured = Pour { rest, ..scene() }.run(seed).unwrap();
            let cpu = cpu_s() - start;
            let heap = poured.heap().unwrap();
            println!(
                "seed {seed}: {cpu:.2} CPU s, mean radius {:.2} mm, median {:.2} mm, height {:.2} mm (top centre {:.2}), end {:.2} s, {:?}",
                1e3 * heap.mean_radius_m,
                1e3 * heap.median_radius_m,
                1e3 * heap.height_m,
                1e3 * heap.height_m - 2.0,
                poured.time_s,
                poured.counters
            );
        }
    }
}
