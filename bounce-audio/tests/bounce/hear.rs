//! Recordings made here: what is an impact, and what is none.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use crate::common::{Burst, Dice, hiss, strike};
use bounce_audio::hear::{HearError, HearSettings, StrayReason, hear, hear_times};
use bounce_audio::localise::{ArrayError, LocaliseError};
use bounce_audio::onset::{Listened, OnsetError, OnsetSettings};
use bounce_audio::wav::Sound;

const C: f64 = 343.0;
const RATE: f64 = 44_100.0;
const MICROPHONES: [[f64; 3]; 4] = [[0.0, 0.0, 0.08], [0.5, 0.0, 0.05], [0.5, 0.5, 0.08], [0.0, 0.5, 0.1]];
const TIMES: [f64; 5] = [0.0453, 0.231_7, 0.380_04, 0.498_9, 0.594];

/// A ball that drifts over the table, quieter at each bounce.
fn drop(dice: &mut Dice, noise: f64) -> (Sound, Vec<[f64; 2]>) {
    let mut channels = vec![vec![0.0; (0.68 * RATE) as usize]; 4];
    let places: Vec<[f64; 2]> =
        (0..5).map(|k| [0.2 + 0.02 * f64::from(k), 0.35 - 0.03 * f64::from(k)]).collect();
    for (k, (t, p)) in TIMES.iter().zip(&places).enumerate() {
        let loudness = 0.3 * 0.8f64.powi(k as i32);
        strike(&mut channels, RATE, &MICROPHONES, C, *p, *t, &Burst::new(dice), loudness);
    }
    hiss(&mut channels, noise, dice);
    (Sound { rate_hz: RATE, channels }, places)
}

fn settings() -> HearSettings {
    HearSettings::default()
}

#[test]
fn a_drop_is_heard_in_time_and_place() {
    let mut dice = Dice(1);
    for noise in [0.0, 1e-4, 3e-3] {
        for _ in 0..5 {
            let (sound, places) = drop(&mut dice, noise);
            let heard = hear(&sound, &MICROPHONES, C, &settings()).unwrap();
            assert_eq!(heard.impacts.len(), 5, "noise {noise}: {:?}", heard.strays);
            assert!(heard.strays.is_empty());
            for (k, impact) in heard.impacts.iter().enumerate() {
                let place = impact.location.unwrap();
                let off = (place.x_m - places[k][0]).hypot(place.y_m - places[k][1]);
                assert!(off < 2e-3, "{off} m off");
                let late = impact.t_s - TIMES[k];
                // The burst takes 0.1 ms to rise.
                assert!((-3e-5..1.2e-4).contains(&late), "noise {noise}, impact {k}: {late} s late");
                assert!(impact.t_sigma_s > 1e-6 && impact.t_sigma_s < 1e-4);
                for (m, arrival) in MICROPHONES.iter().zip(&impact.arrivals_s) {
                    let [x, y] = places[k];
                    let r = ((m[0] - x).powi(2) + (m[1] - y).powi(2) + m[2] * m[2]).sqrt();
                    assert!((arrival - late - TIMES[k] - r / C).abs() < 5e-6);
                }
            }
        }
    }
}

/// A recording that starts right before an impact and ends right after one.
#[test]
fn the_ends_of_a_recording_are_heard() {
    let (sound, _) = drop(&mut Dice(2), 1e-3);
    let from = ((TIMES[0] + 2e-4) * RATE) as usize;
    let to = ((TIMES[4] + 6e-3) * RATE) as usize;
    let short =
        Sound { rate_hz: RATE, channels: sound.channels.iter().map(|x| x[from..to].to_vec()).collect() };
    let heard = hear(&short, &MICROPHONES, C, &settings()).unwrap();
    assert_eq!(heard.impacts.len(), 5, "{heard:?}");
}

#[test]
fn silence_and_noise_hold_no_impact() {
    let silence = Sound { rate_hz: RATE, channels: vec![vec![0.0; 20_000]; 4] };
    assert!(hear(&silence, &MICROPHONES, C, &settings()).unwrap().impacts.is_empty());
    for length in [0, 1, 5, 100] {
        let short = Sound { rate_hz: RATE, channels: vec![vec![0.1; length]; 4] };
        assert!(hear(&short, &MICROPHONES, C, &settings()).unwrap().impacts.is_empty());
    }
    let mut dice = Dice(3);
    // A minute of noise over a hum and a constant.
    let mut noise =
        vec![(0..60 * 44_100).map(|k| 0.2 + 0.3 * (f64::from(k) * 0.007).sin()).collect::<Vec<f64>>()];
    hiss(&mut noise, 0.01, &mut dice);
    let heard = hear_times(&Sound { rate_hz: RATE, channels: noise }, &settings()).unwrap();
    assert!(heard.impacts.is_empty(), "{:?}", heard.impacts);
}

