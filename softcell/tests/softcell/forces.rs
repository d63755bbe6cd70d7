//! Field, loads, moduli: known answers, recovery from the fake, and what is refused.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use approx::assert_relative_eq;
use proptest::prelude::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use softcell::fake::{Bench, Dome};
use softcell::field::{FieldError, Kernel, Plan};
use softcell::load::{LoadError, ShearLoad, Sheared};
use softcell::modulus::{
    ModulusError, Pair, State, Stiffness, effective, printed_force_n, smallest_indentation_m,
};

fn scattered(n: usize) -> Vec<[f64; 2]> {
    // A low-discrepancy set (plastic number).
    (0..n)
        .map(|k| [(k as f64 * 0.754_877_666).fract() * 400.0, (k as f64 * 0.569_840_291).fract() * 300.0])
        .collect()
}

const KERNELS: [Kernel; 3] =
    [Kernel::ThinPlate, Kernel::Multiquadric { width: 60.0 }, Kernel::Gaussian { width: 50.0 }];

#[test]
fn a_field_goes_through_its_values_and_reproduces_planes() {
    let places = scattered(60);
    for kernel in KERNELS {
        let plan = Plan::new(&places, kernel, 0.0).unwrap();
        let plane = |p: &[f64; 2]| 3.0 - 0.02 * p[0] + 0.05 * p[1];
        let values: Vec<f64> = places.iter().map(plane).collect();
        let field = plan.field(&values).unwrap();
        assert_relative_eq!(field.at([123.0, 77.0]), plane(&[123.0, 77.0]), epsilon = 1e-6);
        let wavy: Vec<f64> = places.iter().map(|p| (p[0] / 90.0).sin() * (p[1] / 70.0).cos()).collect();
        let field = plan.field(&wavy).unwrap();
        for (p, v) in places.iter().zip(&wavy) {
            assert_relative_eq!(field.at(*p), v, epsilon = 1e-5);
        }
        // Between the markers, away from the border.
        let worst = (0..20)
            .map(|k| [100.0 + 10.0 * f64::from(k), 150.0])
            .map(|p| (field.at(p) - (p[0] / 90.0).sin() * (p[1] / 70.0).cos()).abs())
            .fold(0.0, f64::max);
        assert!(worst < 0.06, "{kernel:?}: {worst}");
    }
}

#[test]
fn smoothing_lies_between_values_and_plane() {
    let places = scattered(50);
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let noisy: Vec<f64> = places
        .iter()
        .map(|p| 0.01 * p[0] + 0.3 * Distribution::<f64>::sample(&StandardNormal, &mut rng))
        .collect();
    for kernel in KERNELS {
        let misfit = |smoothing: f64| {
            let plan = Plan::new(&places, kernel, smoothing).unwrap();
            let field = plan.field(&noisy).unwrap();
            places.iter().zip(&noisy).map(|(p, v)| (field.at(*p) - v).powi(2)).sum::<f64>()
        };
        let (none, some, much) = (misfit(0.0), misfit(0.1), misfit(1e3));
        assert!(none < 1e-8 && none < some && some < much, "{kernel:?} {none} {some} {much}");
    }
}

#[test]
fn contours_of_a_cone_are_circles() {
    let mut places = scattered(120);
    places.push([200.0, 150.0]);
    let plan = Plan::new(&places, Kernel::ThinPlate, 0.0).unwrap();
    let values: Vec<f64> = places.iter().map(|p| (p[0] - 200.0).powi(2) + (p[1] - 150.0).powi(2)).collect();
    let field = plan.field(&values).unwrap();
    let contours = field.contours([100.0, 50.0], [300.0, 250.0], (101, 101), &[50f64.powi(2), 1e9]).unwrap();
    assert_eq!(contours[0].lines.len(), 1);
    let line = &contours[0].lines[0];
    assert_eq!(line.first(), line.last());
    for p in line {
        assert_relative_eq!((p[0] - 200.0).hypot(p[1] - 150.0), 50.0, epsilon = 1.5);
    }
    assert!(contours[1].lines.is_empty());
}

