//! Rows from before a motion began: a hand that still held the machine.

use missing_physics::data::{Recording, Run};

use super::model::MotionModel;
use super::scales::range;
use super::windows::rows;

/// Fewer rows at rest are no rest.
const FEWEST: usize = 8;
/// Readings that differ by less than this part of a channel's range are at rest.
const STILL: f64 = 0.02;
/// Where the equations lead a reading farther than this part of its range meanwhile, something held it.
const LED: f64 = 0.25;

/// What is said of each run that rests at its beginning where the equations, with fitted parameters, would have it move. Of machines that
/// are driven nothing: a drive that does not overcome the friction holds a joint as well.
pub(super) fn remarks(model: &MotionModel, recording: &Recording, shared: &[f64]) -> Vec<String> {
    if !model.equations().inputs.is_empty() {
        return Vec::new();
    }
    let ranges: Vec<f64> = (0..recording.channels.len())
        .map(|c| {
            let [low, high] = range(recording.runs.iter().flat_map(|r| r.outputs[c].iter().copied()));
            high - low
        })
        .collect();
    recording.runs.iter().filter_map(|run| held(model, run, shared, &ranges)).collect()
}

/// The same of one run, of channels with these ranges.
fn held(model: &MotionModel, run: &Run, shared: &[f64], ranges: &[f64]) -> Option<String> {
    model.equations().outputs.iter().enumerate().find_map(|(c, output)| {
        let (state, column) = (output.state?, &run.outputs[c]);
        let first = column.first().copied().filter(|v| v.is_finite())?;
        let end = column.iter().position(|v| (v - first).abs() > STILL * ranges[c])?;
        if end < FEWEST {
            return None;
        }
        let rest = rows(run, 0, end);
        let course = model.course(&rest, shared, &model.at_rest(&rest)).ok()?;
        let led = course.states[state].iter().map(|v| (v - first).abs()).fold(0.0, f64::max);
        (led > LED * ranges[c]).then(|| {
            format!(
                "run {} rests in its first {end} rows ({:.3} s), where the equations would have {} move: leave rows out in which a hand \
                 held it",
                run.label,
                rest.inputs[0][end - 1] - rest.inputs[0][0],
                output.name
            )
        })
    })
}
