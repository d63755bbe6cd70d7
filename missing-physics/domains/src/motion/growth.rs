//! How a deviation of the start grows: which windows are too long to be followed.

use missing_physics::data::{Recording, Run};
use missing_physics::fit::LeastSquares;
use missing_physics::model::Model as _;

use super::model::MotionModel;
use super::windows::cut;

/// By how much a deviation of the start may grow in a window, both in parts of the size of the motion.
const MOST_GROWTH: f64 = 10.0;
/// A fit that misses by more than this part of an output's spread, and by more than so many times what it misses in windows half as long,
/// has settled on another motion (a pendulum that turns over once more): what a missing force moves grows as the square of time.
const LOST: f64 = 0.2;
const FASTER: f64 = 4.0;
/// Windows of one length that are looked at.
const LOOKED_AT: usize = 12;

/// Root mean square by which a fit misses windows of a recording, in parts of the spread of an output: the largest of all outputs;
/// infinite where it does not follow them.
pub(super) fn missed(
    model: &MotionModel,
    recording: &Recording,
    windows: &Recording,
    LeastSquares { shared, nuisance, .. }: &LeastSquares,
) -> f64 {
    let channels = recording.channels.len();
    let mut squares = vec![(0.0, 0_usize); channels];
    for (window, nuisance) in windows.runs.iter().zip(nuisance) {
        let mut out = vec![0.0; window.len() * channels];
        if model.predict(window, shared, nuisance, &mut out).is_err() {
            return f64::INFINITY;
        }
        for ((sum, count), (column, out)) in
            squares.iter_mut().zip(window.outputs.iter().zip(out.chunks(window.len().max(1))))
        {
            for (v, out) in column.iter().zip(out).filter(|(v, _)| v.is_finite()) {
                *sum += (v - out).powi(2);
                *count += 1;
            }
        }
    }
    let parts = squares.iter().enumerate().map(|(c, (sum, count))| {
        let spread = deviation(recording.runs.iter().flat_map(|r| &r.outputs[c]).copied());
        (sum / (*count).max(1) as f64).sqrt() / spread
    });
    parts.fold(0.0, f64::max)
}

/// Whether a fit that misses by so much may have settled on another motion.
pub(super) fn strays(missed: f64) -> bool {
    missed > LOST
}

/// Whether a fit has lost the motion on the way through windows by which it misses so much, and windows half as long by so much.
pub(super) fn lost(missed: f64, half: f64) -> bool {
    strays(missed) && missed > FASTER * half
}

/// Whether windows of a number of rows are too long: a deviation of their start grows beyond what can be followed. `free` is the model
/// with all states free at a window's start, `moves` says how far each state moves.
pub(super) fn too_long(
    free: &MotionModel,
    recording: &Recording,
    shared: &[f64],
    moves: &[f64],
    length: usize,
) -> bool {
    let windows = cut(recording, length).runs;
    let every = windows.len().div_ceil(LOOKED_AT).max(1);
    let mut grown: Vec<f64> =
        windows.iter().step_by(every).map(|w| growth(free, recording, w, shared, moves)).collect();
    grown.sort_by(f64::total_cmp);
    // One window among many may begin at a wrong guess.
    grown.get(grown.len() * 3 / 4).is_some_and(|g| !(*g < MOST_GROWTH))
}

/// The largest deviation of an output in a window, in parts of its spread, that a deviation of a state at the start brings, in parts of
/// how far that state moves; infinite where the motion cannot be followed to the window's end.
fn growth(free: &MotionModel, recording: &Recording, window: &Run, shared: &[f64], moves: &[f64]) -> f64 {
    let nuisance = free.nuisance(window);
    let first = nuisance.len() - moves.len();
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
        for (state, moves) in moves.iter().enumerate() {
            let column = &jacobian[(state * channels + c) * n..][..n];
            let steepest = column.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            most = most.max(steepest * moves / spread);
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
