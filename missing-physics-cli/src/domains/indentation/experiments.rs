//! What could be pressed next.

use missing_physics::data::{Recording, Run};
use missing_physics::model::{Experiment, Model, Scope};

use super::model::IndentationModel;

/// Rows of a proposed curve's loading.
const ROWS: usize = 40;
/// Repeats of a proposed curve.
const REPEATS: usize = 3;

/// The same curve deeper and shallower, slower, and held.
pub(super) fn experiments(model: &IndentationModel, recording: &Recording) -> Vec<Experiment> {
    let deepest = model.deepest_m();
    let own = vec![0.0; model.spec().count(Scope::PerRun)];
    let duration = recording
        .runs
        .iter()
        .filter_map(|r| Some(r.inputs.get(1)?.last()? - r.inputs.get(1)?.first()?))
        .fold(0.0, f64::max);
    let duration = if duration > 0.0 { duration } else { 1.0 };
    let curve = |depth: f64, load_s: f64, hold_s: f64| {
        let ramp = |i: usize| i as f64 / (ROWS - 1) as f64;
        let holds = if hold_s > 0.0 { ROWS } else { 0 };
        let mut depths: Vec<f64> = (0..ROWS).map(|i| depth * ramp(i)).collect();
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
            own: vec![own.clone(); REPEATS],
        });
    };
    for factor in [0.3, 1.5, 2.0] {
        let words = format!("press {:.3} mm deep", 1e3 * factor * deepest);
        add(vec![("delta_m", factor * deepest)], words, curve(factor * deepest, duration, 0.0));
    }
    if model.setup().timed {
        for factor in [0.1, 10.0] {
            let words = format!("press at {} times the speed", 1.0 / factor);
            add(vec![("duration_s", factor * duration)], words, curve(deepest, factor * duration, 0.0));
        }
        let words = format!("press and hold for {:.3} s", 3.0 * duration);
        add(vec![("hold_s", 3.0 * duration)], words, curve(deepest, 0.3 * duration, 3.0 * duration));
    }
    list
}
