//! What could be swung next.

use missing_physics::data::{Recording, Run};
use missing_physics::model::Experiment;

use super::model::{FILLS, SloshModel};

/// Rows of a proposed run.
const MOST_ROWS: usize = 2000;
/// Repeats of a proposed run.
const REPEATS: usize = 3;

/// The same swing weaker and harder, recorded for longer, and with less or more liquid.
pub(super) fn experiments(model: &SloshModel, recording: &Recording) -> Vec<Experiment> {
    let Some(times) = recording.runs.first().and_then(|r| r.inputs.first()) else { return Vec::new() };
    let (Some(first), Some(last)) = (times.first(), times.last()) else { return Vec::new() };
    let span = last - first;
    let step = span / (times.len().max(2) - 1) as f64;
    let run = |span: f64, kind: usize| {
        let n = ((span / step) as usize + 1).clamp(8, MOST_ROWS);
        let step = step.max(span / n as f64);
        let times: Vec<f64> = (0..n).map(|i| i as f64 * step).collect();
        Run { label: "next".into(), outputs: vec![vec![0.0; n]], inputs: vec![times], kind: kind as u32 }
    };
    let mut list = Vec::new();
    let mut add = |action: Vec<(&str, f64)>, words: String, run: Run, amplitude: f64| {
        list.push(Experiment {
            action: action.into_iter().map(|(name, value)| (name.to_owned(), value)).collect(),
            words: format!("{words}, {REPEATS} times"),
            runs: vec![run; REPEATS],
            own: vec![model.wave(amplitude); REPEATS],
        });
    };
    let largest = model.largest();
    for share in [0.25, 0.5, 2.0] {
        let words = format!("swing it so that the reading starts at {:.2e}", share * largest);
        add(vec![("amplitude_share", share)], words, run(span, 0), share * largest);
    }
    let words = format!("record it for {:.0} s", 3.0 * span);
    add(vec![("duration_s", 3.0 * span)], words, run(3.0 * span, 0), largest);
    for (kind, share) in FILLS.iter().enumerate().skip(1).filter(|(kind, _)| model.holds(*kind)) {
        let words = format!("swing it with {share} times the liquid");
        add(vec![("volume_share", *share)], words, run(span, kind), largest);
    }
    list
}
