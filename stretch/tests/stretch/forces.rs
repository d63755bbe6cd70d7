//! Moduli, loads, palpation, shape.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use approx::assert_relative_eq;
use hertz_contact::indenter::Indenter;
use hw_traits::arm::Pose;
use proptest::prelude::*;
use stretch::calibration::{CalibrationError, ForceModel, Press};
use stretch::fake::{Filling, Membrane, Rig, Shape, Sheet};
use stretch::force::{ForceError, Seen, curve, indentation_m, load};
use stretch::measured::MeasuredLength;
use stretch::membrane::MembraneModel;
use stretch::modulus::{HalfSpace, effective_pa};
use stretch::palpate::{PalpateError, Programme, palpate};
use stretch::reconstruct::{Merged, ReconstructError};
use stretch::shape::{RollError, Rolling, Settling, ShapeError, circularity, roll};

fn pressed(radius_m: f64, stretch_m: f64, indentation_m: f64) -> Press {
    let mut membrane = Membrane::new(Sheet::matl_2021(), stretch_m);
    membrane.press(&Shape::Ball { radius_m }, [0.0; 2], indentation_m);
    Press { stretch_m, radius_m, indentation_m, force_n: membrane.force_n }
}

/// Rigid balls of five radii at four stretches, each to 12 mm: what a force sensor under the fake would read.
fn calibration() -> Vec<Press> {
    static ONCE: std::sync::OnceLock<Vec<Press>> = std::sync::OnceLock::new();
    ONCE.get_or_init(calibrate).clone()
}

fn calibrate() -> Vec<Press> {
    let mut presses = Vec::new();
    for radius_m in [0.008, 0.011, 0.014, 0.018, 0.024] {
        for stretch_m in [0.0, 0.02, 0.04, 0.06] {
            presses.extend([0.004, 0.008, 0.012].map(|d| pressed(radius_m, stretch_m, d)));
        }
    }
    presses
}

/// Forces of the obstacle problem: none without touch, rising with depth and stretch; a thin circular sheet's law for a small punch.
#[test]
fn the_fake_s_membrane_pushes_back_as_one() {
    assert_eq!(pressed(0.01, 0.0, -1e-3).force_n, 0.0);
    let at = |x: f64, d: f64| pressed(0.012, x, d).force_n;
    assert!(0.0 < at(0.0, 0.003) && at(0.0, 0.003) < at(0.0, 0.006) && at(0.0, 0.006) < at(0.0, 0.012));
    assert!(at(0.0, 0.01) < at(0.03, 0.01) && at(0.03, 0.01) < at(0.06, 0.01));
    // What pushes up pulls at the fingers: half of the force each, by the slope there.
    let mut m = Membrane::new(Sheet::matl_2021(), 0.0);
    m.press(&Shape::Ball { radius_m: 0.012 }, [0.0; 2], 0.008);
    let (half, h, n) = (0.5 * m.length_m(), 1e-3, 450);
    let pull: f64 = (0..n)
        .map(|k| 0.09 * (f64::from(k) + 0.5) / f64::from(n) - 0.045)
        .map(|y| m.tension_n_m[0] * m.height_m(half - h, y).unwrap() / h * 0.09 / f64::from(n))
        .sum();
    assert!((2.0 * pull / m.force_n - 1.0).abs() < 0.05, "{} {}", 2.0 * pull, m.force_n);
}

