//! The fake, and what is measured on it through the traits: volume, stiffness, goals, errors of a rig.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use dough_mbrl::dough::{DoughError, View};
use dough_mbrl::fake::{DoughKind, Effects, Eye, FakeRig};
use dough_mbrl::goal::{Goal, GoalError};
use dough_mbrl::handling::{Motion, RigError, Side};
use dough_mbrl::policy::{Explore, Heuristic, Policy};
use dough_mbrl::predictor::PlanError;
use dough_mbrl::roll::{Action, Limits, State};
use dough_mbrl::rollout::{End, RolloutError, Setup};
use dough_mbrl::stiffness::{BandForce, Palpation, Press, StiffnessError};
use hw_traits::camera::DepthCamera;
use hw_traits::clock::Clock;
use hw_traits::{Error, ErrorKind};
use proptest::prelude::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const NONE: Effects =
    Effects { drying_per_s: 0.0, slip_n: 0.0, springback: 0.0, sticking: 0.0, softening: 0.0 };

fn presses() -> Vec<Press> {
    let mut rig = FakeRig::new(DoughKind::A, NONE, 1).with_rigid_probe(0.03);
    let setup = Setup::of(rig.camera_in_world());
    let mut presses = Vec::new();
    for throw_mm in (40..=120).step_by(10) {
        for depth_mm in (2..=30).step_by(4) {
            let (throw_m, depth_m) = (1e-3 * f64::from(throw_mm), 1e-3 * f64::from(depth_mm));
            setup.handling.stretch(&mut rig, throw_m).unwrap();
            setup.handling.go(&mut rig, [0.4, 0.0, 0.03 - depth_m], 0.1).unwrap();
            presses.push(Press { throw_m, depth_m, force_n: rig.probe_force_n() });
            setup.handling.go(&mut rig, [0.4, 0.0, 0.1], 0.3).unwrap();
        }
    }
    presses
}

