//! What a camera sees of grains whose places are known.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::f64::consts::PI;

use approx::assert_relative_eq;
use granular_infer::camera::{Camera, Flaws};
use granular_infer::campaign::Grains;
use granular_infer::seeing::{HeightMap, SeeError};
use granular_infer::statistics::{COUNT, STATISTICS, Symmetry, statistics};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const CAMERA: Camera = Camera {
    focal_px: [250.0, 250.0],
    centre_px: [99.5, 99.5],
    height_m: 0.35,
    depth_unit_m: 1e-4,
    size_px: [200, 200],
};
const D: f64 = 4e-3;

/// A cone of spheres and a few strays, without any physics.
fn heap(turned_rad: f64) -> Grains {
    let (sine, cosine) = turned_rad.sin_cos();
    let mut grains = Grains::default();
    for k in 0..1000 {
        // A sunflower: even in area, higher in the middle, longer along x and aside.
        let (r, a) = (0.05 * (f64::from(k) / 1000.0).sqrt(), 2.399_963 * f64::from(k));
        let (x, y) = (1.3 * r * a.cos() + 3e-3, r * a.sin());
        grains.positions_m.push([
            cosine * x - sine * y,
            sine * x + cosine * y,
            2e-3 + 0.02 * (1.0 - r / 0.05),
        ]);
        grains.radii_m.push(0.5 * D);
    }
    grains
}

fn seen(camera: &Camera, grains: &Grains, flaws: &Flaws) -> HeightMap {
    let depth = camera.render(grains);
    let counts = camera.expose(&depth, flaws, &mut ChaCha8Rng::seed_from_u64(1));
    HeightMap::new(camera, &counts, 0.0).unwrap()
}

fn at(name: &str) -> usize {
    STATISTICS.iter().position(|s| s.0 == name).unwrap()
}

/// Every pixel's depth against the nearest of all intersections of its ray, found by small steps along it.
#[test]
fn a_rendered_depth_is_the_first_thing_on_the_ray() {
    let camera = Camera {
        size_px: [24, 24],
        centre_px: [11.5, 11.5],
        focal_px: [60.0, 80.0],
        height_m: 0.1,
        ..CAMERA
    };
    let grains = Grains {
        positions_m: vec![[0.0, 0.0, 0.01], [0.008, 0.004, 0.02], [-0.012, 0.01, 0.005], [0.01, 0.004, 0.03]],
        radii_m: vec![0.01, 0.006, 0.005, 0.004],
    };
    let depth = camera.render(&grains);
    for v in 0..24 {
        for u in 0..24 {
            let [x, y] = camera.place_m(u, v, 1.0);
            let inside = |t: f64| {
                let p = [x * t, y * t, 0.1 - t];
                grains
                    .positions_m
                    .iter()
                    .zip(&grains.radii_m)
                    .any(|(c, r)| p.iter().zip(c).map(|(a, b)| (a - b).powi(2)).sum::<f64>() < r * r)
            };
            let slow = (0..20_000).map(|k| 5e-6 * f64::from(k)).find(|&t| inside(t)).unwrap_or(0.1);
            assert!((depth[v * 24 + u] - slow).abs() < 2e-5, "{u} {v}: {} and {slow}", depth[v * 24 + u]);
        }
    }
}

/// A tilted, offset ground under noise is found, grains on it or not.
#[test]
fn the_ground_is_found_under_grains() {
    let grains = heap(0.0);
    let mut depth = CAMERA.render(&grains);
    for (i, d) in depth.iter_mut().enumerate() {
        let [x, y] = CAMERA.place_m(i % 200, i / 200, 0.35);
        *d += 2e-3 + 0.01 * x - 0.02 * y;
    }
    let flaws = Flaws { noise_m: 7e-4, missing: 0.02, ..Flaws::default() };
    let counts = CAMERA.expose(&depth, &flaws, &mut ChaCha8Rng::seed_from_u64(3));
    let map = HeightMap::new(&CAMERA, &counts, 3e-5).unwrap();
    assert!((map.ground_m - 2e-3).abs() < 5e-5, "{}", map.ground_m);
    assert!((map.slope[0] + 0.01).abs() < 1e-3 && (map.slope[1] - 0.02).abs() < 1e-3, "{:?}", map.slope);
    assert!((map.noise_m / 7e-4 - 1.0).abs() < 0.03, "{}", map.noise_m);
    assert!((map.missing - 0.02).abs() < 3e-3);
}

