//! Many grains against the laws of silos, hoppers and heaps.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use crate::common;
use std::f64::consts::PI;

use granular_infer::dem::{
    Coefficients, Funnel, Law, Pour, Setup, Shape, Simulation, Wall, WallMotion, stable_step_s,
};

const D: f64 = 4e-3;
const DENSITY: f64 = 1300.0;
const G: f64 = 9.81;
const LAW: Law = Law::Hertz { modulus_pa: 1e6, poisson_ratio: 0.25 };

/// Grains in a tube of five diameters; its floor sinks slowly, so that friction is fully called on. Load over weight.
fn silo(count: usize, wall_friction: f64) -> f64 {
    let radius_m = 2.5 * D;
    let with = Coefficients::dry(0.3, 0.5, 0.1);
    let wall = |shape, friction| Wall {
        shape,
        coefficients: Coefficients { sliding_friction: friction, rolling_friction: 0.0, ..with },
    };
    let setup = Setup {
        law: LAW,
        density_kg_m3: DENSITY,
        grains: with,
        walls: vec![
            wall(Shape::Plane { point_m: [0.0; 3], normal: [0.0, 0.0, 1.0] }, 0.5),
            wall(Shape::Tube { axis_m: [0.0; 2], radius_m, bottom_m: -0.05 }, wall_friction),
        ],
        gravity_m_s2: [0.0, 0.0, -G],
        drag_per_m: 0.0,
        step_s: stable_step_s(&LAW, DENSITY, 0.5 * D, 1.0).unwrap(),
        fastest_m_s: 1.0,
    };
    // Nine a layer, each layer turned.
    let places: Vec<_> = (0..count)
        .map(|i| {
            let (layer, k) = (i / 9, i % 9);
            let (r, a) =
                if k == 8 { (0.0, 0.0) } else { (1.7 * D, PI / 4.0 * k as f64 + 1.3 * layer as f64) };
            [r * a.cos(), r * a.sin(), (0.6 + 1.02 * layer as f64) * D]
        })
        .collect();
    let mut s = Simulation::new(&setup, &vec![0.5 * D; count], &places).unwrap();
    let run = |s: &mut Simulation, time: f64| s.run((time / setup.step_s) as u64).unwrap();
    run(&mut s, 0.5);
    s.move_wall(0, WallMotion { velocity_m_s: [0.0, 0.0, -0.02], ..WallMotion::default() }).unwrap();
    run(&mut s, 0.2);
    let (mut sum, mut n) = (0.0, 0.0);
    for _ in 0..300 {
        run(&mut s, 2e-3);
        sum -= s.wall_load_n(0).unwrap()[2];
        n += 1.0;
    }
    let weight = s.masses_kg().iter().sum::<f64>() * G;
    sum / n / weight
}

/// Janssen 1895: without friction all of the weight is on the floor; with it the load stops growing with depth. (His curve needs a wider
/// silo than five grains to be tested.)
#[test]
fn a_silo_carries_its_grains_as_janssen_says() {
    let all = silo(180, 0.0);
    assert!((all - 1.0).abs() < 0.03, "{all} of the weight without friction");
    let [once, twice] = [180, 360].map(|count| silo(count, 0.4));
    println!("{once:.3} of the weight, {twice:.3} at twice the depth");
    assert!(once < 0.5 && (2.0 * twice / once - 1.0).abs() < 0.15, "{once} and {twice}");
}

/// Grains a second that leave a flat bottom through an opening, between a tenth and two fifths of the discharge, and their bulk density
/// before, kg/m3.
fn outflow(opening_m: f64) -> (f64, f64) {
    let with = Coefficients::dry(0.3, 0.5, 0.05);
    let count = 1800;
    let pour = Pour {
        size_variation: 0.05,
        law: LAW,
        grains: with,
        ground: with,
        funnel: Funnel {
            outlet_radius_m: 0.5 * opening_m,
            cone_half_angle_rad: 1.55,
            outlet_height_m: 0.3,
            ..common::pour(count).funnel
        },
        ..common::pour(count)
    };
    let mut s = pour.filled(2).unwrap();
    let run = |s: &mut Simulation, time: f64| s.run((time / s.step_s()) as u64).unwrap();
    run(&mut s, 0.25);
    let depth = 2.0 * (s.positions_m().map(|p| p[2]).sum::<f64>() / count as f64 - 0.3);
    let bulk = s.masses_kg().iter().sum::<f64>() / (PI * 0.03 * 0.03 * depth);
    s.remove_wall(Pour::GATE).unwrap();
    let out = |s: &Simulation| s.positions_m().filter(|p| p[2] < 0.3).count();
    let mut from = None;
    loop {
        run(&mut s, 2e-3);
        let n = out(&s);
        match from {
            None if n > count / 10 => from = Some((s.time_s(), n)),
            Some((t, m)) if n > 2 * count / 5 => return ((n - m) as f64 / (s.time_s() - t), bulk),
            _ => assert!(s.time_s() < 5.0, "{n} of {count} left"),
        }
    }
}

/// Beverloo 1961, doi:10.1016/0009-2509(61)85030-6: W = C rho_b sqrt(g) (D - 1.4 d)^(5/2), C 0.55 to 0.65 for what he poured. C comes out
/// somewhat below here: bed and tube are small.
#[test]
fn a_hopper_flows_as_beverloo_says() {
    let mass = PI / 6.0 * D.powi(3) * DENSITY;
    let [narrow, wide] = [5.5, 8.5].map(|n| {
        let (grains_s, bulk) = outflow(n * D);
        let free = (n - 1.4) * D;
        (free, grains_s, grains_s * mass / (bulk * G.sqrt() * free.powf(2.5)))
    });
    let exponent = (wide.1 / narrow.1).ln() / (wide.0 / narrow.0).ln();
    println!("exponent {exponent:.2}, C {:.3} and {:.3}", narrow.2, wide.2);
    assert!((exponent - 2.5).abs() < 0.2, "{exponent}");
    for constant in [narrow.2, wide.2] {
        assert!((constant / 0.58 - 1.0).abs() < 0.2, "{constant}");
    }
}

/// As Zhou, Xu, Yu and Zulli 2002 (doi:10.1016/S0032-5910(01)00520-4) have it. What is called the angle here is that of a cone with the
/// heap's mean height over its median radius.
#[test]
fn repose_rises_with_rolling_friction() {
    let angle = |rolling: f64| {
        let with = Coefficients::dry(0.3, 0.5, rolling);
        let pour = Pour {
            law: LAW,
            grains: with,
            // Rough, so that the heap's foot stays.
            ground: Coefficients::dry(0.3, 0.9, 1.0),
            ..common::pour(600)
        };
        let heap = pour.run(3).unwrap().heap().unwrap();
        // A cone of half its foot's area within the median, its centres at a quarter of its height.
        let foot = heap.median_radius_m * 2.0_f64.sqrt();
        (4.0 * (heap.mean_height_m - 0.5 * D) / foot).atan()
    };
    let angles = [0.05, 0.15, 0.45].map(angle);
    println!("{:?} degrees", angles.map(|a| a.to_degrees().round()));
    assert!(angles[0] < angles[1] && angles[1] < angles[2], "{angles:?}");
}
