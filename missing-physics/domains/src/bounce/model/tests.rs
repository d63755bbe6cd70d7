//! Which impacts become rows, and of which channels.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
use super::super::chance::tests::{EFFECTS, drop};
use super::*;

/// Of a ball that is let go somewhere, the first and the last impact are known by their arrivals alone: the fourth microphone's.
#[test]
fn impacts_of_which_only_arrivals_are_known_are_rows_too() {
    let corners = [[0.0, 0.0, 0.1], [0.6, 0.0, 0.1], [0.6, 0.6, 0.1], [0.0, 0.6, 0.1]];
    let spread = Spread::heard(1e-3);
    let numbers: Vec<f64> = (1..=6).map(f64::from).collect();
    for (count, rows, spare) in [(4, 6, 1), (3, 4, 0)] {
        let microphones = Microphones { places_m: corners[..count].to_vec(), speed_of_sound_m_s: 340.0 };
        let setup = Setup {
            gravity_m_s2: 9.81,
            drag_unit: None,
            placed: true,
            dropped: false,
            released: false,
            listened: true,
            unheard: [0, 1],
            microphones: count,
        };
        let mut model = BounceModel::new(setup, EFFECTS, (spread, vec![spread]), microphones);
        let drop = Drop { height_m: None, arrivals_s: vec![vec![0.5; count]; 6], ..drop() };
        let linear = Linear::about_straight(&drop, &EFFECTS);
        let run = model.run("1", linear, &drop, &numbers, 1).unwrap();
        assert_eq!((run.len(), run.outputs.len()), (rows, PER_IMPACT + spare));
        assert!(run.inputs.iter().flatten().all(|v| v.is_finite()));
        for (channel, column) in run.outputs.iter().enumerate() {
            let known = column.iter().filter(|v| v.is_finite()).count();
            assert_eq!(known, if channel < PER_IMPACT { 4 } else { rows });
        }
        assert_eq!(run.inputs[0][0], if spare == 1 { 1.0 } else { 2.0 });
        let mut out = vec![0.0; run.len() * run.outputs.len()];
        let start: Vec<f64> = model.spec.parameters.iter().map(|p| p.start).collect();
        model.predict(&run, &start, &[0.0], &mut out).unwrap();
        assert!(out.iter().all(|v| v.is_finite()));
    }
}