#[test]
fn fields_that_cannot_be_are_refused() {
    let places = scattered(10);
    let new = |places: &[[f64; 2]], kernel, smoothing| Plan::new(places, kernel, smoothing).err();
    assert!(matches!(new(&places[..2], Kernel::ThinPlate, 0.0), Some(FieldError::TooFew { .. })));
    let line: Vec<[f64; 2]> = (0..8).map(|k| [f64::from(k), 3.0 * f64::from(k)]).collect();
    assert_eq!(new(&line, Kernel::ThinPlate, 0.0), Some(FieldError::Degenerate));
    let mut twice = places.clone();
    twice[4] = twice[7];
    assert_eq!(new(&twice, Kernel::ThinPlate, 0.0), Some(FieldError::Degenerate));
    assert!(matches!(new(&places, Kernel::Gaussian { width: 0.0 }, 0.0), Some(FieldError::Setting { .. })));
    assert!(matches!(new(&places, Kernel::ThinPlate, -1.0), Some(FieldError::Setting { .. })));
    let plan = Plan::new(&places, Kernel::ThinPlate, 0.0).unwrap();
    assert!(matches!(plan.field(&[0.0; 9]), Err(FieldError::Length { expected: 10, got: 9 })));
    assert!(matches!(plan.field(&[f64::INFINITY; 10]), Err(FieldError::NotFinite { marker: 0 })));
    let field = plan.field(&[0.0; 10]).unwrap();
    assert!(matches!(field.contours([0.0; 2], [1.0; 2], (1, 5), &[0.0]), Err(FieldError::Lattice { .. })));
}

/// Loads that the fake's skin (Mindlin) carries, learned at four pressures, asked for between them.
#[test]
fn loads_are_read_off_the_shear() {
    let mut bench = Bench::matl_2021(1);
    let mut carried = |pressure_pa: f64, shear_m: f64| {
        bench.air.pressure_pa = pressure_pa;
        bench.touch.indentation_m = bench.indentation_now_m();
        bench.carried_n(shear_m)
    };
    let shears: Vec<f64> = (0..=6).map(|k| 0.5e-3 * f64::from(k)).collect();
    let mut samples = Vec::new();
    for pressure_pa in [0.0, 1000.0, 2000.0, 3000.0] {
        samples.extend(shears.iter().map(|&shear_m| Sheared {
            pressure_pa,
            shear_m,
            load_n: carried(pressure_pa, shear_m),
        }));
    }
    let load = ShearLoad::fit(&samples).unwrap();
    for (p, u) in [(500.0, 1.2e-3), (1500.0, 2.7e-3), (2500.0, 0.8e-3)] {
        let (value, sigma) = load.load_n(p, u).unwrap();
        assert!(
            (value - carried(p, u)).abs() < 0.05 * carried(p, u) + 3.0 * sigma,
            "{p} {u}: {value} {sigma}"
        );
        assert!((value / carried(p, u) - 1.0).abs() < 0.08);
    }
    assert!(matches!(load.load_n(9000.0, 1e-3), Err(LoadError::Beyond(_))));
    assert!(matches!(load.load_n(f64::NAN, 1e-3), Err(LoadError::Beyond(_))));
    assert!(matches!(ShearLoad::fit(&samples[..7]), Err(LoadError::Undetermined { pressures: 1, .. })));
    assert!(matches!(ShearLoad::fit(&[]), Err(LoadError::Undetermined { samples: 0, .. })));
    samples[2].load_n = f64::NAN;
    assert!(matches!(ShearLoad::fit(&samples), Err(LoadError::Value { sample: 2, .. })));
}

fn pressed(dome: &Dome, pressure_pa: f64, noise_n: f64, rng: &mut ChaCha8Rng) -> (Vec<f64>, Vec<f64>) {
    let stage: Vec<f64> = (0..80).map(|k| 0.1e-3 * f64::from(k)).collect();
    let force = stage
        .iter()
        .map(|d| {
            dome.force_n(pressure_pa, 0.019, d - 1.5e-3)
                + noise_n * Distribution::<f64>::sample(&StandardNormal, rng)
        })
        .collect();
    (stage, force)
}

