//! Grains against closed forms, conservation laws and refusals.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use crate::common;
use approx::assert_relative_eq;
use granular_infer::dem::{
    Coefficients, DemError, Law, Pour, Rest, Setup, Shape, Simulation, Wall, heap, stable_step_s,
};

const R: f64 = 2e-3;
const DENSITY: f64 = 1300.0;
const G: f64 = 9.81;
const HERTZ: Law = Law::Hertz { modulus_pa: 5e6, poisson_ratio: 0.25 };
const LINEAR: Law = Law::Linear { stiffness_n_m: 500.0, tangential_ratio: 2.0 / 7.0 };

fn ground(coefficients: Coefficients) -> Wall {
    Wall { shape: Shape::Plane { point_m: [0.0; 3], normal: [0.0, 0.0, 1.0] }, coefficients }
}

/// A set-up on the ground with a share of the longest stable step; gravity leans by `angle` towards x.
fn setup(law: Law, with: Coefficients, angle: f64, share: f64) -> Setup {
    Setup {
        law,
        density_kg_m3: DENSITY,
        grains: with,
        walls: vec![ground(with)],
        gravity_m_s2: [G * angle.sin(), 0.0, -G * angle.cos()],
        drag_per_m: 0.0,
        step_s: share * stable_step_s(&law, DENSITY, R, 1.0).unwrap(),
        fastest_m_s: 1.0,
    }
}

/// The damping is chosen so that e is exact for either law; what is left is the step's error.
#[test]
fn a_bounce_has_its_restitution() {
    for law in [HERTZ, LINEAR] {
        for e in [0.3, 0.5, 0.7, 0.9, 0.95] {
            for speed in [0.1, 1.0] {
                let mut setup = setup(law, Coefficients::dry(e, 0.0, 0.0), 0.0, 0.05);
                setup.gravity_m_s2 = [0.0; 3];
                let mut s = Simulation::new(&setup, &[R], &[[0.0, 0.0, 1.01 * R]]).unwrap();
                s.set_motion(0, [0.0, 0.0, -speed], [0.0; 3]).unwrap();
                s.run((0.01 / setup.step_s) as u64).unwrap();
                let back = s.velocities_m_s().next().unwrap()[2];
                assert_relative_eq!(back / speed, e, max_relative = 0.01);
            }
        }
    }
}

/// A grain that lies on the incline at its static overlap.
fn lying(setup: &Setup) -> Simulation {
    let mut s = Simulation::new(setup, &[R], &[[0.0, 0.0, R * (1.0 - 1e-3)]]).unwrap();
    // Without a slope it settles; the slope's motion is measured from there on.
    s.run((0.1 / setup.step_s) as u64).unwrap();
    s
}

fn accelerates(mut s: Simulation, setup: &Setup) -> (f64, f64) {
    let at = |s: &Simulation| {
        (s.time_s(), s.velocities_m_s().next().unwrap()[0], s.spins_rad_s().next().unwrap()[1])
    };
    let a = at(&s);
    s.run((0.2 / setup.step_s) as u64).unwrap();
    let b = at(&s);
    ((b.1 - a.1) / (b.0 - a.0), (b.2 - a.2) / (b.0 - a.0))
}

/// Slope far above the sliding limit: a = g (sin - mu cos), and the spin grows by 5/2 mu g cos / R.
#[test]
fn a_grain_slides_down_a_steep_incline() {
    for law in [HERTZ, LINEAR] {
        let (mu, angle) = (0.2_f64, 1.0_f64);
        let setup = setup(law, Coefficients::dry(0.5, mu, 0.0), angle, 0.5);
        let (a, spin) = accelerates(lying(&setup), &setup);
        assert_relative_eq!(a, G * (angle.sin() - mu * angle.cos()), max_relative = 1e-3);
        // The lever is the radius less the overlap of about 1e-3 R.
        assert_relative_eq!(spin, 2.5 * mu * G * angle.cos() / R, max_relative = 3e-3);
    }
}

/// Rolling without slip: a = 5/7 g sin; with rolling friction above its threshold a = 5/7 g (sin - mu_r cos).
#[test]
fn a_grain_rolls_down_an_incline() {
    for law in [HERTZ, LINEAR] {
        for rolling in [0.0, 0.1] {
            let angle = 0.3_f64;
            let setup = setup(law, Coefficients::dry(0.5, 0.8, rolling), angle, 0.5);
            let (a, spin) = accelerates(lying(&setup), &setup);
            let expected = 5.0 / 7.0 * G * (angle.sin() - rolling * angle.cos());
            assert_relative_eq!(a, expected, max_relative = 3e-3);
            assert_relative_eq!(spin * R, a, max_relative = 3e-3);
        }
    }
}