#[test]
fn forces_come_back_from_radius_stretch_and_depth() {
    let presses = calibration();
    let half_space = HalfSpace::fit(&presses).unwrap();
    let model = MembraneModel::fit(&presses).unwrap();
    let range = presses.iter().map(|p| p.force_n).fold(0.0, f64::max);
    println!("left out, of {range:.2} N ([Matl 2021]: 0.023 +- 0.011)");
    let [half, own] = [&half_space as &dyn ForceModel, &model].map(|m| {
        [m.radius_left_out(), m.stretch_left_out()].map(|errors| {
            let errors = errors.unwrap();
            println!("  {errors:?}");
            errors.mean_n
        })
    });
    // A membrane's own law errs by a third of what a half-space in its place does; of four stretches, by two thirds.
    assert!(own[0] < 0.5 * half[0] && own[1] < 0.8 * half[1], "{own:?} {half:?}");
    // Stretched is firmer; small contacts look firmer.
    let e = |r, x| half_space.modulus_pa(r, x).unwrap();
    assert!(
        e(0.012, 0.0) < e(0.012, 0.03) && e(0.012, 0.03) < e(0.012, 0.06) && e(0.009, 0.03) > e(0.02, 0.03)
    );
    let mut inside = 0;
    let unseen = [
        (0.010, 0.01, 0.006),
        (0.012, 0.03, 0.008),
        (0.016, 0.05, 0.009),
        (0.020, 0.01, 0.007),
        (0.013, 0.0, 0.009),
    ];
    for (r, x, d) in unseen {
        let truth = pressed(r, x, d).force_n;
        let seen = Seen { stretch_m: x, radius: length(r, 0.2e-3), indentation: length(d, 0.1e-3) };
        let l = load(&model, &seen).unwrap();
        println!(
            "R {r} x {x} d {d}: {:.3} in [{:.3}, {:.3}], true {truth:.3}",
            l.force_n, l.interval_n.0, l.interval_n.1
        );
        inside += usize::from(l.interval_n.0 <= truth && truth <= l.interval_n.1);
    }
    assert!(inside >= 4, "{inside} of 5");
    let forces = curve(&model, 0.012, 0.02, &[0.0, 0.005, 0.01]).unwrap();
    assert!(forces[0] == 0.0 && forces[1] < forces[2]);
    assert_relative_eq!(indentation_m(&model, 0.012, 0.02, forces[2]).unwrap(), 0.01, epsilon = 1e-9);
}

#[test]
fn calibrations_that_determine_nothing_are_refused() {
    let ball =
        |radius_m: f64, stretch_m: f64| Press { stretch_m, radius_m, indentation_m: 0.01, force_n: 1.0 };
    let grid = |n: usize, m: usize| -> Vec<Press> {
        (0..n * m).map(|k| ball(0.01 * (1 + k % n) as f64, 0.01 * (k / n) as f64)).collect()
    };
    assert!(matches!(
        HalfSpace::fit(&grid(2, 4)),
        Err(CalibrationError::TooFew { what: "radii", got: 2, .. })
    ));
    assert!(matches!(
        HalfSpace::fit(&grid(4, 2)),
        Err(CalibrationError::TooFew { what: "stretches", got: 2, .. })
    ));
    assert!(matches!(HalfSpace::fit(&[]), Err(CalibrationError::TooFew { .. })));
    let mut bad = grid(4, 4);
    bad[3].radius_m = 0.0;
    assert!(matches!(
        HalfSpace::fit(&bad),
        Err(CalibrationError::Value { press: 3, what: "the radius", .. })
    ));
    let mut none = grid(4, 4);
    none.iter_mut().for_each(|p| p.force_n = -1.0);
    assert!(matches!(HalfSpace::fit(&none), Err(CalibrationError::NoForce { .. })));
    // Three radii: no inner one can be left out with three to stay; the interval says that nothing is known.
    let surface = HalfSpace::fit(&grid(3, 3)).unwrap();
    let seen = Seen { stretch_m: 0.01, radius: length(0.02, 1e-4), indentation: length(0.01, 1e-4) };
    assert_eq!(load(&surface, &seen).unwrap().interval_n.1, f64::INFINITY);
    assert!(matches!(
        load(&surface, &Seen { stretch_m: 0.5, ..seen }),
        Err(ForceError::Calibration(CalibrationError::Beyond(_)))
    ));
    assert!(matches!(
        load(&surface, &Seen { indentation: length(f64::NAN, 0.0), ..seen }),
        Err(ForceError::Value { .. })
    ));
}

/// Corrected eqs 6.2 to 6.4, by hand, with nu = 1/2: E* = E/0.75.
#[test]
fn moduli_of_the_three_indenters() {
    let force = |indenter: &Indenter, d: f64| match indenter {
        Indenter::Sphere { radius_m } => 4.0 / 3.0 * (d.powi(3) * radius_m).sqrt() * 6e3 / 0.75,
        Indenter::Cylinder { radius_m } => 2.0 * radius_m * d * 6e3 / 0.75,
        Indenter::Cone { angle_rad } => 2.0 * d * d / (std::f64::consts::PI * angle_rad.tan()) * 6e3 / 0.75,
    };
    for indenter in [
        Indenter::Sphere { radius_m: 0.01 },
        Indenter::Cylinder { radius_m: 0.01 },
        Indenter::Cone { angle_rad: 0.785 },
    ] {
        let presses: Vec<(f64, f64)> =
            (1..=10).map(|k| 1e-3 * f64::from(k)).map(|d| (d, force(&indenter, d))).collect();
        let (e, error) = effective_pa(&indenter, &presses).unwrap();
        assert_relative_eq!(e, 6e3, epsilon = 1e-6);
        assert!(error < 1e-6);
        assert!(matches!(effective_pa(&indenter, &presses[..1]), Err(CalibrationError::TooFew { .. })));
    }
}