/// Clipped at a third of its peak, a drop is still heard, within 5 mm.
#[test]
fn a_clipped_drop_is_heard() {
    let (mut sound, places) = drop(&mut Dice(4), 1e-3);
    let peak = sound.channels.iter().flatten().fold(0.0f64, |a, v| a.max(v.abs()));
    sound.channels.iter_mut().flatten().for_each(|v| *v = v.clamp(-peak / 3.0, peak / 3.0));
    let heard = hear(&sound, &MICROPHONES, C, &settings()).unwrap();
    assert_eq!(heard.impacts.len(), 5);
    for (impact, p) in heard.impacts.iter().zip(places) {
        let place = impact.location.unwrap();
        assert!((place.x_m - p[0]).hypot(place.y_m - p[1]) < 5e-3);
    }
}

/// A loud click two metres away is a stray with microphones around the table, and an impact to one microphone.
#[test]
fn a_click_from_elsewhere_is_no_impact() {
    let mut dice = Dice(6);
    let (mut sound, _) = drop(&mut dice, 1e-3);
    strike(&mut sound.channels, RATE, &MICROPHONES, C, [2.0, 1.4], 0.14, &Burst::new(&mut dice), 0.9);
    let heard = hear(&sound, &MICROPHONES, C, &settings()).unwrap();
    assert_eq!((heard.impacts.len(), heard.strays.len()), (5, 1), "{:?}", heard.strays);
    assert!(matches!(heard.strays[0].reason, StrayReason::Outside(far) if far > 0.3), "{:?}", heard.strays);
    assert_eq!(heard.impacts[1].number, 1);
    let single = Sound { channels: sound.channels[..1].to_vec(), ..sound };
    assert_eq!(hear_times(&single, &settings()).unwrap().impacts.len(), 6);
}

/// Another burst in every channel at once comes from nowhere.
#[test]
fn unrelated_bursts_are_no_impact() {
    let mut dice = Dice(8);
    for _ in 0..20 {
        let (mut sound, _) = drop(&mut dice, 1e-3);
        for (c, microphone) in MICROPHONES.iter().enumerate() {
            let burst = Burst::new(&mut dice);
            strike(&mut sound.channels[c..=c], RATE, &[*microphone], C, [0.2, 0.2], 0.14, &burst, 0.3);
        }
        let heard = hear(&sound, &MICROPHONES, C, &settings()).unwrap();
        assert_eq!((heard.impacts.len(), heard.strays.len()), (5, 1), "{:?}", heard.strays);
    }
}

#[test]
fn one_microphone_hears_times() {
    let (sound, places) = drop(&mut Dice(9), 1e-3);
    let single = Sound { channels: sound.channels[..1].to_vec(), ..sound };
    let heard = hear_times(&single, &settings()).unwrap();
    assert_eq!(heard.impacts.len(), 5);
    for (k, impact) in heard.impacts.iter().enumerate() {
        let [x, y] = places[k];
        let arrival = TIMES[k] + (x * x + y * y + 0.08f64.powi(2)).sqrt() / C;
        assert!((-3e-5..1.5e-4).contains(&(impact.t_s - arrival)), "{} s late", impact.t_s - arrival);
        assert!(impact.location.is_none() && impact.arrivals_s.len() == 1);
    }
}

#[test]
fn nonsense_is_an_error() {
    let (sound, _) = drop(&mut Dice(10), 1e-3);
    let two = Sound { channels: sound.channels[..2].to_vec(), ..sound.clone() };
    let few = hear(&two, &MICROPHONES[..2], C, &settings());
    assert_eq!(
        few,
        Err(HearError::Localise(LocaliseError::Array(ArrayError::TooFew { expected: 3, got: 2 })))
    );
    assert_eq!(hear(&two, &MICROPHONES, C, &settings()), Err(HearError::Microphones { expected: 2, got: 4 }));
    let line = [0.0, 0.1, 0.2, 0.3].map(|x| [x, 2.0 * x, 0.1]);
    let on_a_line = hear(&sound, &line, C, &settings());
    assert!(matches!(on_a_line, Err(HearError::Localise(LocaliseError::Array(ArrayError::OnALine { .. })))));
    let none = Sound { rate_hz: RATE, channels: vec![] };
    assert_eq!(hear_times(&none, &settings()), Err(HearError::Onset(OnsetError::NoChannel)));
    let new = |channels: &[Vec<f64>], rate, settings| Listened::new(channels, rate, settings).err();
    let ragged = new(&[vec![0.0; 5], vec![0.0; 6]], RATE, OnsetSettings::default());
    assert_eq!(ragged, Some(OnsetError::Length { channel: 1, expected: 5, got: 6 }));
    let broken = new(&[vec![0.0, f64::NAN]], RATE, OnsetSettings::default());
    assert_eq!(broken, Some(OnsetError::NotFinite { channel: 0, sample: 1 }));
    for rate in [0.0, -1.0, f64::NAN, 3_000.0] {
        let refused = new(&[vec![0.0; 5]], rate, OnsetSettings::default());
        assert!(matches!(refused, Some(OnsetError::Setting { .. })), "{rate}: {refused:?}");
    }
    let deaf = OnsetSettings { threshold_sigmas: 0.0, ..OnsetSettings::default() };
    assert!(matches!(
        new(&[vec![0.0; 5]], RATE, deaf),
        Some(OnsetError::Setting { what: "the threshold", .. })
    ));
}
