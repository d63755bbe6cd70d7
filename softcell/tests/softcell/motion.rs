//! Shear, indentation and torsion told apart; slip noticed.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use proptest::prelude::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, Uniform};
use softcell::fake::{Dome, Eye, Touch};
use softcell::shear::{Motion, MotionError, MotionSettings, Moved, motion};
use softcell::slip::SlipDetector;

const SIGMA: f64 = 0.1;

/// Markers seen before and after, with noise.
fn seen(before: &Touch, after: &Touch, rng: &mut ChaCha8Rng) -> Vec<Moved> {
    let (dome, eye) = (Dome::matl_2021(), Eye::matl_2021());
    let mut noise = || -> f64 { SIGMA * Distribution::<f64>::sample(&StandardNormal, rng) };
    let mut moved = Vec::new();
    for m in &dome.markers {
        let pixel = |t: &Touch| eye.pixel(t.point(&dome, 2000.0, *m)).unwrap();
        let (home, to) = (pixel(before), pixel(after));
        moved.push(Moved { home, by: [to[0] - home[0] + noise(), to[1] - home[1] + noise()] });
    }
    moved
}

fn judge(before: &Touch, after: &Touch, rng: &mut ChaCha8Rng) -> Motion {
    motion(&seen(before, after, rng), &MotionSettings::new(SIGMA)).unwrap()
}

fn present(m: &Motion) -> [bool; 3] {
    [m.shear_part.present, m.indentation_part.present, m.torsion_part.present]
}

/// A contact at a random place near the axis, pressed in by 3 to 6 mm.
fn contact(rng: &mut ChaCha8Rng) -> Touch {
    let mut of = |low: f64, high: f64| Uniform::new(low, high).unwrap().sample(rng);
    Touch { at_m: [of(-3e-3, 3e-3), of(-3e-3, 3e-3)], indentation_m: of(3e-3, 6e-3), ..Touch::none() }
}

#[test]
fn each_motion_is_named_and_no_other() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut wrong = [0; 4];
    const WORLDS: usize = 60;
    for _ in 0..WORLDS {
        let rest = contact(&mut rng);
        let mut of = |low: f64, high: f64| Uniform::new(low, high).unwrap().sample(&mut rng);
        let angle = of(0.0, std::f64::consts::TAU);
        let far = of(0.5e-3, 2e-3);
        let shear = Touch { shear_m: [far * angle.cos(), far * angle.sin()], ..rest };
        let torsion = Touch { turn_rad: of(0.05, 0.2), ..rest };
        let press = Touch { indentation_m: rest.indentation_m + of(0.5e-3, 2e-3), ..rest };
        let mut count = |k: usize, after: &Touch, expected: [bool; 3]| {
            let m = judge(&rest, after, &mut rng);
            if !m.moved && expected != [false; 3] || present(&m) != expected {
                wrong[k] += 1;
            }
        };
        count(0, &rest, [false; 3]);
        count(1, &shear, [true, false, false]);
        count(2, &press, [false, true, false]);
        count(3, &torsion, [false, false, true]);
    }
    println!(
        "wrong of {WORLDS}: still {}, shear {}, indentation {}, torsion {}",
        wrong[0], wrong[1], wrong[2], wrong[3]
    );
    assert!(wrong.iter().all(|&w| w <= WORLDS / 20), "{wrong:?}");
}

#[test]
fn shear_and_torsion_together_are_both_there_and_measured() {
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    let rest = Touch { indentation_m: 5e-3, ..Touch::none() };
    let after = Touch { shear_m: [1.5e-3, 0.0], turn_rad: 0.15, ..rest };
    let m = judge(&rest, &after, &mut rng);
    assert!(m.shear_part.present && m.torsion_part.present, "{m:?}");
    assert!((m.torsion_rad - 0.15).abs() < 0.04, "{}", m.torsion_rad);
    // 640 pixels times 1.5 mm over 67 + 21 + 1 - 5 mm.
    assert!((m.shear[0] / 11.3 - 1.0).abs() < 0.2 && m.shear[1].abs() < 0.6, "{:?}", m.shear);
}

