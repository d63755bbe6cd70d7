//! Places of single impacts: made here, and the practice taps.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use crate::common::{Burst, Dice, hiss, quantile, shared, strike};
use bounce_audio::localise::{ArrayError, LocaliseError, Localiser};
use bounce_audio::wav::Sound;

const C: f64 = 343.0;
const TRIANGLE: [[f64; 3]; 3] = [[0.0, 0.0, 0.0762], [0.55, 0.0, 0.0762], [0.275, 0.55, 0.0762]];
const SQUARE: [[f64; 3]; 4] = [[0.0, 0.0, 0.08], [0.5, 0.0, 0.05], [0.5, 0.5, 0.08], [0.0, 0.5, 0.1]];

/// Where the sound first stands out of its first 4 ms.
fn first_sound(channels: &[Vec<f64>], rate: f64) -> usize {
    let lead = (0.004 * rate) as usize;
    let first = |x: &Vec<f64>| {
        let sigma = (x[..lead].iter().map(|v| v * v).sum::<f64>() / lead as f64).sqrt();
        x.iter().position(|v| v.abs() > 6.0 * sigma).unwrap_or(x.len())
    };
    channels.iter().map(first).min().unwrap()
}

fn cut(channels: &[Vec<f64>], from: usize, length: usize) -> Vec<&[f64]> {
    channels.iter().map(|x| &x[from..from + length]).collect()
}

/// 30 taps in a simulated room (rir simulation of another package): at least as good as the peers on them.
#[test]
#[ignore = "needs ../shared"]
fn shared_practice_taps_are_found() {
    let folder = shared("practice/localisation");
    let mut errors = Vec::new();
    let mut z = 0.0;
    for line in std::fs::read_to_string(folder.join("truth.csv")).unwrap().lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let truth: Vec<f64> = cells[1..].iter().map(|c| c.parse().unwrap()).collect();
        let sound = Sound::read(folder.join(cells[0])).unwrap();
        let mut localiser = Localiser::new(&TRIANGLE, sound.rate_hz, C, 485).unwrap();
        let start = first_sound(&sound.channels, sound.rate_hz) - 88;
        let found = localiser.locate(&cut(&sound.channels, start, 485)).unwrap();
        let off = [found.x_m - truth[0], found.y_m - truth[1]];
        errors.push(off[0].hypot(off[1]));
        let c = found.covariance_m2;
        let det = c[0][0] * c[1][1] - c[0][1] * c[1][0];
        z += (c[1][1] * off[0] * off[0] - 2.0 * c[0][1] * off[0] * off[1] + c[0][0] * off[1] * off[1]) / det;
        assert_eq!(found.residual_s, None);
    }
    let mm: Vec<f64> = errors.iter().map(|e| 1e3 * e).collect();
    let [median, p90, worst] = [0.5, 0.9, 1.0].map(|q| quantile(&mm, q));
    let mean = mm.iter().sum::<f64>() / mm.len() as f64;
    let z = z / 60.0;
    println!(
        "taps: median {median:.2} mm, mean {mean:.2}, p90 {p90:.2}, worst {worst:.2}; mean square of z {z:.2}"
    );
    assert_eq!(mm.len(), 30);
    assert!(median <= 0.5 && worst <= 2.0, "median {median} mm, worst {worst} mm");
    // The sigmas are honest to a factor of 2 or so.
    assert!((0.1..2.5).contains(&z), "mean square of z {z}");
}

#[test]
fn made_taps_are_found_and_their_sigmas_hold() {
    let mut dice = Dice(11);
    for (microphones, rate) in [(&TRIANGLE[..], 44_100.0), (&SQUARE[..], 48_000.0), (&SQUARE[..], 22_050.0)] {
        let buffer = (0.011 * rate) as usize;
        let mut localiser = Localiser::new(microphones, rate, C, buffer).unwrap();
        let (mut z, mut errors) = (0.0, Vec::new());
        for _ in 0..40 {
            let place = [0.05 + 0.45 * dice.roll(), 0.05 + 0.4 * dice.roll()];
            let mut channels = vec![vec![0.0; (0.03 * rate) as usize]; microphones.len()];
            strike(&mut channels, rate, microphones, C, place, 0.008, &Burst::new(&mut dice), 0.5);
            hiss(&mut channels, 0.01, &mut dice);
            let start = first_sound(&channels, rate) - (0.002 * rate) as usize;
            let found = localiser.locate(&cut(&channels, start, buffer)).unwrap();
            let off = [found.x_m - place[0], found.y_m - place[1]];
            errors.push(1e3 * off[0].hypot(off[1]));
            z += off[0] * off[0] / found.covariance_m2[0][0] + off[1] * off[1] / found.covariance_m2[1][1];
            assert_eq!(found.residual_s.is_some(), microphones.len() > 3);
            if let Some(left) = found.residual_s {
                assert!(left < 2e-5, "{left} s are left of a right place");
            }
        }
        let (median, z) = (quantile(&errors, 0.5), z / 80.0);
        println!(
            "{} microphones, {rate} Hz: median {median:.3} mm, mean square of z {z:.2}",
            microphones.len()
        );
        assert!(median < 0.5, "median {median} mm");
        assert!((0.1..2.5).contains(&z), "mean square of z {z}");
    }
}

