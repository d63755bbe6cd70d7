//! Stiffness by matching: the simulated skin against Hertz's law, known moduli recovered, intervals that hold, what is refused.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use approx::assert_relative_eq;
use softcell::fake::{Errors, Object, Palpator, Rings, SoftTip};
use softcell::stiffness::{
    Bound, Calibration, Instrument, Palpation, Plan, Press, Reading, StiffnessError, TipError, TipModulus,
};

const PRESSURES_PA: [f64; 6] = [0.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0];
const CALIBRATED_PA: [f64; 7] = [0.0, 300.0, 700.0, 1500.0, 3000.0, 5000.0, 8000.0];
const FLAT: f64 = f64::INFINITY;

fn object(modulus_pa: f64, radius_m: f64) -> Object {
    Object { modulus_pa, radius_m, dent: 0.0 }
}

fn rig(seed: u64) -> (Palpator, Palpation) {
    let mut rig = Palpator::new(Errors::matl_2021(), seed).unwrap();
    let tip = TipModulus::fit(&rig.calibrate(&CALIBRATED_PA).unwrap()).unwrap();
    let palpation = Palpation::new(tip, Instrument::matl_2021()).unwrap();
    (rig, palpation)
}

fn plan() -> Plan {
    Plan::new(PRESSURES_PA.to_vec(), 5e-3, 8e-3, 28, (1e3, 1e6)).unwrap()
}

/// Rubber alone, without air or skin, is Hertz's elastic body (Johnson 1985, eqs 4.22 to 4.24).
#[test]
fn the_fake_without_air_is_hertz() {
    let tip = SoftTip { skin_n_m: 0.0, body_pa: 5e3, ..SoftTip::matl_2021() };
    let rings = Rings::new(tip.radius_m).unwrap();
    for (object_pa, radius_m) in [(f64::INFINITY, FLAT), (5e3, FLAT), (20e3, 0.03)] {
        let both_pa = 1.0 / (1.0 / tip.body_pa + 1.0 / object_pa);
        let both_m = 1.0 / (1.0 / tip.radius_m + 1.0 / radius_m);
        let contacts = rings.press(&tip, &object(object_pa, radius_m), 0.0, 2e-3).unwrap();
        for c in contacts.iter().filter(|c| c.contact_m > 2.5e-3 && c.contact_m < 5e-3) {
            let hertz_n = 4.0 / 3.0 * both_pa * both_m.sqrt() * c.travel_m.powf(1.5);
            assert_relative_eq!(c.force_n, hertz_n, max_relative = 0.03);
            assert_relative_eq!(c.tip_m / c.travel_m, both_pa / tip.body_pa, max_relative = 0.01);
            assert_relative_eq!(c.contact_m.powi(2), both_m * c.travel_m, max_relative = 0.12);
        }
    }
}

/// Air pushes back with its pressure over the contact, whatever the rubber does.
#[test]
fn the_fake_with_air_bears_pressure_times_area() {
    let tip = SoftTip { skin_n_m: 1.0, body_pa: 20.0, ..SoftTip::matl_2021() };
    let rings = Rings::new(tip.radius_m).unwrap();
    let c = *rings.press(&tip, &object(f64::INFINITY, FLAT), 5e3, 3e-3).unwrap().last().unwrap();
    let air_n = 5e3 * std::f64::consts::PI * c.contact_m.powi(2);
    assert!(c.force_n > 0.95 * air_n && c.force_n < 1.3 * air_n, "{} {air_n}", c.force_n);
}

/// Samples of two Hertzian springs: the tip has `E = 4000 + 5 p`.
fn ideal() -> TipModulus {
    let mut samples = Vec::new();
    for pressure_pa in CALIBRATED_PA {
        for gel_pa in [6e3, 40e3] {
            for depth_m in [0.5e-3, 1e-3, 2e-3, 3e-3, 5e-3] {
                let share = gel_pa / (gel_pa + 4e3 + 5.0 * pressure_pa);
                let (tip_m, gel_m) = (share * depth_m, (1.0 - share) * depth_m);
                samples.push(Calibration {
                    pressure_pa,
                    tip_m,
                    gel_m,
                    contact_m: (0.02 * depth_m).sqrt(),
                    gel_pa,
                });
            }
        }
    }
    TipModulus::fit(&samples).unwrap()
}

