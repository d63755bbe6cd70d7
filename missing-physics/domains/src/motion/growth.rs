//! How a deviation of the start grows: which windows are too long to be followed.

use missing_physics::data::{Recording, Run};
use missing_physics::model::Model as _;

use super::model::MotionModel;
use super::windows::cut;

/// By how much a deviation of the start may grow in a window, both in parts of the size of the motion.
const MOST_GROWTH: f64 = 10.0;
/// Windows of one length that are looked at.
const LOOKED_AT: usize = 12;

/// Whether windows of a number of rows are too long: a deviation of their start grows beyond what can be followed. `free` is the model
/// with all states free at a window's start, `sizes` are those of the states.
pub(super) fn too_long(
    free: &MotionModel,
    recording: &Recording,
    shared: &[f64],
    sizes: &[f64],
    length: usize,
) -> bool {
    let windows = cut(recording, length).runs;
    let every = windows.len().div_ceil(LOOKED_AT).max(1);
    let mut grown: Vec<f64> =
        windows.iter().step_by(every).map(|w| growth(free, recording, w, shared, sizes)).collect();
    grown.sort_by(f64::total_cmp);
    // One window among many may begin at a wrong guess.
    grown.get(grown.len() * 3 / 4).is_some_and(|g| !(*g < MOST_GROWTH))
}

/// The largest deviation of an output in a window, in parts of its spread, that a deviation of a state at the start brings, in parts of
/// that state's size; infinite where the motion cannot be followed to the window's end.
fn growth(free: &MotionModel, recording: &Recording, window: &Run, shared: &[f64], sizes: &[f64]) -> f64 {
    let nuisance = free.nuisance(window);
    let first = nuisance.len() - sizes.len();
    let states: Vec<usize> = (first..nuisance.len()).collect();
    let n = window.len();
    let channels = recording.channels.len();
    let (mut out, mut jacobian) = (vec![0.0; n * channels], vec![0.0; n * channels * states.len()]);
    if free.jacobian(window, shared, &nuisance, &[], &states, &mut out, &mut jacobian).is_err() {
        return f64::INFINITY;
    }
    let mut most = 0.0_f64;
    for c in 0..channels {
        let spread = deviation(recording.runs.iter().flat_map(|r| &r.outputs[c]).copied());
        for (state, size) in sizes.iter().enumerate() {
            let column = &jacobian[(state * channels + c) * n..][..n];
            let steepest = column.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            most = most.max(steepest * size / spread);
        }
    }
    most
}

/// Standard deviation of the finite values.
fn deviation(values: impl Iterator<Item = f64>) -> f64 {
    let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for v in values.filter(|v| v.is_finite()) {
        n += 1.0;
        sum += v;
        squares += v * v;
    }
    let mean: f64 = sum / f64::max(n, 1.0);
    (squares / f64::max(n, 1.0) - mean * mean).max(f64::MIN_POSITIVE).sqrt()
}