/// Without noise nothing but the method is left: below 0.1 mm.
#[test]
fn fractions_of_a_sample_are_told_apart() {
    let mut dice = Dice(3);
    let mut localiser = Localiser::new(&SQUARE, 48_000.0, C, 528).unwrap();
    for k in 0..20 {
        let place = [0.2 + 1e-3 * f64::from(k), 0.3 - 2e-4 * f64::from(k)];
        let mut channels = vec![vec![0.0; 1_400]; 4];
        strike(&mut channels, 48_000.0, &SQUARE, C, place, 0.008, &Burst::new(&mut dice), 0.5);
        hiss(&mut channels, 1e-5, &mut dice);
        let found = localiser.locate(&cut(&channels, 370, 528)).unwrap();
        let off = (found.x_m - place[0]).hypot(found.y_m - place[1]);
        assert!(off < 1e-4, "{off} m off");
    }
}

/// With four microphones a wrong one shows, with three it does not.
#[test]
fn a_fourth_microphone_betrays_a_wrong_one() {
    let mut dice = Dice(5);
    let mut channels = vec![vec![0.0; 1_400]; 4];
    strike(&mut channels, 48_000.0, &SQUARE, C, [0.15, 0.35], 0.008, &Burst::new(&mut dice), 0.5);
    hiss(&mut channels, 1e-3, &mut dice);
    let mut stated = SQUARE;
    stated[1][0] += 0.02;
    let left = |microphones: &[[f64; 3]]| {
        let mut localiser = Localiser::new(microphones, 48_000.0, C, 528).unwrap();
        localiser.locate(&cut(&channels[..microphones.len()], 370, 528)).unwrap().residual_s
    };
    let (right, wrong) = (left(&SQUARE).unwrap(), left(&stated).unwrap());
    assert!(right < 2e-6 && wrong > 1e-5, "{right} s and {wrong} s");
    assert_eq!(left(&stated[..3]), None);
}

#[test]
fn nonsense_is_an_error() {
    let new = |m: &[[f64; 3]], rate, c, n| Localiser::new(m, rate, c, n).err();
    let few = |got| Some(LocaliseError::Array(ArrayError::TooFew { expected: 3, got }));
    assert_eq!(new(&SQUARE[..2], 48_000.0, C, 528), few(2));
    assert_eq!(new(&SQUARE[..1], 48_000.0, C, 528), few(1));
    let line = [[0.0, 0.0, 0.1], [0.1, 0.1, 0.2], [0.4, 0.4, 0.1], [0.5, 0.5001, 0.1]];
    let on_a_line = new(&line, 48_000.0, C, 528);
    assert!(matches!(on_a_line, Some(LocaliseError::Array(ArrayError::OnALine { .. }))), "{on_a_line:?}");
    assert!(matches!(
        new(&[[0.1, 0.1, 0.1]; 3], 48e3, C, 528),
        Some(LocaliseError::Array(ArrayError::OnALine { .. }))
    ));
    let nan = new(&[[f64::NAN, 0.0, 0.0], SQUARE[1], SQUARE[2]], 48e3, C, 528);
    assert!(matches!(nan, Some(LocaliseError::Array(ArrayError::Value { .. }))));
    for c in [0.0, -343.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(new(&SQUARE, 48e3, c, 528), Some(LocaliseError::Array(ArrayError::Value { .. }))));
    }
    for rate in [0.0, 1_500.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(new(&SQUARE, rate, C, 528), Some(LocaliseError::Rate { .. })), "{rate}");
    }
    for n in [0, 100, 1 << 20] {
        assert!(matches!(new(&SQUARE, 48e3, C, n), Some(LocaliseError::Buffer { .. })), "{n}");
    }
    // A kilometre of table is no panic either.
    let far = SQUARE.map(|m| m.map(|v| v * 1e9));
    assert!(matches!(new(&far, 48e3, C, 528), Some(LocaliseError::Buffer { .. })));
    let mut localiser = Localiser::new(&SQUARE, 48e3, C, 528).unwrap();
    let silence = vec![0.0; 528];
    let refused = localiser.locate(&[&silence[..]; 4]);
    assert_eq!(refused, Err(LocaliseError::Energy { channel: 0, got: 0.0 }));
    assert_eq!(localiser.locate(&[&silence[..]; 3]), Err(LocaliseError::Channels { expected: 4, got: 3 }));
    let short = localiser.locate(&[&silence[..], &silence[..], &silence[..9], &silence[..]]);
    assert_eq!(short, Err(LocaliseError::Length { channel: 2, expected: 528, got: 9 }));
    let mut broken = silence.clone();
    broken[40] = f64::NAN;
    let refused = localiser.locate(&[&broken[..]; 4]);
    assert!(matches!(refused, Err(LocaliseError::Energy { channel: 0, .. })), "{refused:?}");
}

/// Prints how long one place takes: `cargo test --release -p bounce-audio --test bounce localise -- --ignored --nocapture`.
#[test]
#[ignore = "by hand: a time depends on the machine"]
fn time_of_one_place() {
    let mut dice = Dice(7);
    for microphones in [&TRIANGLE[..], &SQUARE[..]] {
        let mut channels = vec![vec![0.0; 1_400]; microphones.len()];
        strike(&mut channels, 44_100.0, microphones, C, [0.2, 0.3], 0.008, &Burst::new(&mut dice), 0.5);
        hiss(&mut channels, 0.01, &mut dice);
        let mut localiser = Localiser::new(microphones, 44_100.0, C, 485).unwrap();
        let buffer = cut(&channels, 300, 485);
        let times: Vec<f64> = (0..2_000)
            .map(|_| {
                let start = std::time::Instant::now();
                std::hint::black_box(localiser.locate(std::hint::black_box(&buffer)).unwrap());
                1e6 * start.elapsed().as_secs_f64()
            })
            .collect();
        let [median, p90] = [0.5, 0.9].map(|q| quantile(&times, q));
        println!("{} microphones, 485 samples: median {median:.0} us, p90 {p90:.0} us", microphones.len());
    }
}