fn above() -> Pose {
    Pose { position_m: [0.0, 0.0, 0.03], rotation_xyzw: [0.0, 0.0, 0.0, 1.0] }
}

fn length(value_m: f64, sigma_m: f64) -> MeasuredLength {
    MeasuredLength { value_m, sigma_m }
}

fn quick() -> Programme {
    Programme {
        stretches_m: vec![0.0, 0.03, 0.06],
        depth_step_m: 2e-3,
        deepest_m: 12e-3,
        pictures: 2,
        ..Programme::matl_2021(above(), 0.0)
    }
}

/// Balloons of three fillings, each twice as stiff as the one before, are told apart, each twice.
#[test]
fn fillings_are_told_apart_by_palpation() {
    let model = MembraneModel::fit(&calibration()).unwrap();
    let truth = [100.0, 200.0, 400.0];
    let mut felt = Vec::new();
    for (k, stiffness) in truth.into_iter().enumerate() {
        for seed in 0..2 {
            let mut rig =
                Rig::new(Shape::Ball { radius_m: 0.02 }, Filling::Springy(stiffness), 10 * k as u64 + seed);
            let p = palpate(&mut rig, &quick(), &model).unwrap();
            println!(
                "{stiffness} N/m: {:?} in {:?}, R {:.1} mm, {} steps",
                p.stiffness_n_m,
                p.interval_n_m,
                1e3 * p.radius.value_m,
                p.steps.len()
            );
            assert!(p.interval_n_m.0 <= stiffness && stiffness <= p.interval_n_m.1, "{p:?}");
            // Force only ever rises (to the noise of the depth).
            assert!(p.steps.windows(2).all(|w| w[1].load.force_n > 0.9 * w[0].load.force_n));
            felt.push(p.stiffness_n_m);
        }
    }
    for pair in felt.chunks(2).collect::<Vec<_>>().windows(2) {
        assert!(
            pair[0].iter().flatten().fold(0.0, |a: f64, x| a.max(*x))
                < pair[1].iter().flatten().fold(f64::INFINITY, |a: f64, x| a.min(*x))
        );
    }
}

#[test]
fn a_stone_does_not_yield_and_senseless_programmes_are_refused() {
    let model = MembraneModel::fit(&calibration()).unwrap();
    let mut rig = Rig::new(Shape::Ball { radius_m: 0.02 }, Filling::Rigid, 5);
    let p = palpate(&mut rig, &Programme { stretches_m: vec![0.0, 0.04], ..quick() }, &model).unwrap();
    assert!(
        p.stiffness_n_m.is_none() && p.interval_n_m.0 > 500.0 && p.interval_n_m.1 == f64::INFINITY,
        "{:?}",
        p.interval_n_m
    );
    for programme in [
        Programme { stretches_m: vec![0.02, 0.01], ..quick() },
        Programme { stretches_m: vec![], ..quick() },
        Programme { pictures: 0, ..quick() },
        Programme { depth_step_m: 0.0, deepest_m: 0.01, ..quick() },
    ] {
        assert!(matches!(palpate(&mut rig, &programme, &model), Err(PalpateError::Setting { .. })));
    }
    // Beyond the gripper: the device's error, with its kind.
    let far = Programme { stretches_m: vec![0.5], ..quick() };
    assert!(matches!(
        palpate(&mut rig, &far, &model),
        Err(PalpateError::Device(_, hw_traits::ErrorKind::OutOfRange))
    ));
    // Nothing under the hand.
    rig.top_m = [0.0, 0.0, -0.5];
    assert!(matches!(palpate(&mut rig, &quick(), &model), Err(PalpateError::Contact(_))));
}

