//! Places from arrivals alone: the second solution, places in space, and microphones surveyed by taps.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use crate::common::Dice;
use bounce_audio::localise::{
    Array, ArrayError, SurveyError, SurveyPrior, Tap, locate_in_space, speed_of_sound_m_s, survey,
};

const C: f64 = 343.0;
const TRIANGLE: [[f64; 3]; 3] = [[0.0, 0.0, 0.0762], [0.55, 0.0, 0.0762], [0.275, 0.55, 0.0762]];

fn arrivals(microphones: &[[f64; 3]], place: [f64; 3]) -> Vec<f64> {
    let far = |m: &[f64; 3]| (0..3).map(|k| (m[k] - place[k]).powi(2)).sum::<f64>().sqrt() / C;
    microphones.iter().map(far).collect()
}

fn centred(mut t: Vec<f64>) -> Vec<f64> {
    let mean = t.iter().sum::<f64>() / t.len() as f64;
    t.iter_mut().for_each(|t| *t -= mean);
    t
}

#[test]
fn sound_is_faster_in_warm_air() {
    // Cramer 1993 (doi:10.1121/1.405827) has 343.37 m/s for dry air at 20 degrees, of an atmosphere with 314 ppm of carbon dioxide.
    assert!((speed_of_sound_m_s(293.15) - 343.37).abs() < 0.2);
    assert_eq!(speed_of_sound_m_s(273.15), 331.3);
}

/// Wherever a second place is named it has the same arrivals, and it is named wherever a lattice search sees one.
#[test]
fn the_second_place_is_found() {
    let array = Array::new(&TRIANGLE, C).unwrap();
    let (mut named, mut dice) = (0, Dice(1));
    for _ in 0..150 {
        let place = [-0.3 + 1.15 * dice.roll(), -0.3 + 1.15 * dice.roll()];
        let heard = centred(arrivals(&TRIANGLE, [place[0], place[1], 0.0]));
        let misfit = |x: f64, y: f64| {
            let t = centred(arrivals(&TRIANGLE, [x, y, 0.0]));
            t.iter().zip(&heard).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
        };
        let second = array.second_place(&heard, 1e-8);
        if let Some([x, y]) = second {
            named += 1;
            assert!(misfit(x, y) < 1e-7, "{place:?}: {x}, {y} is off by {} s", misfit(x, y));
        }
        // Valleys of the misfit on a fine lattice that go down to nothing, merged where they are close.
        let step = 0.01;
        let mut valleys: Vec<[f64; 2]> = Vec::new();
        for i in -70..130 {
            for j in -70..130 {
                let (x, y) = (step * f64::from(i), step * f64::from(j));
                if misfit(x, y) < 4e-6 && !valleys.iter().any(|v| (v[0] - x).hypot(v[1] - y) < 0.08) {
                    valleys.push([x, y]);
                }
            }
        }
        // Where the two are close to one another the lattice sees one valley.
        if valleys.len() == 2 {
            assert!(second.is_some(), "{place:?} has {valleys:?}");
        }
    }
    println!("{named} of 150 places have a second one");
    assert!(named > 10 && named < 140);
    assert_eq!(array.second_place(&[0.0; 2], 1e-8), None);
    assert_eq!(array.second_place(&[0.0, f64::NAN, 0.0], 1e-8), None);
}

#[test]
fn places_in_space() {
    let mut dice = Dice(2);
    let mut second = 0;
    for n in [4, 5, 6, 9] {
        for _ in 0..60 {
            let mut point = |low: f64, high: f64| [0, 1, 2].map(|_| low + (high - low) * dice.roll());
            let microphones: Vec<[f64; 3]> = (0..n).map(|_| point(0.0, 1.0)).collect();
            let place = point(-0.3, 1.3);
            let found = locate_in_space(&microphones, C, &arrivals(&microphones, place));
            let found = found.unwrap();
            let off = |p: [f64; 3]| (0..3).map(|k| (p[k] - place[k]).powi(2)).sum::<f64>().sqrt();
            let best = found.second_m.map_or(f64::INFINITY, off).min(off(found.position_m));
            assert!(best < 1e-5, "{n} microphones: {best} m off");
            assert_eq!(found.residual_s.is_some(), n > 4);
            second += usize::from(found.second_m.is_some());
            if n > 5 {
                assert_eq!(found.second_m, None, "{n} microphones leave one place");
            }
        }
    }
    println!("{second} second places");
    assert!(second > 0, "four microphones leave two at times");
}

/// Microphones in a plane hear what is above it and its mirror image below alike: the one above comes first.
#[test]
fn a_plane_of_microphones_has_two_sides() {
    let square = [[0.0, 0.0, 0.5], [1.0, 0.0, 0.5], [1.0, 1.0, 0.5], [0.0, 1.0, 0.5], [0.4, 0.2, 0.5]];
    let found = locate_in_space(&square, C, &arrivals(&square, [0.3, 0.6, 0.2])).unwrap();
    approx::assert_relative_eq!(found.position_m[..], [0.3, 0.6, 0.8], epsilon = 1e-6);
    approx::assert_relative_eq!(found.second_m.unwrap()[..], [0.3, 0.6, 0.2], epsilon = 1e-6);
}