fn ideal_press(pressure_pa: f64, object_pa: f64) -> Press {
    let share = object_pa / (object_pa + 4e3 + 5.0 * pressure_pa);
    let reading = |k: i32| {
        let travel_m = 2.5e-4 * f64::from(k) - 1e-3;
        let depth_m = travel_m.max(0.0);
        Reading { travel_m, tip_m: 1e-4 + share * depth_m, contact_m: (0.02 * depth_m).sqrt(), shear_m: 0.0 }
    };
    Press {
        pressure_pa,
        loading: (0..24).map(reading).collect(),
        unloading: (0..24).rev().map(reading).collect(),
    }
}

fn quiet() -> Instrument {
    Instrument {
        tip_noise_m: 1e-6,
        drift_m: 1e-7,
        gain_share: 1e-5,
        ageing_share: 1e-4,
        air_share: 1e-4,
        gel_share: 1e-4,
        model_share: 1e-4,
        ..Instrument::matl_2021()
    }
}

#[test]
fn two_springs_are_told_exactly() {
    let tip = ideal();
    assert_relative_eq!(tip.at(2e3, 7e-3, 1e-3).unwrap().modulus_pa, 14e3, max_relative = 1e-6);
    for object_pa in [1e3, 14e3, 300e3] {
        let mut palpation = Palpation::new(tip.clone(), quiet()).unwrap();
        palpation.add(&ideal_press(2e3, object_pa)).unwrap();
        let estimate = palpation.estimate().unwrap();
        let Bound::Within { value, low, high } = estimate.modulus_pa else { panic!("{estimate:?}") };
        assert_relative_eq!(value, object_pa, max_relative = 0.005);
        assert!(low < object_pa && object_pa < high && high / low < 1.05, "{estimate:?}");
        let Bound::Within { value: spring_n_m, .. } = estimate.spring_n_m else { panic!("{estimate:?}") };
        assert_relative_eq!(spring_n_m, 2.0 * value * estimate.contact_m, max_relative = 1e-12);
        assert_relative_eq!(estimate.contact_m, (0.02f64 * 4.75e-3).sqrt(), max_relative = 0.01);
    }
}

/// Where the error of the tip's share is all there is, the interval is narrowest where both springs are alike: it goes with `1/(s (1 - s))`.
#[test]
fn noise_costs_least_where_stiffnesses_match() {
    let width = |object_pa: f64| {
        let noisy = Instrument { tip_noise_m: 2e-5, ..quiet() };
        let mut palpation = Palpation::new(ideal(), noisy).unwrap();
        palpation.add(&ideal_press(2e3, object_pa)).unwrap();
        palpation.estimate().unwrap().modulus_pa.factor().ln()
    };
    let of = |share: f64| width(14e3 * share / (1.0 - share)) * share * (1.0 - share);
    let matched = of(0.5);
    for share in [0.15, 0.3, 0.7, 0.85] {
        assert_relative_eq!(of(share), matched, max_relative = 0.05);
    }
}

#[test]
fn each_error_of_the_instrument_widens_the_interval() {
    let width = |instrument: Instrument| {
        let mut palpation = Palpation::new(ideal(), instrument).unwrap();
        palpation.add(&ideal_press(2e3, 14e3)).unwrap();
        palpation.estimate().unwrap().modulus_pa.factor()
    };
    let all = width(Instrument::matl_2021());
    for less in [
        Instrument { tip_noise_m: 1e-6, ..Instrument::matl_2021() },
        Instrument { gain_share: 1e-5, ..Instrument::matl_2021() },
        Instrument { drift_m: 1e-7, ..Instrument::matl_2021() },
        Instrument { ageing_share: 1e-5, ..Instrument::matl_2021() },
        Instrument { air_share: 1e-5, ..Instrument::matl_2021() },
        Instrument { gel_share: 1e-5, ..Instrument::matl_2021() },
        Instrument { model_share: 1e-5, ..Instrument::matl_2021() },
    ] {
        assert!(width(less) < all, "{less:?}");
    }
    assert!(width(quiet()) > 1.0);
}

/// On the fake, whose skin is no Hertzian spring, by pressures that are chosen: 120 palpations.
#[test]
fn intervals_hold() {
    let (mut holds, mut of, mut within) = (0, 0, 0);
    for (k, modulus_pa) in [2e3, 5e3, 15e3, 40e3, 120e3, 10e6].into_iter().enumerate() {
        for seed in 0..20 {
            let (mut rig, mut palpation) = rig(1000 * (k as u64 + 1) + seed);
            let radius_m = if seed % 2 == 0 { FLAT } else { 0.03 };
            for _ in 0..3 {
                let pressure_pa = palpation.next(&plan()).unwrap().pressure_pa;
                // A press in some hundreds is refused by chance; it is left out.
                let _ = palpation.add(&rig.press(&object(modulus_pa, radius_m), pressure_pa).unwrap());
            }
            let bound = palpation.estimate().unwrap().modulus_pa;
            of += 1;
            holds += usize::from(bound.holds(modulus_pa));
            within += usize::from(matches!(bound, Bound::Within { .. }));
        }
    }
    println!("{holds} of {of} hold, {within} on both sides");
    // 95 % less two standard deviations of a count.
    assert!(holds >= 109, "{holds} of {of}");
    assert!(within >= 90, "{within} of {of}");
}

