//! The pouring rig through its traits, and the tasks it is for.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use granular_infer::campaign::Rig;
use granular_infer::dem::Clump;
use granular_infer::fake::{FakeRig, Kind};
use granular_infer::scene::{Grain, Scene};
use granular_infer::tasks::{Bowl, Ring, spilled};
use granular_infer::view::View;
use hw_traits::arm::{Arm, Pose};
use hw_traits::camera::DepthCamera;
use hw_traits::clock::Clock;
use hw_traits::gripper::Gripper;
use hw_traits::{Error, ErrorKind};

const COUSCOUS: Grain = Grain { sliding_friction: 0.67, rolling_friction: 0.05, restitution: 0.5 };

fn few(count: usize) -> Scene {
    let scene = Scene::default();
    Scene { rig: Rig { count, ..scene.rig }, ..scene }
}

fn kind(shape: Option<Clump>) -> Kind {
    Kind { grain: COUSCOUS, shape, size_variation: 0.0, work_of_adhesion_j_m2: 0.0 }
}

fn upright(position_m: [f64; 3]) -> Pose {
    Pose { position_m, rotation_xyzw: [0.0, 0.0, 0.0, 1.0] }
}

/// Two heaps at two places, the first of which stays while the second is poured.
#[test]
fn the_rig_pours_where_it_is_told() {
    let mut rig = FakeRig::new(few(120), kind(None), View::default(), 3);
    let mut lying = 0;
    for x in [-0.1, 0.1] {
        rig.move_to(upright([x, 0.02, 0.03]), 1.0).unwrap();
        rig.sleep_s(1.2).unwrap();
        assert!(Arm::settled(&mut rig).unwrap());
        rig.refill().unwrap();
        rig.open_to(0.028, 0.1).unwrap();
        rig.sleep_s(2.0).unwrap();
        lying += 120;
        let near = rig.truth().positions_m.iter().filter(|p| (p[0] - x).hypot(p[1] - 0.02) < 0.06).count();
        assert!(near > 90, "{near} of 120 are at {x}");
        assert_eq!(rig.truth().positions_m.len(), lying);
    }
    let first = rig.depth_m().unwrap();
    let second = rig.depth_m().unwrap();
    assert!(second.t_s > first.t_s && second.value.data().len() == 256 * 256);
    // A grain's height over x = -0.1 m, the cloth's depth in a corner: five sigma of noise.
    let [u, v] = [127.5 - 0.1 / 0.4 * 200.0, 127.5 - 0.02 / 0.4 * 200.0];
    let near = (0..9)
        .map(|k| *first.value.get(v as usize + k / 3, u as usize + k % 3).unwrap())
        .fold(f32::INFINITY, f32::min);
    assert!(near < 0.397 && (first.value.data()[0] - 0.4).abs() < 2.5e-3, "{near}");
}

/// While it is carried the closed funnel loses nothing, and it is where the arm is.
#[test]
fn a_full_funnel_is_carried() {
    let mut rig = FakeRig::new(few(40), kind(None), View::default(), 5);
    rig.refill().unwrap();
    rig.sleep_s(0.3).unwrap();
    rig.move_to(upright([0.05, 0.0, 0.15]), 0.5).unwrap();
    rig.sleep_s(0.8).unwrap();
    let places = rig.truth().positions_m;
    assert!(places.iter().all(|p| p[2] > 0.15 && (p[0] - 0.05).hypot(p[1]) < 0.04), "{places:?}");
}

#[test]
fn clumps_are_poured_too() {
    let cube = Clump::cube(4e-3).unwrap();
    let mut rig = FakeRig::new(few(30), kind(Some(cube)), View::default(), 5);
    rig.refill().unwrap();
    rig.open_to(0.028, 0.1).unwrap();
    rig.sleep_s(1.5).unwrap();
    let grains = rig.truth();
    assert_eq!(grains.positions_m.len(), 8 * 30);
    assert!(grains.positions_m.iter().all(|p| p[2] < 0.05 && p[2] > 1e-3));
}

#[test]
fn commands_beyond_the_rig_are_refused() {
    let mut rig = FakeRig::new(few(20), kind(None), View::default(), 1);
    let kind = |r: Result<(), granular_infer::fake::FakeError>| r.unwrap_err().kind();
    assert_eq!(kind(rig.move_to(upright([0.0, 0.0, 0.9]), 5.0)), ErrorKind::OutOfRange);
    assert_eq!(kind(rig.move_to(upright([0.0, 0.0, f64::NAN]), 5.0)), ErrorKind::OutOfRange);
    assert_eq!(kind(rig.move_to(upright([0.1, 0.0, 0.1]), 1e-3)), ErrorKind::Timeout);
    let mut tilted = upright([0.0, 0.0, 0.1]);
    tilted.rotation_xyzw = [0.6, 0.0, 0.0, 0.8];
    assert_eq!(kind(rig.move_to(tilted, 1.0)), ErrorKind::OutOfRange);
    assert_eq!(kind(rig.open_to(1.0, 0.1)), ErrorKind::OutOfRange);
    assert_eq!(kind(rig.open_to(0.01, 0.0)), ErrorKind::OutOfRange);
}

/// A bowl into which grains fall from close by keeps them; from high up hard grains leave it.
#[test]
fn a_bowl_spills_what_bounces() {
    let scene = few(60);
    let bowl = Bowl::round(0.03, 0.05, 0.02).unwrap();
    let low = spilled(&scene, &bowl, &Grain { restitution: 0.1, ..COUSCOUS }, 0.04, 1).unwrap();
    let high = spilled(&scene, &bowl, &Grain { restitution: 0.8, ..COUSCOUS }, 0.30, 1).unwrap();
    assert!(low == 0 && high > 5, "{low} and {high}");
}

#[test]
fn a_ring_is_its_percentiles() {
    let points: Vec<[f64; 3]> = (0..1001)
        .map(|i| {
            let (s, c) = (0.1 * f64::from(i)).sin_cos();
            let r = 0.02 + 1e-5 * f64::from(i);
            [0.1 + r * c, r * s, 0.0]
        })
        .collect();
    let ring = Ring::of(&points, [0.1, 0.0], 1.0).unwrap();
    assert!((ring.inner_m - 0.0205).abs() < 1e-9 && (ring.outer_m - 0.025).abs() < 1e-9, "{ring:?}");
    assert_eq!(Ring::of(&points[..10], [0.1, 0.0], 1.0), None);
}
