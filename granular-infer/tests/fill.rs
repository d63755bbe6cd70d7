//! The funnel's filling.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use approx::assert_relative_eq;
use granular_infer::dem::{Coefficients, Funnel, Law, Pour};

fn pour() -> Pour {
    let dry = Coefficients::dry(0.5, 0.5, 0.2);
    Pour {
        count: 600,
        diameter_m: 4e-3,
        size_variation: 0.2,
        density_kg_m3: 1300.0,
        law: Law::Hertz { modulus_pa: 5e6, poisson_ratio: 0.25 },
        grains: dry,
        ground: dry,
        funnel: Funnel {
            outlet_radius_m: 0.012,
            cone_half_angle_rad: 0.7,
            tube_radius_m: 0.025,
            outlet_height_m: 0.1,
            axis_m: [0.01, -0.02],
        },
        gravity_m_s2: [0.0, 0.0, -9.81],
        drag_per_m: 0.0,
        closed_s: 0.0,
        step_s: None,
        rest: None,
        most_s: 1.0,
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