/// Noise alone is called a motion as often as the level says.
#[test]
fn false_alarms_of_motion_are_as_rare_as_asked_for() {
    let mut rng = ChaCha8Rng::seed_from_u64(13);
    let rest = Touch { indentation_m: 4e-3, ..Touch::none() };
    let settings = MotionSettings { level: 0.05, ..MotionSettings::new(SIGMA) };
    let alarms = (0..400).filter(|_| motion(&seen(&rest, &rest, &mut rng), &settings).unwrap().moved).count();
    // Binomial(400, 0.05): 99.9 % between 7 and 36.
    assert!((7..=36).contains(&alarms), "{alarms}");
}

#[test]
fn what_cannot_be_judged_is_an_error() {
    let at = |x: f64, y: f64| Moved { home: [x, y], by: [0.1, 0.0] };
    let ring: Vec<Moved> = (0..12).map(|k| at(f64::from(k).sin(), f64::from(k).cos())).collect();
    let settings = MotionSettings::new(SIGMA);
    assert!(matches!(motion(&ring[..6], &settings), Err(MotionError::TooFew { got: 6, .. })));
    let line: Vec<Moved> = (0..12).map(|k| at(f64::from(k), 2.0 * f64::from(k))).collect();
    assert!(matches!(motion(&line, &settings), Err(MotionError::OnALine { .. })));
    let point = vec![at(1.0, 1.0); 12];
    assert!(matches!(motion(&point, &settings), Err(MotionError::OnALine { .. })));
    let mut broken = ring.clone();
    broken[3].by[1] = f64::NAN;
    assert!(matches!(motion(&broken, &settings), Err(MotionError::NotFinite { marker: 3 })));
    for settings in [
        MotionSettings::new(0.0),
        MotionSettings { level: 1.0, ..settings },
        MotionSettings { share: f64::NAN, ..settings },
    ] {
        assert!(matches!(motion(&ring, &settings), Err(MotionError::Setting { .. })));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    /// Markers that all move alike are sheared by just that, wherever and in whatever unit.
    #[test]
    fn a_common_shift_is_shear(u in 0.5f64..50.0, angle in 0.0f64..std::f64::consts::TAU, scale in 1e-4f64..1e3) {
        let by = [scale * u * angle.cos(), scale * u * angle.sin()];
        let markers: Vec<Moved> = (0..40)
            .map(|k| Moved { home: [scale * (k % 8) as f64 * 30.0, scale * (k / 8) as f64 * 30.0], by })
            .collect();
        let m = motion(&markers, &MotionSettings::new(0.05 * scale)).unwrap();
        prop_assert_eq!(present(&m), [true, false, false]);
        prop_assert!((m.mean[0] - by[0]).abs() < 1e-9 * scale * u);
        prop_assert!(m.residual < 1e-3 * scale * u);
    }
}

#[test]
fn a_slip_is_noticed_soon_and_seldom_where_there_is_none() {
    let mut rng = ChaCha8Rng::seed_from_u64(14);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    // Independent changes: what the mean number between alarms is stated for.
    let mut detector = SlipDetector::new(1.0, 1.0, 1000.0).unwrap();
    let (mut alarms, mut at) = (0, [0.0; 2]);
    for k in 0..100_000 {
        at = [at[0] + normal(), at[1] + normal()];
        alarms += usize::from(detector.push(f64::from(k), at).is_some());
    }
    // A mean of 100; Siegmund's formula is good to some 10 %.
    assert!((60..=140).contains(&alarms), "{alarms}");

    let mut detector = SlipDetector::new(0.05, 0.1, 1e5).unwrap();
    let mut first = None;
    for k in 0..200 {
        let slid = f64::from((k - 100).max(0)) * 0.2;
        let shear = [slid * 0.6 + 0.02 * normal(), slid * 0.8 + 0.02 * normal()];
        first = first.or(detector.push(f64::from(k), shear));
    }
    let slip = first.unwrap();
    assert!((100.0..=110.0).contains(&slip.noticed_s) && (96.0..=104.0).contains(&slip.began_s), "{slip:?}");
    assert!(SlipDetector::new(0.0, 1.0, 1e3).is_err() && SlipDetector::new(1.0, 1.0, f64::NAN).is_err());
}