/// An object like wood has a lower bound only, one like foam under a firm tip an upper one only.
#[test]
fn far_stiffer_or_softer_objects_are_bounded_on_one_side() {
    for seed in 0..5 {
        let (mut rig, mut palpation) = rig(seed);
        palpation.add(&rig.press(&object(10e6, 0.03), 0.0).unwrap()).unwrap();
        let Bound::AtLeast(low) = palpation.estimate().unwrap().modulus_pa else { panic!() };
        assert!((20e3..10e6).contains(&low), "{low}");
        assert!(palpation.estimate().unwrap().modulus_pa.factor().is_infinite());
        let mut palpation = Palpation::new(rig_tip(seed), Instrument::matl_2021()).unwrap();
        palpation.add(&rig.press(&object(150.0, FLAT), 8e3).unwrap()).unwrap();
        let Bound::AtMost(high) = palpation.estimate().unwrap().modulus_pa else { panic!() };
        assert!((150.0..5e3).contains(&high), "{high}");
    }
}

fn rig_tip(seed: u64) -> TipModulus {
    let mut rig = Palpator::new(Errors::matl_2021(), seed).unwrap();
    TipModulus::fit(&rig.calibrate(&CALIBRATED_PA).unwrap()).unwrap()
}

#[test]
fn a_matched_tip_is_as_stiff_as_the_object() {
    let mut before = -1.0;
    for modulus_pa in [3e3, 12e3, 40e3] {
        let (mut rig, mut palpation) = rig(3);
        assert!(palpation.matched(&plan()).unwrap() > 0.0);
        for _ in 0..4 {
            let pressure_pa = palpation.matched(&plan()).unwrap();
            palpation.add(&rig.press(&object(modulus_pa, FLAT), pressure_pa).unwrap()).unwrap();
        }
        let pressure_pa = palpation.matched(&plan()).unwrap();
        assert!(pressure_pa > before, "{modulus_pa} {pressure_pa}");
        before = pressure_pa;
    }
}

/// What the design expects of a press is what comes of it, to a third; pressures that are chosen get there in fewer presses than the firmest tip on a gel,
/// and than the softest on rubber.
#[test]
fn chosen_pressures_need_fewer_presses() {
    for (modulus_pa, fixed_pa) in [(3e3, 8e3), (100e3, 0.0)] {
        let [mut chosen, mut fixed] = [0.0; 2];
        let mut ratio = 0.0;
        for seed in 20..26 {
            let (mut rig, mut palpation) = rig(seed);
            let mut other = palpation.clone();
            let mut expected = 0.0;
            for _ in 0..3 {
                let next = palpation.next(&plan()).unwrap();
                expected = next.error_share;
                palpation.add(&rig.press(&object(modulus_pa, FLAT), next.pressure_pa).unwrap()).unwrap();
                other.add(&rig.press(&object(modulus_pa, FLAT), fixed_pa).unwrap()).unwrap();
            }
            let of = |p: &Palpation| p.estimate().unwrap().modulus_pa.factor().ln() / 3.92;
            chosen += of(&palpation);
            fixed += of(&other);
            ratio += of(&palpation) / expected / 6.0;
        }
        assert!(chosen < 0.7 * fixed, "{modulus_pa}: {chosen} {fixed}");
        assert!((0.67..1.5).contains(&ratio), "{modulus_pa}: {ratio}");
    }
}

