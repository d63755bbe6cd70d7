//! Flights in the plane of one camera's picture: `x_m` and `z_m`, as most videos of a laboratory have them.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::fmt::Write as _;

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, Normal};
use serde_json::Value;

use super::simulated::{answer_in, assert_named, follow, interval};

/// What bends a flight beside gravity, and the picture.
#[derive(Clone, Copy, Default)]
struct Hidden {
    drag_per_m: f64,
    wind_m_s: f64,
    lift_per_s: f64,
    tilt_rad: f64,
}

/// What is said of five throws that a camera sees to 3 mm.
fn diagnosed(hidden: Hidden) -> Value {
    let noise = Normal::new(0.0, 3e-3).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let mut data = String::from("run,t_s,x_m,z_m\n");
    for (run, [along, up]) in
        [[6.0, 5.0], [4.0, 7.0], [8.0, 4.0], [3.0, 8.0], [7.0, 6.0]].into_iter().enumerate()
    {
        let mut x = [0.0, 1.5, along, up];
        for i in 0..60 {
            let (sin, cos) = hidden.tilt_rad.sin_cos();
            let [seen_x, seen_z] = [cos * x[0] + sin * x[1], cos * x[1] - sin * x[0]]
                .map(|place| place + noise.sample(&mut rng));
            writeln!(data, "{run},{:.3},{seen_x:.5},{seen_z:.5}", 0.02 * f64::from(i)).unwrap();
            follow(&mut x, 0.02, 4, |[_, _, u, w]| {
                let air = [u - hidden.wind_m_s, *w];
                let drag = hidden.drag_per_m * air[0].hypot(air[1]);
                let lift = hidden.lift_per_s;
                [*u, *w, lift * w - drag * air[0], -lift * u - drag * air[1] - 9.806_65]
            });
        }
    }
    answer_in("trajectory", "", &data)
}

#[test]
fn a_flight_in_a_vacuum_is_adequate() {
    let answer = diagnosed(Hidden::default());
    assert_eq!(answer["verdict"], "adequate");
    let unsure = answer["undetermined"].to_string();
    assert!(unsure.contains("one camera does not see"), "{unsure}");
}

#[test]
fn what_bends_a_flight_in_the_picture_is_named() {
    let magnus = diagnosed(Hidden { lift_per_s: 0.1, ..Hidden::default() });
    assert_named(&magnus, &[("magnus-lift", 0.1)]);
    let two = diagnosed(Hidden { drag_per_m: 0.02, tilt_rad: -0.02, ..Hidden::default() });
    assert_named(&two, &[("quadratic-drag", 0.02), ("camera-tilt", -0.02)]);
}

/// A wind is felt through the drag of the air, which is at work without a name of its own: its size is that beside the wind.
#[test]
fn the_drag_beside_a_wind_has_its_size() {
    let answer = diagnosed(Hidden { drag_per_m: 0.03, wind_m_s: 3.0, ..Hidden::default() });
    assert_named(&answer, &[("wind", 3.0)]);
    let drag = interval(&answer, "quadratic-drag");
    assert!(drag.contains(&0.03) && drag.end - drag.start < 0.005, "{drag:?}");
}
