//! What could be swung next.

use missing_physics::data::{Recording, Run};
use missing_physics::model::Experiment;

use super::model::{FILLS, SloshModel};

/// Rows of a proposed run.
const MOST_ROWS: usize = 2000;
/// How high and how long a wave is proposed, beside the highest and the first so far.
const HIGHER: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];
const LONGER: [f64; 3] = [1.0 / 3.0, 1.0, 3.0];

/// Weaker and harder swings, recorded for a shorter or longer time, and one with less or more liquid.
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
    let mut add = |action: Vec<(String, f64)>, words: String, run: Run, amplitude: f64| {
        list.push(Experiment { action, words, runs: vec![run], nuisance: vec![model.wave(amplitude)] });
    };
    let largest = model.largest();
    let (channel, unit) = (model.channel(), model.channel().unit());
    for amplitude in HIGHER.map(|share| share * largest) {
        for duration in LONGER.map(|share| share * span) {
            let words = format!(
                "swing it so that the reading starts at {amplitude:.2e} {unit}, and record {duration:.3} s"
            );
            let action =
                [(format!("amplitude_{}", channel.suffix()), amplitude), ("duration_s".into(), duration)];
            add(action.into(), words, run(duration, 0), amplitude);
        }
    }
    for (kind, share) in FILLS.iter().enumerate().skip(1).filter(|(kind, _)| model.holds(*kind)) {
        let words = format!("swing it with {share} times the liquid");
        add(vec![("volume_share".into(), *share)], words, run(span, kind), largest);
    }
    list
}
