//! The funnel's filling.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use crate::common;
use approx::assert_relative_eq;
use granular_infer::dem::{Funnel, Pour};

fn pour() -> Pour {
    Pour {
        size_variation: 0.2,
        funnel: Funnel {
            outlet_radius_m: 0.012,
            cone_half_angle_rad: 0.7,
            tube_radius_m: 0.025,
            outlet_height_m: 0.1,
            axis_m: [0.01, -0.02],
        },
        most_s: 1.0,
        ..common::pour(600)
    }
}

/// No overlap, no grain through the cone or the tube, and the sizes that were asked for.
#[test]
fn grains_start_free_of_each_other_and_of_the_funnel() {
    let pour = pour();
    let s = pour.filled(3).unwrap();
    let radii: Vec<f64> = s.radii_m().collect();
    let places: Vec<_> = s.positions_m().collect();
    for i in 0..places.len() {
        for j in 0..i {
            let d: f64 = (0..3).map(|k| (places[i][k] - places[j][k]).powi(2)).sum::<f64>().sqrt();
            assert!(d > radii[i] + radii[j]);
        }
        let r = (places[i][0] - 0.01).hypot(places[i][1] + 0.02);
        let height = places[i][2] - 0.1;
        assert!(height > radii[i] && r + radii[i] < 0.025);
        let (sine, cosine) = 0.7_f64.sin_cos();
        assert!((0.012 - r) * cosine + height * sine > radii[i], "grain {i} is in the cone");
    }
    let mean = radii.iter().sum::<f64>() / 600.0;
    let spread = (radii.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / 599.0).sqrt();
    // Four standard errors: 0.2/sqrt(600) of the mean, 1/sqrt(1200) of the spread (a little more for a log-normal).
    assert_relative_eq!(mean, 2e-3, max_relative = 0.033);
    assert_relative_eq!(spread / mean, 0.2, max_relative = 0.13);
}

/// While the gate is there nothing leaves; once it is open everything lies on the ground.
#[test]
fn the_gate_holds_and_then_lets_go() {
    let mut s = pour().filled(4).unwrap();
    s.run((0.3 / s.step_s()) as u64).unwrap();
    assert!(s.positions_m().all(|p| p[2] > 0.1));
    let poured = Pour { count: 150, most_s: 4.0, ..pour() }.run(4).unwrap();
    assert!(poured.at_rest && poured.positions_m.iter().all(|p| p[2] < 0.05 && p[2] > 0.0));
}
