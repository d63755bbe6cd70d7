//! What could be pressed next.

use missing_physics::data::{Recording, Run};
use missing_physics::model::{Experiment, Model, Scope};

use super::model::IndentationModel;

/// Rows of a proposed curve's loading.
const ROWS: usize = 40;
/// Repeats of a proposed curve.
const REPEATS: usize = 3;

/// Part of a proposed curve's depth from above the contact down to it.
const ABOVE: f64 = 0.5;

/// The deepest curve shallower, again and deeper, each slower and faster too, and held; and from above the contact, where nothing but
/// the sensor is felt.
pub(super) fn experiments(model: &IndentationModel, recording: &Recording) -> Vec<Experiment> {
    let deepest = model.deepest_m();
    let nuisance = vec![0.0; model.spec().count(Scope::PerRun)];
    let duration = recording
        .runs
        .iter()
        .filter_map(|r| Some(r.inputs.get(1)?.last()? - r.inputs.get(1)?.first()?))
        .fold(0.0, f64::max);
    let duration = if duration > 0.0 { duration } else { 1.0 };
    let curve = |from: f64, depth: f64, load_s: f64, hold_s: f64| {
        let ramp = |i: usize| i as f64 / (ROWS - 1) as f64;
        let holds = if hold_s > 0.0 { ROWS } else { 0 };
        let mut depths: Vec<f64> = (0..ROWS).map(|i| from + (depth - from) * ramp(i)).collect();
        let mut times: Vec<f64> = (0..ROWS).map(|i| load_s * ramp(i)).collect();
        depths.extend(std::iter::repeat_n(depth, holds));
        times.extend((1..=holds).map(|i| load_s + hold_s * i as f64 / ROWS as f64));
        let n = depths.len();
        let mut inputs = vec![depths];
        if recording.variables.iter().any(|v| v.name == "t_s") {
            inputs.push(times);
        }
        if recording.variables.iter().any(|v| v.name == "segment") {
            inputs.push((0..n).map(|i| f64::from(u8::from(i >= ROWS))).collect());
        }
        Run { label: "next".into(), inputs, outputs: vec![vec![0.0; n]], kind: 0 }
    };
    let mut list = Vec::new();
    let mut add = |action: Vec<(&str, f64)>, words: String, run: Run| {
        list.push(Experiment {
            action: action.into_iter().map(|(name, value)| (name.to_owned(), value)).collect(),
            words: format!("{words}, {REPEATS} times"),
            runs: vec![run; REPEATS],
            nuisance: vec![nuisance.clone(); REPEATS],
        });
    };
    for depth in [0.3, 1.0, 1.5, 2.0].map(|factor| factor * deepest) {
        let words = format!("press {:.3} mm deep", 1e3 * depth);
        let above = ABOVE * depth;
        let from_above = format!("{words}, from {:.3} mm above the contact", 1e3 * above);
        if !model.setup().timed {
            add(vec![("delta_m", depth)], words, curve(0.0, depth, duration, 0.0));
            let action = vec![("from_m", -above), ("delta_m", depth)];
            add(action, from_above, curve(-above, depth, duration, 0.0));
            continue;
        }
        let action = vec![("from_m", -above), ("delta_m", depth), ("duration_s", duration)];
        add(action, from_above, curve(-above, depth, duration, 0.0));
        for (factor, how) in [(0.1, " at 10 times the speed"), (1.0, ""), (10.0, " at a tenth of the speed")]
        {
            let lasts = factor * duration;
            let action = vec![("delta_m", depth), ("duration_s", lasts)];
            add(action, format!("{words}{how}"), curve(0.0, depth, lasts, 0.0));
        }
        let (down, hold) = (0.3 * duration, 3.0 * duration);
        let action = vec![("delta_m", depth), ("duration_s", down), ("hold_s", hold)];
        add(
            action,
            format!("{words} in {down:.3} s and hold for {hold:.3} s"),
            curve(0.0, depth, down, hold),
        );
    }
    list
}