/// With noise the covariance says how far places scatter.
#[test]
fn the_spatial_covariance_holds() {
    let microphones = [
        [0.0, 0.0, 0.1],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.1],
        [0.0, 1.0, 0.0],
        [0.5, 0.5, 0.9],
        [0.0, 0.4, 0.8],
    ];
    let (place, sigma, mut dice) = ([0.4, 0.7, 0.3], 3e-6, Dice(4));
    let (mut z, n) = (0.0, 400);
    for _ in 0..n {
        let heard: Vec<f64> =
            arrivals(&microphones, place).into_iter().map(|t| t + 0.7 + sigma * dice.normal()).collect();
        let found = locate_in_space(&microphones, C, &heard).unwrap();
        let c = nalgebra::Matrix3::from_fn(|i, j| found.cofactor_m2_s2[i][j] * sigma * sigma);
        let off = nalgebra::Vector3::from_fn(|k, _| found.position_m[k] - place[k]);
        z += off.dot(&(c.try_inverse().unwrap() * off)) / f64::from(3 * n);
    }
    println!("mean square of z {z:.3}");
    assert!((z - 1.0).abs() < 0.15, "{z}");
}

#[test]
fn taps_put_microphones_right() {
    let truth = [[0.0, 0.0, 0.08], [0.5, 0.01, 0.05], [0.52, 0.5, 0.08], [0.0, 0.5, 0.1]];
    let prior = SurveyPrior { position_sigma_m: 5e-3, speed_sigma_m_s: 3.0, arrival_sigma_s: 2e-6 };
    let (mut z, mut chi, mut dice) = (Vec::new(), Vec::new(), Dice(6));
    for _ in 0..20 {
        let stated = truth.map(|m| m.map(|v| v + 5e-3 * dice.normal()));
        let stated_speed = C + 3.0 * dice.normal();
        let mut taps: Vec<Tap> = (0..25)
            .map(|_| {
                let place_m = [0.5 * dice.roll(), 0.5 * dice.roll(), 0.0];
                let t =
                    arrivals(&truth, place_m).into_iter().map(|t| t + 3.0 + 2e-6 * dice.normal()).collect();
                Tap { place_m, arrivals_s: t }
            })
            .collect();
        let found = survey(&stated, stated_speed, &taps, &prior).unwrap();
        for (i, m) in truth.iter().enumerate() {
            for (k, coordinate) in m.iter().enumerate() {
                z.push((found.microphones_m[i][k] - coordinate) / found.sigmas_m[i][k]);
                // Along the table taps tell a millimetre.
                assert!(k == 2 || found.sigmas_m[i][k] < 2e-3, "{:?}", found.sigmas_m);
            }
        }
        z.push((found.speed_of_sound_m_s.0 - C) / found.speed_of_sound_m_s.1);
        chi.push(found.chi_square);
        // A tap whose place was written down wrongly shows.
        taps[3].place_m[0] += 0.05;
        assert!(survey(&stated, stated_speed, &taps, &prior).unwrap().chi_square > 5.0);
    }
    let mean = |v: &[f64], f: fn(f64) -> f64| v.iter().map(|v| f(*v)).sum::<f64>() / v.len() as f64;
    let (z, chi) = (mean(&z, |z| z * z), mean(&chi, |c| c));
    println!("mean square of z {z:.2}, chi-square {chi:.2}");
    assert!((0.6..1.6).contains(&z) && (0.8..1.2).contains(&chi), "{z} and {chi}");
}

#[test]
fn nonsense_is_an_error() {
    let four = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let off = |m: &[[f64; 3]], c, t: &[f64]| locate_in_space(m, c, t).unwrap_err();
    assert_eq!(off(&four[..3], C, &[0.0; 3]), ArrayError::TooFew { expected: 4, got: 3 });
    assert_eq!(off(&four, C, &[0.0; 3]), ArrayError::TooFew { expected: 4, got: 3 });
    assert!(matches!(off(&four, -1.0, &[0.0; 4]), ArrayError::Value { .. }));
    assert!(matches!(off(&four, C, &[0.0, f64::NAN, 0.0, 0.0]), ArrayError::Value { .. }));
    let line = [0.0, 1.0, 2.0, 3.0].map(|x| [x, 2.0 * x, 0.0]);
    assert!(matches!(off(&line, C, &[0.0; 4]), ArrayError::OnALine { .. }));
    let prior = SurveyPrior { position_sigma_m: 5e-3, speed_sigma_m_s: 3.0, arrival_sigma_s: 2e-6 };
    let tap = |n: usize| Tap { place_m: [0.1, 0.2, 0.0], arrivals_s: vec![0.0; n] };
    assert_eq!(survey(&four, C, &[], &prior), Err(SurveyError::TooFew { taps: 0, microphones: 4 }));
    assert_eq!(
        survey(&four, C, &[tap(4), tap(3)], &prior),
        Err(SurveyError::Arrivals { tap: 1, expected: 4, got: 3 })
    );
    let no = SurveyPrior { arrival_sigma_s: 0.0, ..prior };
    assert!(matches!(survey(&four, C, &[tap(4)], &no), Err(SurveyError::Value(_))));
}