/// The volume between ground and heap is that of the surface that the camera sees, wherever the ground reads.
#[test]
fn an_offset_of_all_depths_moves_the_ground_and_nothing_else() {
    let depth = CAMERA.render(&heap(0.3));
    let shifted: Vec<f64> = depth.iter().map(|d| d + 5e-3).collect();
    let fine = Camera { depth_unit_m: 1e-5, ..CAMERA };
    let counts = |d: &[f64]| fine.expose(d, &Flaws::default(), &mut ChaCha8Rng::seed_from_u64(1));
    let of = |d: &[f64]| statistics(&HeightMap::new(&fine, &counts(d), 3e-5).unwrap(), 1000, D);
    let (a, b) = (of(&depth), of(&shifted));
    assert_relative_eq!(b[0] - a[0], 5e-3 / D, epsilon = 1e-3);
    for k in 1..COUNT {
        assert_relative_eq!(a[k], b[k], epsilon = 3e-3);
    }
}

/// Turned by a quarter, scalars stay, vectors turn, tensors change sign; a half turn leaves tensors.
#[test]
fn statistics_turn_with_the_scene() {
    let of = |turned: f64| statistics(&seen(&CAMERA, &heap(turned), &Flaws::default()), 1000, D);
    let (a, b) = (of(0.0), of(0.5 * PI));
    for (k, (name, symmetry)) in STATISTICS.iter().enumerate() {
        let expected = match symmetry {
            Symmetry::Scalar => a[k],
            Symmetry::Vector => -a[k + 1],
            Symmetry::Tensor => -a[k],
            Symmetry::Second if STATISTICS[k - 1].1 == Symmetry::Vector => a[k - 1],
            Symmetry::Second => -a[k],
        };
        assert!((b[k] - expected).abs() < 0.02, "{name}: {} and {expected}", b[k]);
    }
    assert!(a[at("centroid_x")] > 0.05 && a[at("oval_xx_yy")] > 0.02, "{a:?}");
}

/// Noise moves no statistic by much; blur takes the roughness away.
#[test]
fn noise_is_taken_out_and_blur_is_seen() {
    let clean = statistics(&seen(&CAMERA, &heap(0.0), &Flaws::default()), 1000, D);
    let noisy = Flaws { noise_m: 7e-4, missing: 0.02, ..Flaws::default() };
    let noisy = statistics(&seen(&CAMERA, &heap(0.0), &noisy), 1000, D);
    for k in 0..COUNT {
        assert!((clean[k] - noisy[k]).abs() < 0.12, "{}: {} and {}", STATISTICS[k].0, clean[k], noisy[k]);
    }
    let blurred =
        statistics(&seen(&CAMERA, &heap(0.0), &Flaws { blur_px: 2.0, ..Flaws::default() }), 1000, D);
    assert!(blurred[at("roughness")] < clean[at("roughness")] - 1.0);
    assert!((blurred[3] - clean[3]).abs() < 0.3);
}

/// Each kind of picture that shows no grains on a ground gets its own error.
#[test]
fn pictures_without_sense_are_refused() {
    let n = 200 * 200;
    let volume = 3.35e-5;
    let read = |counts: &[u16]| HeightMap::new(&CAMERA, counts, volume).unwrap_err();
    let good =
        CAMERA.expose(&CAMERA.render(&heap(0.0)), &Flaws::default(), &mut ChaCha8Rng::seed_from_u64(1));
    assert!(HeightMap::new(&CAMERA, &good, volume).is_ok());
    assert!(matches!(read(&good[1..]), SeeError::Size { .. }));
    assert!(matches!(read(&vec![0; n]), SeeError::Missing { .. }));
    assert!(matches!(read(&vec![u16::MAX; n]), SeeError::Saturated { .. }));
    assert!(matches!(read(&vec![3500; n]), SeeError::NoGrains { .. }));
    let millimetres: Vec<u16> = good.iter().map(|c| c / 10).collect();
    assert!(matches!(read(&millimetres), SeeError::Unit { .. }));
    // A wild landscape has no plane.
    let wild: Vec<u16> = (0..n).map(|i| 2800 + ((i * 7919) % 1400) as u16).collect();
    assert!(matches!(read(&wild), SeeError::NoGround { .. }), "{:?}", read(&wild));
}

/// A ground at any whole number of counts is found, without any noise about it.
#[test]
fn a_picture_without_noise_has_its_ground() {
    for height_m in [0.3, 0.35, 0.4, 0.4001, 0.5] {
        let camera = Camera { height_m, ..CAMERA };
        let map = seen(&camera, &heap(0.0), &Flaws::default());
        assert!(map.ground_m.abs() < 1e-4 && map.noise_m < 1e-4, "{height_m}: {}", map.ground_m);
    }
}
