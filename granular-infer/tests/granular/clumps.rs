//! Clumps against closed forms and conservation laws.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use approx::assert_relative_eq;
use granular_infer::dem::{
    Clump, Coefficients, DemError, Law, Placed, Setup, Shape, Simulation, Wall, stable_step_s,
};

const R: f64 = 2e-3;
const DENSITY: f64 = 1300.0;
const G: f64 = 9.81;
const LAW: Law = Law::Hertz { modulus_pa: 5e6, poisson_ratio: 0.25 };
/// From x to y.
const TO_Y: [f64; 4] = [0.0, 0.0, std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2];

fn setup(with: Coefficients, angle: f64) -> Setup {
    let plane = Shape::Plane { point_m: [0.0; 3], normal: [0.0, 0.0, 1.0] };
    Setup {
        law: LAW,
        density_kg_m3: DENSITY,
        grains: with,
        walls: vec![Wall { shape: plane, coefficients: with }],
        gravity_m_s2: [G * angle.sin(), 0.0, -G * angle.cos()],
        drag_per_m: 0.0,
        step_s: 0.3 * stable_step_s(&LAW, DENSITY, R, 1.0).unwrap(),
        fastest_m_s: 1.0,
    }
}

/// Two spheres apart: twice the volume, and each one's own moments about the axis and with Steiner's part across it.
#[test]
fn moments_of_two_spheres_are_steiners() {
    let clump = Clump::new(&[([0.1, 0.2, 0.3], R), ([0.1, 0.2 + 3.0 * R, 0.3], R)]).unwrap();
    assert_relative_eq!(clump.volume_m3(), 8.0 / 3.0 * std::f64::consts::PI * R.powi(3), max_relative = 3e-3);
    let mut inertia = clump.inertia_m2();
    inertia.sort_by(f64::total_cmp);
    let own = 0.4 * R * R;
    for (found, expected) in inertia.iter().zip([own, own + 2.25 * R * R, own + 2.25 * R * R]) {
        assert_relative_eq!(*found, expected, max_relative = 3e-3);
    }
    assert_relative_eq!(clump.reach_m(), 2.5 * R, max_relative = 1e-3);
}

/// A rod across the slope rolls with a = g sin / (1 + I/(m R^2)), I that of a cylinder with half spheres at its ends.
#[test]
fn a_rod_rolls_down_an_incline() {
    let angle = 0.2_f64;
    let with = Coefficients::dry(0.5, 0.8, 0.0);
    let setup = setup(with, angle);
    let half = 2.0 * R;
    // Close enough that the union is a smooth rod to 1 %.
    let spheres: Vec<_> = (0..17).map(|k| ([half * (f64::from(k) / 8.0 - 1.0), 0.0, 0.0], R)).collect();
    let clump = Clump::new(&spheres).unwrap();
    let along_x = clump.inertia_m2();
    let thinnest = (0..3).min_by(|a, b| along_x[*a].total_cmp(&along_x[*b])).unwrap();
    // Principal axes come in any order: turn the thin one to y.
    let rotation_xyzw = match thinnest {
        0 => TO_Y,
        1 => [0.0, 0.0, 0.0, 1.0],
        _ => [std::f64::consts::FRAC_1_SQRT_2, 0.0, 0.0, std::f64::consts::FRAC_1_SQRT_2],
    };
    let placed = Placed { clump, position_m: [0.0, 0.0, R], rotation_xyzw };
    let mut s = Simulation::of_clumps(&setup, &[placed]).unwrap();
    s.run((0.1 / setup.step_s) as u64).unwrap();
    let (t, v) = (s.time_s(), s.clump_motions().next().unwrap().0[0]);
    s.run((0.2 / setup.step_s) as u64).unwrap();
    let (velocity, spin) = s.clump_motions().next().unwrap();
    let (cylinder, ends) = (2.0 * half, 4.0 / 3.0 * R);
    let ratio = (0.5 * cylinder + 0.4 * ends) / (cylinder + ends);
    assert_relative_eq!(
        (velocity[0] - v) / (s.time_s() - t),
        G * angle.sin() / (1.0 + ratio),
        max_relative = 0.01
    );
    assert_relative_eq!(spin[1] * R, velocity[0], max_relative = 0.01);
}

/// A clump of one sphere is that sphere.
#[test]
fn a_clump_of_one_is_a_grain() {
    let with = Coefficients::dry(0.5, 0.3, 0.1);
    let setup = setup(with, 0.3);
    let mut alone = Simulation::new(&setup, &[R], &[[0.0, 0.0, 2.0 * R]]).unwrap();
    let clump = Clump::new(&[([0.0; 3], R)]).unwrap();
    let placed = Placed { clump, position_m: [0.0, 0.0, 2.0 * R], rotation_xyzw: [0.0, 0.0, 0.0, 1.0] };
    let mut one = Simulation::of_clumps(&setup, &[placed]).unwrap();
    for s in [&mut alone, &mut one] {
        s.run((0.2 / setup.step_s) as u64).unwrap();
    }
    let (a, b) = (alone.positions_m().next().unwrap(), one.positions_m().next().unwrap());
    for k in 0..3 {
        // The grid's volume is off by some 1e-3, which the dashpots feel.
        assert_relative_eq!(a[k], b[k], epsilon = 1e-3 * 0.06);
    }
}