#[test]
fn stiffness_is_that_of_table_7_1() {
    stiffness_is_that_of(&[(3.0, 0.85)]);
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_stiffness_of_dry_and_wet_doughs_is_that_of_table_7_1() {
    stiffness_is_that_of(&[(1.0, 1.23), (5.0, 0.49)]);
}

/// Grams of water, and N/mm of the table.
fn stiffness_is_that_of(table: &[(f64, f64)]) {
    let band = BandForce::fit(&presses()).unwrap();
    for &(water_g, table) in table {
        let felt = (20..26).map(|seed| {
            let mut rig = FakeRig::new(DoughKind { water_g, ..DoughKind::A }, NONE, seed);
            let setup = Setup::of(rig.camera_in_world());
            1e-3 * Palpation::default().run(&mut rig, &setup, &band).unwrap().stiffness_n_m
        });
        let mean = felt.sum::<f64>() / 6.0;
        println!("{water_g} g: {mean:.3} N/mm of {table}");
        assert!(
            (mean / table - 1.0).abs() < 0.06,
            "{water_g} g of water: {mean} N/mm, the table has {table}"
        );
    }
}

/// A band of two straight halves: `F = 2 k (L/L0 - 1) depth/(L/2)`.
#[test]
fn the_force_that_was_fitted_is_the_band_s_between_the_presses() {
    let band = BandForce::fit(&presses()).unwrap();
    for (throw, depth) in [(0.045_f64, 0.012_f64), (0.083, 0.021), (0.117, 0.007)] {
        let length = 2.0 * (0.5 * throw).hypot(depth);
        let force = 2.0 * 0.85 * (length / 0.025 - 1.0) * depth / (0.5 * length);
        let fitted = band.force_n(throw, depth).unwrap();
        assert!((fitted - force).abs() < 4.0 * band.sigma_n, "{fitted} N of {force} N");
    }
    assert!(matches!(band.force_n(0.2, 0.01), Err(StiffnessError::Outside { name: "a throw", .. })));
    assert!(matches!(band.force_n(0.08, f64::NAN), Err(StiffnessError::Outside { name: "a depth", .. })));
    assert!(matches!(BandForce::fit(&presses()[..5]), Err(StiffnessError::TooFew { least: 12, .. })));
    let mut alike = presses();
    alike.iter_mut().for_each(|p| p.throw_m = 0.08);
    assert_eq!(BandForce::fit(&alike), Err(StiffnessError::Undetermined));
}

#[test]
fn too_stiff_a_dough_is_said() {
    let band = BandForce::fit(&presses()).unwrap();
    let mut rig = FakeRig::new(DoughKind::C, NONE, 1);
    let setup = Setup::of(rig.camera_in_world());
    let shallow = Palpation { deepest_m: 4e-3, ..Palpation::default() };
    assert!(matches!(shallow.run(&mut rig, &setup, &band), Err(StiffnessError::NoDent { .. })));
}

#[test]
fn a_camera_sees_the_dough_as_it_is() {
    cameras_see_doughs_as_they_are(0..3);
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_cameras_see_doughs_as_they_are() {
    cameras_see_doughs_as_they_are(3..8);
}

fn cameras_see_doughs_as_they_are(seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let mut rig = FakeRig::new(DoughKind::B, NONE, seed);
        let setup = Setup::of(rig.camera_in_world());
        let goal = Goal::cylinder(0.14, 4e-5).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        setup.run(&mut rig, &mut Heuristic::default(), &goal, 4e-5, &mut rng).unwrap();
        let (seen, truth) = (setup.look(&mut rig).unwrap().state(), rig.truth());
        let within = [4e-3, 2.5e-3, 1.2e-3];
        for k in 0..3 {
            assert!((seen[k] - truth[k]).abs() < within[k], "{seen:?} of {truth:?}, seed {seed}");
        }
    }
}

#[test]
fn a_dough_beyond_the_picture_is_no_shorter_dough() {
    let mut eye = Eye::overhead();
    eye.pose_in_world.position_m[1] += 0.16;
    let mut rig = FakeRig::new(DoughKind::A, NONE, 3).with_eye(eye.clone());
    let setup = Setup::of(eye.pose_in_world);
    assert!(matches!(setup.look(&mut rig), Err(RigError::Dough(DoughError::CutOff { .. }))));
    eye.pose_in_world.position_m[1] += 0.5;
    let mut rig = FakeRig::new(DoughKind::A, NONE, 3).with_eye(eye.clone());
    assert!(matches!(
        Setup::of(eye.pose_in_world).look(&mut rig),
        Err(RigError::Dough(DoughError::NoDough { .. }))
    ));
    let picture = rig.depth_m().unwrap().value;
    let mut pose = eye.pose_in_world;
    pose.rotation_xyzw = [0.0; 4];
    let found = View::default().find_in_picture(&picture, &rig.intrinsics(), &pose);
    assert_eq!(found, Err(DoughError::Pose { size: 0.0 }));
}

#[test]
fn a_wetter_dough_lengthens_more_and_a_dry_one_less() {
    let after = |kind, effects| {
        let lengths = (0..4).map(|seed| {
            // The same flow along the axis, so that only hardness differs.
            let mut rig = FakeRig::new(DoughKind { axial_flow: 1.0, ..kind }, effects, seed);
            let setup = Setup::of(rig.camera_in_world());
            for _ in 0..6 {
                let shape = setup.look(&mut rig).unwrap();
                let motion = Motion::constrained(&shape, [0.096, 0.7 * shape.height_m]);
                setup.handling.roll(&mut rig, shape.ground_m, &motion, Side::Plus).unwrap();
            }
            rig.truth()[0]
        });
        lengths.sum::<f64>() / 4.0
    };
    let (a, b, c) = (after(DoughKind::A, NONE), after(DoughKind::B, NONE), after(DoughKind::C, NONE));
    assert!(a > b + 5e-3 && b > c + 2e-3, "{a} {b} {c}");
    let dry = after(DoughKind::A, Effects { drying_per_s: 0.05, ..NONE });
    assert!(dry < a - 5e-3, "{dry} of {a}");
    let slips = after(DoughKind::A, Effects { slip_n: 10.0, ..NONE });
    assert!((slips - 0.0424).abs() < 1e-3, "no roll that slips does anything: {slips}");
    let back = after(DoughKind::A, Effects { springback: 0.5, ..NONE });
    assert!(back < a - 3e-3, "{back} of {a}");
    let tired = after(DoughKind::A, Effects { softening: 0.3, ..NONE });
    assert!(tired < a - 5e-3, "{tired} of {a}");
}

#[test]
fn volume_is_kept_but_for_what_sticks() {
    for (sticking, left) in [(0.0, 1.0), (0.01, 0.99_f64.powi(5))] {
        let mut rig = FakeRig::new(DoughKind::A, Effects { sticking, ..NONE }, 1);
        let setup = Setup::of(rig.camera_in_world());
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let goal = Goal::cylinder(0.2, 4e-5).unwrap();
        for _ in 0..5 {
            setup.step(&mut rig, &mut Explore, &goal, &mut rng).unwrap();
        }
        approx::assert_relative_eq!(rig.volume_m3(), 4e-5 * left, max_relative = 1e-9);
    }
}

#[test]
fn what_a_rig_refuses_is_said() {
    let mut rig = FakeRig::new(DoughKind::A, NONE, 1);
    let setup = Setup::of(rig.camera_in_world());
    let shape = setup.look(&mut rig).unwrap();
    let wide = Motion::constrained(&shape, [0.3, 0.01]);
    let refused = setup.handling.roll(&mut rig, 0.0, &wide, Side::Plus);
    assert_eq!(refused, Err(RigError::Device { doing: "opening the gripper", kind: ErrorKind::OutOfRange }));
    // Fingers that stand closer than the dough is wide come down on it.
    let narrow = Motion::constrained(&shape, [0.02, 0.03]);
    let hit = setup.handling.roll(&mut rig, 0.0, &narrow, Side::Plus);
    assert_eq!(hit, Err(RigError::Device { doing: "moving the arm", kind: ErrorKind::Stopped }));
    assert_eq!(dough_mbrl::fake::FakeError::TooFast.kind(), ErrorKind::Timeout);
    let goal = Goal::cylinder(0.2, 9e-5).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let run = setup.run(&mut rig, &mut Explore, &goal, 4e-5, &mut rng);
    assert!(matches!(run, Err(RolloutError::Goal(GoalError::Volume { .. }))), "{run:?}");
}

/// Always the same: fingers that stand in the dough.
struct Narrow;

impl Policy for Narrow {
    fn act(&mut self, _: &State, _: &Goal, _: &Limits, _: &mut dyn Rng) -> Result<Action, PlanError> {
        Ok([0.02, 0.03])
    }
}

#[test]
fn a_rig_that_stops_ends_the_rollout() {
    let mut rig = FakeRig::new(DoughKind::A, NONE, 1);
    let setup = Setup::of(rig.camera_in_world());
    let goal = Goal::cylinder(0.2, 4e-5).unwrap();
    let done = setup.run(&mut rig, &mut Narrow, &goal, 4e-5, &mut ChaCha8Rng::seed_from_u64(1)).unwrap();
    assert_eq!((done.end, done.rolls.len()), (End::Stopped, 0));
}

const STOPPED: RigError = RigError::Device { doing: "moving the arm", kind: ErrorKind::Stopped };

/// Fingers as far apart as the dough is wide, pressed to the table: the dough widens by more than a sixth and meets them. The rig says so, and
/// the dough is whole; fingers that stand farther apart press as deep.
#[test]
fn a_deep_press_between_narrow_fingers_stops_the_rig_and_breaks_no_dough() {
    for (place, expected) in [([0.0, 0.9696], Err(STOPPED)), ([0.3, 0.9696], Ok(()))] {
        let mut rig = FakeRig::new(DoughKind { water_g: 5.478, ..DoughKind::A }, NONE, 297);
        let setup = Setup::of(rig.camera_in_world());
        let shape = setup.look(&mut rig).unwrap();
        let before = rig.truth();
        let action = setup.limits.at(&shape.state()).place(place);
        let motion = Motion::constrained(&shape, action);
        assert_eq!(setup.handling.roll(&mut rig, shape.ground_m, &motion, Side::Minus), expected);
        approx::assert_relative_eq!(rig.volume_m3(), 4e-5, max_relative = 1e-9);
        let after = rig.truth();
        assert!(after[0] >= before[0] && after.iter().all(|v| v.is_finite() && *v > 0.0), "{after:?}");
    }
}

/// The axial flow changes how far a dough lengthens, and not what a press bears.
#[test]
fn axial_flow_lengthens_and_leaves_stiffness() {
    let band = BandForce::fit(&presses()).unwrap();
    let [(slow, felt_slow), (fast, felt_fast)] = [0.275, 1.0].map(|axial_flow| {
        let mut rig = FakeRig::new(DoughKind { axial_flow, ..DoughKind::A }, NONE, 20);
        let setup = Setup::of(rig.camera_in_world());
        let felt = Palpation::default().run(&mut rig, &setup, &band).unwrap().stiffness_n_m;
        let before = rig.truth()[0];
        for _ in 0..4 {
            let shape = setup.look(&mut rig).unwrap();
            let motion = Motion::constrained(&shape, [0.1, 0.7 * shape.height_m]);
            setup.handling.roll(&mut rig, shape.ground_m, &motion, Side::Plus).unwrap();
        }
        (rig.truth()[0] - before, felt)
    });
    assert!(fast > 2.0 * slow && slow > 1e-3, "{fast} m and {slow} m");
    approx::assert_relative_eq!(felt_slow, felt_fast, max_relative = 0.03);
}

#[test]
fn longer_goals_take_more_rolls_and_the_same_seed_the_same_rolls() {
    longer_goals_take_more_rolls([0.06, 0.1, 0.15]);
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_the_longest_goal_takes_most_rolls() {
    longer_goals_take_more_rolls([0.06, 0.1, 0.2]);
    longer_goals_take_more_rolls([0.06, 0.15, 0.2]);
}

/// Lengths in m, rising.
fn longer_goals_take_more_rolls(lengths_m: [f64; 3]) {
    let run = |length_m: f64| {
        let mut rig = FakeRig::new(DoughKind::A, NONE, 7);
        let setup = Setup::of(rig.camera_in_world());
        let goal = Goal::cylinder(length_m, 4e-5).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let done = setup.run(&mut rig, &mut Heuristic::default(), &goal, 4e-5, &mut rng).unwrap();
        (done, rig.now_s().unwrap())
    };
    let runs = lengths_m.map(run);
    let rolls = [0, 1, 2].map(|k| runs[k].0.rolls.len());
    assert!(rolls.windows(2).all(|w| w[0] < w[1]), "{rolls:?}");
    assert_eq!(runs[1].0.end, End::Reached);
    assert_eq!(runs[1], run(lengths_m[1]));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    #[test]
    fn no_roll_changes_the_volume_or_breaks_the_dough(
        seed in 0_u64..1000,
        water_g in 0.0..6.0_f64,
        rolls in prop::collection::vec((0.0..1.0_f64, 0.0..1.0_f64), 1..12),
    ) {
        let mut rig = FakeRig::new(DoughKind { water_g, ..DoughKind::A }, NONE, seed);
        let setup = Setup::of(rig.camera_in_world());
        let mut longest = 0.0;
        for (u, v) in rolls {
            let shape = setup.look(&mut rig);
            let Ok(shape) = shape else { break };
            let action = setup.limits.at(&shape.state()).place([u, v]);
            let rolled =
                setup.handling.roll(&mut rig, shape.ground_m, &Motion::constrained(&shape, action), Side::Minus);
            // Between narrow fingers a deep press widens the dough until it meets them, and the rig stops.
            prop_assert!(matches!(rolled, Ok(()) | Err(STOPPED)), "{rolled:?}");
            prop_assert!((rig.volume_m3() / 4e-5 - 1.0).abs() < 1e-9);
            let [length, width, height] = rig.truth();
            prop_assert!(length >= longest, "rolling never shortens it: {length} after {longest}");
            prop_assert!(width > 0.0 && height > 0.0 && length.is_finite());
            longest = length;
            if rolled.is_err() {
                break;
            }
        }
    }
}