#[test]
fn what_says_nothing_is_refused() {
    let (mut rig, mut palpation) = rig(8);
    assert_eq!(palpation.estimate(), Err(StiffnessError::Undecided { presses: 0 }));
    let gel = object(20e3, FLAT);
    let good = rig.press(&gel, 1e3).unwrap();
    let mut refused = |press: &Press| palpation.add(press).unwrap_err();
    // The stage stops before the object.
    let far = |r: &Reading| Reading { contact_m: 0.0, tip_m: 1e-5, ..*r };
    let air = Press {
        loading: good.loading.iter().map(far).collect(),
        unloading: good.unloading.iter().map(far).collect(),
        ..good.clone()
    };
    assert!(matches!(refused(&air), StiffnessError::NoContact { got: 0, of: 28 }));
    assert!(matches!(refused(&Press { pressure_pa: 20e3, ..good.clone() }), StiffnessError::Beyond(_)));
    assert!(matches!(
        refused(&Press { unloading: vec![], ..good.clone() }),
        StiffnessError::TooFew { got: 0, .. }
    ));
    let mut wrong = good.clone();
    wrong.loading[3].tip_m = f64::NAN;
    assert!(matches!(refused(&wrong), StiffnessError::Value { .. }));
    // A finger that bumps into something else on its way.
    let mut bumped = good.clone();
    for (k, r) in bumped.loading.iter_mut().enumerate() {
        r.tip_m += if k % 2 == 0 { 2e-3 } else { 0.0 };
    }
    assert!(matches!(refused(&bumped), StiffnessError::Misfit { .. }));
    rig.drag_m = 2e-3;
    assert!(matches!(refused(&rig.press(&gel, 1e3).unwrap()), StiffnessError::Slipped { .. }));
    rig.drag_m = 0.0;
    // A dough keeps half of its dent.
    let dough = Object { dent: 0.5, ..gel };
    let hysteresis = refused(&rig.press(&dough, 1e3).unwrap());
    assert!(
        matches!(hysteresis, StiffnessError::Hysteresis { shift_m, .. } if shift_m > 3e-4),
        "{hysteresis:?}"
    );
    assert_eq!(palpation.presses(), 0);
    // An object that was exchanged between two presses.
    palpation.add(&good).unwrap();
    palpation.add(&rig.press(&object(100e3, FLAT), 1e3).unwrap()).unwrap();
    assert!(matches!(palpation.estimate(), Err(StiffnessError::Inconsistent { presses: 2, .. })));
    for instrument in [
        Instrument { tip_noise_m: 0.0, ..Instrument::matl_2021() },
        Instrument { gel_share: f64::NAN, ..Instrument::matl_2021() },
    ] {
        assert!(matches!(Palpation::new(ideal(), instrument), Err(StiffnessError::Value { .. })));
    }
    assert!(matches!(Plan::new(vec![], 5e-3, 8e-3, 28, (1e3, 1e6)), Err(StiffnessError::Value { .. })));
    assert!(matches!(Plan::new(vec![0.0], 5e-3, 8e-3, 28, (1e6, 1e3)), Err(StiffnessError::Value { .. })));
    let beyond = Plan::new(vec![20e3], 5e-3, 8e-3, 28, (1e3, 1e6)).unwrap();
    assert!(matches!(palpation.next(&beyond), Err(StiffnessError::Beyond(_))));
    assert!(matches!(palpation.matched(&beyond), Err(StiffnessError::Beyond(_))));
}

/// The camera's noise is so large that a press bounds nothing.
#[test]
fn a_camera_that_is_too_noisy_bounds_nothing() {
    let blind = Instrument { tip_noise_m: 1.0, ..Instrument::matl_2021() };
    let mut palpation = Palpation::new(ideal(), blind).unwrap();
    palpation.add(&ideal_press(2e3, 14e3)).unwrap();
    assert_eq!(palpation.estimate(), Err(StiffnessError::Undecided { presses: 1 }));
}

#[test]
fn a_tip_is_calibrated_at_several_pressures() {
    let samples = |pressures_pa: &[f64]| {
        Palpator::new(Errors::matl_2021(), 1).unwrap().calibrate(pressures_pa).unwrap()
    };
    assert!(matches!(TipModulus::fit(&samples(&[1e3])), Err(TipError::Undetermined { pressures: 1, .. })));
    assert!(matches!(TipModulus::fit(&[]), Err(TipError::Undetermined { samples: 0, .. })));
    let mut wrong = samples(&CALIBRATED_PA);
    wrong[5].gel_m = -1e-4;
    assert!(matches!(
        TipModulus::fit(&wrong),
        Err(TipError::Value { sample: 5, what: "the gel's indentation", .. })
    ));
    let tip = TipModulus::fit(&samples(&CALIBRATED_PA)).unwrap();
    assert!(tip.scatter_share() > 0.0 && tip.scatter_share() < 0.06, "{}", tip.scatter_share());
    assert_eq!(tip.pressures_pa(), (0.0, 8e3));
    let at = |p: f64| tip.at(p, 8e-3, 2e-3).unwrap();
    assert!(at(0.0).rubber_share > 0.99 && at(8e3).rubber_share < 0.2);
    assert!(at(8e3).modulus_pa > 6.0 * at(0.0).modulus_pa);
    assert!(tip.at(1e3, 5e-2, 2e-3).is_err() && tip.at(-500.0, 8e-3, 2e-3).is_err());
}