#[test]
fn moduli_rise_with_pressure_and_give_the_force_back() {
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    let dome = Dome::matl_2021();
    let pressures = [0.0, 1500.0, 3000.0, 5000.0, 8000.0, 12000.0];
    let mut states = Vec::new();
    for p in pressures {
        let (stage, force) = pressed(&dome, p, 2e-3, &mut rng);
        let pair = Pair { tip_m: dome.radius_at_m(p), probe_m: 0.019 };
        let e = effective(&stage, &force, &pair).unwrap();
        assert!(e.interval_pa.0 < e.modulus_pa && e.modulus_pa < e.interval_pa.1);
        assert!((e.contact_m - 1.5e-3).abs() < 0.4e-3, "{e:?}");
        states.push(State { pressure_pa: p, modulus_pa: e.modulus_pa, tip_m: pair.tip_m });
    }
    assert!(states.windows(2).all(|w| w[0].modulus_pa < w[1].modulus_pa), "{states:?}");
    let stiffness = Stiffness::fit(&states).unwrap();
    // The membrane's terms are not Hertz's: the effective modulus takes them in, to a tenth.
    for p in [2000.0, 4000.0, 7000.0] {
        let truth = dome.force_n(p, 0.019, 5e-3);
        let f = stiffness.force_n(p, 5e-3, 0.1e-3, 0.019).unwrap();
        assert!((f.value / truth - 1.0).abs() < 0.1, "{p}: {f:?} {truth}");
        assert!(f.interval.0 < f.value && f.value < f.interval.1);
    }
    // Firmer is blinder (figure 5.7).
    let least = |p| stiffness.smallest_force_n(p, 0.6e-3, 0.019).unwrap().value;
    assert!(least(0.0) < least(4000.0) && least(4000.0) < least(12000.0));
    assert!(matches!(stiffness.modulus_pa(20e3), Err(ModulusError::Beyond(_))));
    assert!(matches!(stiffness.force_n(1e3, -1.0, 0.0, 0.019), Err(ModulusError::Value { .. })));
    assert!(matches!(Stiffness::fit(&states[..2]), Err(ModulusError::TooFew { got: 2, .. })));
    states[0].modulus_pa = -1.0;
    assert!(matches!(Stiffness::fit(&states), Err(ModulusError::Value { what: "a modulus", .. })));
}

#[test]
fn noise_and_air_have_no_modulus() {
    let mut rng = ChaCha8Rng::seed_from_u64(22);
    let pair = Pair { tip_m: 0.021, probe_m: 0.019 };
    let stage: Vec<f64> = (0..80).map(|k| 0.1e-3 * f64::from(k)).collect();
    let noise: Vec<f64> = stage.iter().map(|_| StandardNormal.sample(&mut rng)).collect();
    assert!(matches!(effective(&stage, &noise, &pair), Err(ModulusError::Fit(_))));
    assert!(matches!(effective(&[], &[], &pair), Err(ModulusError::Fit(_))));
    let bad = Pair { tip_m: -0.021, ..pair };
    assert!(matches!(effective(&stage, &noise, &bad), Err(ModulusError::Value { .. })));
}

#[test]
fn the_printed_formula_is_three_eighths_of_the_corrected_one() {
    let states: Vec<State> =
        (0..3).map(|k| State { pressure_pa: f64::from(k) * 1e3, modulus_pa: 8e3, tip_m: 0.02 }).collect();
    let f = Stiffness::fit(&states).unwrap().force_n(1e3, 3e-3, 0.0, f64::INFINITY).unwrap();
    assert_relative_eq!(printed_force_n(8e3, 0.02, 3e-3) / f.value, 0.375, epsilon = 1e-9);
    // F = 4/3 E/(1 - 1/4) sqrt(R) d^1.5 by hand.
    assert_relative_eq!(f.value, 4.0 / 3.0 * 8e3 / 0.75 * 0.02f64.sqrt() * 3e-3f64.powf(1.5), epsilon = 1e-9);
}

proptest! {
    #[test]
    fn more_markers_see_less(sigma in 1e-3f64..1.0, gain in 1.0f64..1e5, n in 1usize..500) {
        let one = smallest_indentation_m(sigma, gain, n).unwrap();
        let four = smallest_indentation_m(sigma, gain, 4 * n).unwrap();
        prop_assert!((one / four - 2.0).abs() < 1e-9);
    }
}