/// No torque: angular momentum keeps, and so does the energy of an unsymmetric top that tumbles about its middle axis.
#[test]
fn a_top_in_space_keeps_energy_and_momentum() {
    let mut setup = setup(Coefficients::dry(0.5, 0.3, 0.1), 0.0);
    setup.walls.clear();
    setup.gravity_m_s2 = [0.0; 3];
    let clump = Clump::new(&[([0.0; 3], R), ([3.0 * R, 0.0, 0.0], R), ([0.0, 2.0 * R, 0.0], R)]).unwrap();
    let inertia = clump.inertia_m2();
    let mass = DENSITY * clump.volume_m3();
    let placed = Placed { clump, position_m: [0.0; 3], rotation_xyzw: [0.0, 0.0, 0.0, 1.0] };
    let mut s = Simulation::of_clumps(&setup, &[placed]).unwrap();
    let spin = [3.0, 80.0, 2.0];
    s.set_motion(0, [0.1, 0.0, 0.0], spin).unwrap();
    let energy = s.energy().kinetic_j;
    let expected: f64 = (0..3).map(|k| 0.5 * mass * inertia[k] * spin[k] * spin[k]).sum();
    assert_relative_eq!(energy, expected + 0.5 * mass * 0.01, max_relative = 1e-12);
    s.run(20_000).unwrap();
    assert_relative_eq!(s.energy().kinetic_j, energy, max_relative = 1e-4);
    let (position, _) = s.clump_poses().next().unwrap();
    assert_relative_eq!(position[0], 0.1 * s.time_s(), max_relative = 1e-9);
}

/// Two clumps that hit each other keep momentum and angular momentum.
#[test]
fn colliding_clumps_keep_momentum_and_angular_momentum() {
    let mut setup = setup(Coefficients::dry(0.6, 0.4, 0.2), 0.0);
    setup.walls.clear();
    setup.gravity_m_s2 = [0.0; 3];
    let cube = Clump::cube(2.0 * R).unwrap();
    let (mass, inertia) = (DENSITY * cube.volume_m3(), cube.inertia_m2()[0]);
    let at = |x: f64, y: f64| Placed { clump: cube.clone(), position_m: [x, y, 0.0], rotation_xyzw: TO_Y };
    let mut s = Simulation::of_clumps(&setup, &[at(0.0, 0.0), at(2.5 * R, 0.7 * R)]).unwrap();
    s.set_motion(0, [0.6, 0.0, 0.1], [30.0, -20.0, 50.0]).unwrap();
    s.set_motion(1, [-0.3, 0.1, 0.0], [10.0, 0.0, -40.0]).unwrap();
    let momenta = |s: &Simulation| {
        let mut sum = [0.0; 6];
        for ((x, _), (v, w)) in s.clump_poses().zip(s.clump_motions()) {
            let orbit = [x[1] * v[2] - x[2] * v[1], x[2] * v[0] - x[0] * v[2], x[0] * v[1] - x[1] * v[0]];
            for k in 0..3 {
                sum[k] += mass * v[k];
                sum[3 + k] += mass * (orbit[k] + inertia * w[k]);
            }
        }
        sum
    };
    let before = momenta(&s);
    s.run((0.02 / setup.step_s) as u64).unwrap();
    assert!(s.counters().contacts > 10, "they missed each other");
    for (k, (a, b)) in momenta(&s).iter().zip(before).enumerate() {
        // A cube's three moments are one to the grid's rounding only.
        let largest = if k < 3 { 1e-12 * 1e-4 } else { 1e-6 * 1e-7 };
        assert!((a - b).abs() < largest, "{k}: {b} became {a}");
    }
}

#[test]
fn clumps_without_extent_are_refused() {
    assert!(matches!(Clump::new(&[]), Err(DemError::Count { received: 0, .. })));
    assert!(matches!(Clump::new(&[([0.0; 3], 0.0)]), Err(DemError::NotPositive { .. })));
    assert!(matches!(Clump::new(&[([f64::NAN; 3], R)]), Err(DemError::OutOfRange { .. })));
    assert!(matches!(Clump::cylinder(4e-3, 1e-3), Err(DemError::NotPositive { .. })));
    assert!(matches!(Clump::rod(4e-3, 0.5), Err(DemError::OutOfRange { .. })));
    let clump = Clump::rod(4e-3, 1.5).unwrap();
    assert_relative_eq!(clump.volume_m3(), std::f64::consts::PI / 6.0 * 64e-9, max_relative = 0.03);
    let placed = Placed { clump, position_m: [0.0; 3], rotation_xyzw: [0.0; 4] };
    let setup = setup(Coefficients::dry(0.5, 0.3, 0.1), 0.0);
    assert!(matches!(Simulation::of_clumps(&setup, &[placed]), Err(DemError::OutOfRange { .. })));
}
