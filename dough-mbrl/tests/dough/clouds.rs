//! Doughs of known shape in clouds: tilt, noise, flying points, a tool, and clouds that show none.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use dough_mbrl::dough::{DoughError, Shape, View};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

struct Scene {
    length: f64,
    width: f64,
    height: f64,
    yaw: f64,
    slope: [f64; 2],
    noise: f64,
    flying: usize,
    tool: bool,
}

const PLAIN: Scene = Scene {
    length: 0.12,
    width: 0.03,
    height: 0.026,
    yaw: 0.4,
    slope: [0.0; 2],
    noise: 0.0,
    flying: 0,
    tool: false,
};

/// A box of elliptic section on a table, every 1.25 mm.
fn cloud(scene: &Scene, seed: u64) -> Vec<[f64; 3]> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (s, c) = scene.yaw.sin_cos();
    let mut points = Vec::new();
    let level = |x: f64, y: f64| 0.05 + scene.slope[0] * x + scene.slope[1] * y;
    for i in -130..=130 {
        for j in -100..=100 {
            let (x, y) = (1.25e-3 * f64::from(i), 1.25e-3 * f64::from(j));
            let (along, across) = (c * x + s * y, c * y - s * x);
            let side = across / (0.5 * scene.width);
            let inside = along.abs() <= 0.5 * scene.length && side.abs() <= 1.0;
            let up = if inside { 0.5 * scene.height * (1.0 + (1.0 - side * side).sqrt()) } else { 0.0 };
            let z: f64 = StandardNormal.sample(&mut rng);
            points.push([x, y, level(x, y) + up + scene.noise * z]);
        }
    }
    for _ in 0..scene.flying {
        let at = rng.random_range(0..points.len());
        points[at][2] += rng.random_range(0.0..0.15);
    }
    if scene.tool {
        // A hand above the dough, and a finger that stands on the table far off.
        (0..4000).for_each(|_| {
            points.push([
                rng.random_range(-0.05..0.05),
                rng.random_range(-0.05..0.05),
                0.05 + rng.random_range(0.12..0.2),
            ])
        });
        (0..300).for_each(|_| {
            points.push([
                rng.random_range(0.13..0.14),
                rng.random_range(-0.11..-0.1),
                0.05 + rng.random_range(0.0..0.09),
            ])
        });
    }
    points
}

fn found(scene: &Scene, seed: u64) -> Shape {
    View::default().find(&cloud(scene, seed)).unwrap()
}

fn close(shape: &Shape, scene: &Scene, within: [f64; 3]) {
    for (got, (truth, within)) in
        shape.state().iter().zip([scene.length, scene.width, scene.height].iter().zip(within))
    {
        assert!(
            (got - truth).abs() < within,
            "{:?}, not {} {} {}",
            shape.state(),
            scene.length,
            scene.width,
            scene.height
        );
    }
    let turned = (shape.yaw_rad - scene.yaw).sin().abs();
    assert!(turned < 0.05, "turned to {} and not {}", shape.yaw_rad, scene.yaw);
    let [x, y] = shape.highest_m;
    let across = scene.yaw.cos() * y - scene.yaw.sin() * x;
    assert!(across.abs() < 0.2 * scene.width, "highest at {:?}", shape.highest_m);
}

#[test]
fn a_dough_is_found_as_it_is() {
    for yaw in [0.0, 0.4, 1.3, -0.9] {
        let scene = Scene { yaw, ..PLAIN };
        close(&found(&scene, 1), &scene, [3e-3, 2e-3, 5e-4]);
    }
}

#[test]
fn noise_holes_tilt_flying_points_and_the_tool_change_little() {
    for seed in 0..6 {
        let scene = Scene { noise: 8e-4, flying: 120, tool: true, slope: [0.05, -0.04], ..PLAIN };
        let mut cloud = cloud(&scene, seed);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        cloud.iter_mut().filter(|_| rng.random::<f64>() < 0.1).for_each(|p| p[2] = f64::NAN);
        let shape = View::default().find(&cloud).unwrap();
        close(&shape, &scene, [5e-3, 4e-3, 1e-3]);
    }
}

#[test]
fn clouds_without_a_dough_are_said() {
    let view = View::default();
    assert_eq!(view.find(&[]), Err(DoughError::Empty { points: 0 }));
    assert_eq!(view.find(&[[f64::NAN; 3]; 9]), Err(DoughError::Empty { points: 9 }));
    let bare = Scene { length: 0.0, noise: 5e-4, ..PLAIN };
    assert!(matches!(view.find(&cloud(&bare, 1)), Err(DoughError::NoDough { .. })));
    // A wall is no table.
    let wall: Vec<[f64; 3]> = cloud(&PLAIN, 1).iter().map(|p| [p[2], p[1], p[0]]).collect();
    assert!(matches!(view.find(&wall), Err(DoughError::NoGround { .. })));
    assert_eq!(
        View { cell_m: 0.0, ..view }.find(&wall),
        Err(DoughError::View { name: "cell_m", value: 0.0 })
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn no_cloud_panics(points in prop::collection::vec(prop::array::uniform3(prop::num::f64::ANY), 0..200)) {
        let _ = View::default().find(&points);
    }

    #[test]
    fn boxes_hold_what_was_put_down(length in 0.05..0.2_f64, width in 0.015..0.045_f64, yaw in -1.5..1.5_f64, seed in 0_u64..99) {
        let scene = Scene { length, width, height: 0.9 * width, yaw, noise: 4e-4, ..PLAIN };
        let state = found(&scene, seed).state();
        prop_assert!((state[0] - length.max(width)).abs() < 4e-3, "{state:?} of {length} {width}");
        prop_assert!((state[1] - width.min(length)).abs() < 3e-3, "{state:?} of {length} {width}");
        prop_assert!((state[2] - 0.9 * width).abs() < 1e-3, "{state:?} of {length} {width}");
    }
}