/// Below tan(angle) = mu_r the grain stands, above it rolls away.
#[test]
fn a_grain_stands_below_the_rolling_threshold() {
    for law in [HERTZ, LINEAR] {
        let rolling = 0.2_f64;
        for (share, stands) in [(0.9, true), (1.1, false)] {
            let setup = setup(law, Coefficients::dry(0.5, 0.8, rolling), (share * rolling).atan(), 0.5);
            // It starts where it would lie on level ground: the slope's load comes suddenly, and what swings is damped.
            let mut flat = setup.clone();
            flat.gravity_m_s2 = [0.0, 0.0, -G];
            let settled = lying(&flat).positions_m().next().unwrap();
            let mut s = Simulation::new(&setup, &[R], &[settled]).unwrap();
            s.run((0.5 / setup.step_s) as u64).unwrap();
            let x0 = s.positions_m().next().unwrap()[0];
            s.run((0.2 / setup.step_s) as u64).unwrap();
            let moved = s.positions_m().next().unwrap()[0] - x0;
            if stands {
                assert!(moved.abs() < 1e-6 * R, "{law:?} moved by {moved}");
            } else {
                assert!(moved > R, "{law:?} moved by {moved}");
            }
        }
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Momentum in kg m/s and angular momentum about the origin in kg m2/s.
fn momenta(s: &Simulation) -> [f64; 6] {
    let mut sum = [0.0; 6];
    let radii: Vec<f64> = s.radii_m().collect();
    let places: Vec<_> = s.positions_m().collect();
    for (i, (v, w)) in s.velocities_m_s().zip(s.spins_rad_s()).enumerate() {
        let (m, r) = (s.masses_kg()[i], radii[i]);
        let orbit = cross(places[i], v);
        for k in 0..3 {
            sum[k] += m * v[k];
            sum[3 + k] += m * orbit[k] + 0.4 * m * r * r * w[k];
        }
    }
    sum
}

/// Unequal grains, oblique, spinning, with all couples: a force that acts at two points, or a couple felt by one only, shows.
#[test]
fn a_collision_keeps_momentum_and_angular_momentum() {
    for law in [HERTZ, LINEAR] {
        let mut with = Coefficients::dry(0.6, 0.4, 0.2);
        with.work_of_adhesion_j_m2 = 0.05;
        let mut setup = setup(law, with, 0.0, 0.5);
        setup.gravity_m_s2 = [0.0; 3];
        setup.walls.clear();
        let places = [[0.1, 0.2, 0.3], [0.1 + 2.6 * R, 0.2 + 0.8 * R, 0.3 - 0.5 * R]];
        let mut s = Simulation::new(&setup, &[R, 1.5 * R], &places).unwrap();
        s.set_motion(0, [0.7, 0.1, -0.2], [50.0, -80.0, 20.0]).unwrap();
        s.set_motion(1, [-0.1, -0.2, 0.1], [-30.0, 10.0, 90.0]).unwrap();
        let before = momenta(&s);
        s.run((0.01 / setup.step_s) as u64).unwrap();
        assert!(s.counters().contacts > 10, "they missed each other");
        let after = momenta(&s);
        // Rounding: some 1e3 steps, each with 1e-16 of terms up to 1e-4 kg m/s and 3e-5 kg m2/s (about a far origin).
        for (k, (a, b)) in after.iter().zip(before).enumerate() {
            let largest = if k < 3 { 1e-4 } else { 3e-5 };
            assert!((a - b).abs() < 1e-12 * largest, "{law:?} {k}: {b} became {a}");
        }
    }
}

/// A closed box: whatever the friction, the sum of kinetic, gravitational and spring energy does not grow.
#[test]
fn energy_is_never_created_in_a_box() {
    for law in [HERTZ, LINEAR] {
        let side = 0.024;
        let with = Coefficients::dry(0.9, 0.4, 0.1);
        let mut setup = setup(law, with, 0.0, 0.25);
        setup.walls.clear();
        for axis in 0..3 {
            for end in [0.0, 1.0] {
                let (mut point_m, mut normal) = ([0.0; 3], [0.0; 3]);
                point_m[axis] = end * side;
                normal[axis] = 1.0 - 2.0 * end;
                setup.walls.push(Wall { shape: Shape::Plane { point_m, normal }, coefficients: with });
            }
        }
        let places: Vec<_> =
            (0..50).map(|i| [i % 5, i / 5 % 5, i / 25].map(|k| 2.2e-3 + 4.5e-3 * f64::from(k))).collect();
        let mut s = Simulation::new(&setup, &[R; 50], &places).unwrap();
        for i in 0..50 {
            let a = i as f64;
            s.set_motion(
                i,
                [0.8 * (7.0 * a).sin(), 0.8 * (3.0 * a).cos(), 0.5 * (5.0 * a).sin()],
                [40.0 * a.sin(); 3],
            )
            .unwrap();
        }
        let first = s.energy().total_j();
        let mut lowest = first;
        for _ in 0..2000 {
            s.run(5).unwrap();
            let now = s.energy().total_j();
            // Verlet's own energy swings by about (omega step)^2/8 of what is in the contacts: 0.2 % of the whole at this step.
            assert!(now < lowest + 2e-3 * first, "{law:?}: {lowest} J became {now} J at {} s", s.time_s());
            lowest = lowest.min(now);
        }
        assert!(lowest < 0.5 * first, "nothing was lost");
    }
}

/// What the rolling spring is for: after rest, no grain goes on by more than a millionth of its diameter.
#[test]
fn a_heap_comes_to_rest_and_does_not_creep() {
    let mut s = common::pour(300).filled(1).unwrap();
    s.remove_wall(3).unwrap();
    // Far below the usual threshold, where speeds are 3e-8 of sqrt(g d): 2e-7 of a diameter in 0.2 s would be left.
    let usual = Rest::usual(s.masses_kg()[0], 2.0 * R, G);
    assert!(s.run_until_rest(&Rest { kinetic_j: 1e-9 * usual.kinetic_j, ..usual }, 4.0).unwrap());
    let before: Vec<_> = s.positions_m().collect();
    s.run((0.2 / s.step_s()) as u64).unwrap();
    for (a, b) in s.positions_m().zip(&before) {
        for k in 0..3 {
            assert!((a[k] - b[k]).abs() < 1e-6 * 2.0 * R, "{b:?} became {a:?}");
        }
    }
    // A heap, not a layer, and all of it above the ground.
    let radii: Vec<f64> = s.radii_m().collect();
    let h = heap(&before, &radii, [0.0; 2]).unwrap();
    assert!(h.height_m > 4.0 * R && before.iter().all(|p| p[2] > 0.99 * R), "{h:?}");
}

#[test]
fn the_same_seed_gives_the_same_bits() {
    let pour = Pour { size_variation: 0.2, most_s: 0.3, ..common::pour(200) };
    let a = pour.run(7).unwrap();
    assert_eq!(a, pour.run(7).unwrap());
    assert_ne!(a.positions_m, pour.run(8).unwrap().positions_m);
}

#[test]
fn an_unstable_step_is_refused() {
    let stable = stable_step_s(&HERTZ, DENSITY, R, 1.0).unwrap();
    let mut setup = setup(HERTZ, Coefficients::dry(0.5, 0.5, 0.1), 0.0, 1.0);
    assert!(Simulation::new(&setup, &[R], &[[0.0, 0.0, R]]).is_ok());
    setup.step_s = 1.01 * stable;
    let received_s = setup.step_s;
    let refused = Simulation::new(&setup, &[R], &[[0.0, 0.0, R]]).unwrap_err();
    assert_eq!(refused, DemError::Step { received_s, stable_s: stable });
    assert!(refused.to_string().contains(&format!("{stable}")));
}

#[test]
fn what_is_out_of_range_is_refused() {
    let good = setup(HERTZ, Coefficients::dry(0.5, 0.5, 0.1), 0.0, 1.0);
    let new = |s: &Setup| Simulation::new(s, &[R], &[[0.0, 0.0, R]]).map(|_| ());
    let restitution = Setup { grains: Coefficients { restitution: 1.5, ..good.grains }, ..good.clone() };
    assert!(matches!(new(&restitution), Err(DemError::OutOfRange { name: "restitution", .. })));
    let law = Setup { law: Law::Hertz { modulus_pa: f64::NAN, poisson_ratio: 0.2 }, ..good.clone() };
    assert!(matches!(new(&law), Err(DemError::NotPositive { name: "modulus_pa", .. })));
    assert!(matches!(
        Simulation::new(&good, &[R; 2], &[[0.0; 3]]),
        Err(DemError::Length { expected: 2, received: 1, .. })
    ));
    assert!(matches!(Simulation::new(&good, &[], &[]), Err(DemError::Count { received: 0, .. })));
    assert!(matches!(common::pour(20_001).run(1), Err(DemError::Count { received: 20_001, .. })));
}

/// A fall through the air reaches sqrt(g/k).
#[test]
fn drag_has_its_terminal_speed() {
    let mut setup = setup(HERTZ, Coefficients::dry(0.5, 0.5, 0.1), 0.0, 1.0);
    setup.drag_per_m = 2.0;
    setup.walls.clear();
    let mut s = Simulation::new(&setup, &[R], &[[0.0, 0.0, 0.0]]).unwrap();
    s.run((3.0 / setup.step_s) as u64).unwrap();
    // 3 s are 13 time constants.
    assert_relative_eq!(s.velocities_m_s().next().unwrap()[2], -(G / 2.0_f64).sqrt(), max_relative = 1e-6);
}