#[test]
fn views_merge_in_the_world() {
    let mut merged = Merged::new(1e-3).unwrap();
    // A point seen from two sides: the camera looks along -x of the world, then along +x.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let from =
        |x: f64, sign: f64| Pose { position_m: [x, 0.0, 0.0], rotation_xyzw: [0.0, sign * half, 0.0, half] };
    merged.add(&from(1.0, -1.0), &[[0.0, 0.0, 0.7497]]).unwrap();
    merged.add(&from(-1.0, 1.0), &[[0.0, 0.0, 1.2505]]).unwrap();
    let points = merged.points(2);
    assert_eq!(points.len(), 1);
    assert_relative_eq!(points[0][0], 0.2504, epsilon = 1e-9);
    assert!(matches!(merged.add(&from(f64::NAN, 1.0), &[]), Err(ReconstructError::Pose { .. })));
    let turned = Pose { rotation_xyzw: [0.0; 4], ..from(0.0, 1.0) };
    assert!(matches!(merged.add(&turned, &[]), Err(ReconstructError::Pose { .. })));
    assert!(matches!(
        merged.add(&from(0.0, 1.0), &[[0.0; 3], [f64::INFINITY; 3]]),
        Err(ReconstructError::Point { index: 1 })
    ));
    assert_eq!(merged.points(1).len(), 1, "a refused view adds nothing");
    assert!(Merged::new(0.0).is_err());
}

fn mask(inside: impl Fn(f64, f64) -> bool) -> Vec<bool> {
    (0..200 * 200).map(|i| inside(f64::from(i % 200) - 99.7, f64::from(i / 200) - 100.2)).collect()
}

#[test]
fn discs_are_round_and_squares_less() {
    let disc = circularity(&mask(|x, y| x.hypot(y) < 70.0), 200).unwrap();
    assert!((disc - 1.0).abs() < 0.02, "{disc}");
    let square = circularity(&mask(|x, y| x.abs() < 60.0 && y.abs() < 60.0), 200).unwrap();
    assert!((square - 0.785).abs() < 0.08, "{square}");
    assert!(matches!(circularity(&mask(|_, _| true), 200), Err(ShapeError::CutOff)));
    assert!(matches!(circularity(&mask(|x, y| x.hypot(y) < 3.0), 200), Err(ShapeError::TooSmall { .. })));
    assert!(matches!(circularity(&[true; 10], 3), Err(ShapeError::NotRows { .. })));
    assert!(matches!(circularity(&[], 0), Err(ShapeError::NotRows { .. })));
}

#[test]
fn rolling_ends_when_the_height_settles() {
    let mut settling = Settling::matl_2021();
    let height = |k: i32| 0.03 - 0.01 * (-f64::from(k) / 8.0).exp() + 2e-4 * f64::from(k).sin();
    let end = (0..200).find(|&k| settling.push(height(k))).unwrap();
    // Over ten heights the exponential's own spread is below 1 mm once k is about 20.
    assert!((10..40).contains(&end), "{end}");
    let mut never = Settling::matl_2021();
    assert!((0..200).all(|k| !never.push(if k % 2 == 0 { 0.03 } else { 0.034 })));
    let mut blind = Settling::matl_2021();
    assert!((0..50).all(|_| !blind.push(f64::NAN)));
    assert!(Settling::new(2, 1e-3).is_err() && Settling::new(10, 0.0).is_err());
}

#[test]
fn dough_is_rolled_until_it_is_a_ball_or_the_circles_are_used_up() {
    let mut rig = Rig::new(Shape::Ball { radius_m: 0.02 }, Filling::Rigid, 1);
    let rolling = Rolling { middle: above(), circle_m: 0.01, moves: 8, move_s: 0.1, most: 60 };
    // A cube that becomes a ball, a twentieth of the way each circle.
    let mut height = 0.03;
    let done = roll(&mut rig, &rolling, Settling::matl_2021(), |_| {
        height += 0.05 * (0.037 - height);
        Ok(height)
    });
    let done = done.unwrap();
    assert!(done.settled && (10..40).contains(&done.heights_m.len()), "{done:?}");
    let mut side = 1.0;
    let never = roll(&mut rig, &rolling, Settling::matl_2021(), |_| {
        side = -side;
        Ok(0.03 + 0.003 * side)
    });
    assert!(never.is_ok_and(|r| !r.settled && r.heights_m.len() == 60));
    let two = Rolling { moves: 2, ..rolling };
    assert!(matches!(
        roll(&mut rig, &two, Settling::matl_2021(), |_| Ok(0.0)),
        Err(RollError::Setting { .. })
    ));
    let far = Rolling { circle_m: 5.0, ..rolling };
    let refused = roll(&mut rig, &far, Settling::matl_2021(), |_| Ok(0.0));
    assert!(matches!(refused, Err(RollError::Device(_, hw_traits::ErrorKind::OutOfRange))));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    #[test]
    fn any_heights_are_taken(heights in proptest::collection::vec(any::<f64>(), 0..60)) {
        let mut settling = Settling::new(3, 1e-3).unwrap();
        for h in heights { settling.push(h); }
    }
}
