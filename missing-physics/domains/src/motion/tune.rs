//! From a recording to its model, thinned and cut as it can be followed.

use joint_laws::integrate::Method;
use missing_physics::data::{Recording, Run};
use missing_physics::fit::least_squares;
use missing_physics::model::{Experiment, Model as _, Scope};

use super::equations::Equations;
use super::experiments::experiments;
use super::follow::{Windowed, first_pace, liveliest, median_step, resolve, sigma, sizes, windows};
use super::held;
use super::model::{MotionModel, Pace};
use super::of_runs;
use super::windows::{Thinned, cut, rows, thin};

/// Sum of squares, in sigmas of all rows, by which a motion may differ under inputs that are joined by lines.
const ALIKE: f64 = 1.0;
/// By how much one step a row has to fit better than the exact motion, as a sum of squares in parts of what is left of a reading.
const BETTER: f64 = 20.0;

/// A recording as it is diagnosed.
pub(super) struct Tuned {
    pub(super) model: MotionModel,
    pub(super) recording: Recording,
    /// What could be commanded next; nothing, where runs cannot be followed as a whole.
    pub(super) experiments: Vec<Experiment>,
    /// What was done to the rows, one sentence each.
    pub(super) remarks: Vec<String>,
}

/// The full model, and the recording as it can be followed: of a long one, no more rows than need be, unless all of them are asked for
/// (`whole`).
///
/// # Errors
/// Why the equations give no prediction, in words.
pub(super) fn tuned(equations: Equations, recording: Recording, whole: bool) -> Result<Tuned, String> {
    let thinned = if whole { None } else { thin(&equations, &recording) };
    let Some(Thinned { every, exact, joined }) = thinned else {
        return followed(equations, recording, true);
    };
    let counts = format!("one of {every} measured values counts: more would take longer than they tell");
    drop(recording);
    let by_lines =
        joined.map(|joined| followed(equations.joined(), joined, false)).transpose().ok().flatten();
    if let Some(mut tuned) = by_lines.filter(|tuned| same_motion(&equations, tuned, &exact)) {
        tuned.remarks.insert(0, format!("{counts}; between those, inputs count by straight lines"));
        return Ok(tuned);
    }
    let mut tuned = followed(equations, exact, true)?;
    tuned.remarks.insert(0, counts);
    Ok(tuned)
}

/// Whether a motion under inputs that are joined by lines is the one under the inputs as they are, with dry friction and without.
fn same_motion(equations: &Equations, tuned: &Tuned, exact: &Recording) -> bool {
    let model = &tuned.model;
    let Some(window) = liveliest(&tuned.recording) else { return true };
    let of_run = |r: &&Run| window.label == r.label || window.label.starts_with(&format!("{}, ", r.label));
    let Some(run) = exact.runs.iter().find(of_run) else { return false };
    let within = |t: &f64| (window.inputs[0][0]..=window.inputs[0][window.len() - 1]).contains(t);
    let first = run.inputs[0].partition_point(|t| *t < window.inputs[0][0]);
    let count = run.inputs[0].iter().filter(|t| within(t)).count();
    let run = Run { kind: window.kind, ..rows(run, first, first + count) };
    let as_is = model.under(equations.clone());
    let all: usize = tuned.recording.runs.iter().map(Run::len).sum();
    let sigmas: Vec<f64> =
        (0..tuned.recording.channels.len()).map(|c| sigma(&tuned.recording, &window, c)).collect();
    let starts = model.spec().starts(Scope::Shared);
    let nuisance = model.nuisance(&window);
    let predict = |model: &MotionModel, run: &Run, shared: &[f64]| -> Option<Vec<Vec<f64>>> {
        let mut out = vec![0.0; run.len() * sigmas.len()];
        model.predict(run, shared, &nuisance, &mut out).ok()?;
        Some(out.chunks(run.len().max(1)).map(<[f64]>::to_vec).collect())
    };
    let differ = |shared: &[f64]| -> Option<f64> {
        let (lines, as_is) = (predict(model, &window, shared)?, predict(&as_is, &run, shared)?);
        let mut sum = 0.0;
        let mut row = 0;
        for (k, t) in run.inputs[0].iter().enumerate() {
            while window.inputs[0][row] < *t && row + 1 < window.len() {
                row += 1;
            }
            if window.inputs[0][row] == *t {
                let columns = lines.iter().zip(&as_is).zip(&sigmas);
                sum += columns.map(|((a, b), sigma)| ((a[row] - b[k]) / sigma).powi(2)).sum::<f64>();
            }
        }
        Some(sum * all as f64 / window.len() as f64)
    };
    let rubbing = model.rubbing(&starts);
    let unseen = |shared: &[f64]| differ(shared).is_some_and(|squares| squares <= ALIKE);
    unseen(&starts) && unseen(&rubbing)
}

/// The full model, and the recording as it can be followed, all of its rows; `steps`: whether a simulator may have made it, one step a
/// row.
fn followed(mut equations: Equations, recording: Recording, steps: bool) -> Result<Tuned, String> {
    let mut remarks = Vec::new();
    of_runs::find(&mut equations, &recording);
    let mut model = MotionModel::baseline(equations, first_pace(&recording));
    let starts: Vec<f64> = model.spec().starts(Scope::Shared);
    resolve(&mut model, &recording, &starts)?;
    let Windowed { mut fitted, mut near, followed } = windows(&model, &recording, starts)?;
    if let Some(longest) = followed {
        let mut free = model.freed();
        resolve(&mut free, &cut(&recording, longest.rows), &fitted)?;
        model.set_pace(free.pace());
        model.set_state_sizes(free.state_sizes().to_vec());
    } else {
        resolve(&mut model, &recording, &fitted)?;
        let by_the_rows = steps.then(|| by_the_rows(&mut model, &recording, &fitted)).flatten();
        if let Some(better) = by_the_rows {
            near.clone_from(&better);
            fitted = better;
            remarks.push(
                "the motion is followed by one Runge-Kutta step a row, as a simulator may have done it: this fits better than the exact \
                 motion"
                    .into(),
            );
        }
    }
    remarks.extend(held::remarks(&model, &recording, &fitted));
    let stated = model.stated(&near);
    let sizes = |model: &MotionModel, recording: &Recording| {
        sizes(model, recording, &near).or_else(|_| sizes(model, recording, &fitted))
    };
    let Some(longest) = followed else {
        let scales = sizes(&model, &recording)?;
        let times = [scales.step_s, scales.duration_s];
        let model = model.full(scales, &stated, None);
        let experiments = experiments(&model, &recording, times);
        return Ok(Tuned { model, recording, experiments, remarks });
    };
    let free = model.freed();
    let whole = recording;
    let recording = cut(&whole, longest.rows);
    let scales = sizes(&free, &recording)?;
    let span = |r: &Run| r.inputs[0].last().unwrap_or(&0.0) - r.inputs[0].first().unwrap_or(&0.0);
    let span = recording.runs.iter().map(span).fold(0.0, f64::max);
    remarks.push(format!(
        "runs are followed in windows of {span:.3} s with free starts: over more, {}",
        longest.beyond
    ));
    let model = model.full(scales, &stated, Some(&whole.runs));
    Ok(Tuned { model, recording, experiments: Vec::new(), remarks })
}

/// A recording may come from a simulator that takes one step of Runge and Kutta's a row: where that fits better than the exact motion by
/// more than what is left anyway leaves open, and differs from it by less than the noise of a reading, the motion is followed like that.
/// The parameters fitted then.
fn by_the_rows(model: &mut MotionModel, recording: &Recording, shared: &[f64]) -> Option<Vec<f64>> {
    let exact = model.pace();
    let rows = Pace::fixed(Method::Kutta, median_step(recording));
    // In steps as long a cheaper method tells the same.
    if exact == rows || exact == Pace::fixed(Method::Heun, rows.step_s) {
        return None;
    }
    let before = least_squares(&*model, recording, shared).ok()?.chi2;
    model.set_pace(rows);
    let values =
        recording.runs.iter().flat_map(|r| r.outputs.iter().flatten()).filter(|v| v.is_finite()).count();
    let after = least_squares(&*model, recording, shared).ok();
    let better = |after: f64| {
        let (gain, left) = (before - after, after / values as f64);
        gain > BETTER * left.max(1.0) && gain < 0.1 * values as f64
    };
    match after.filter(|after| better(after.chi2)) {
        Some(after) => Some(after.shared),
        None => {
            model.set_pace(exact);
            None
        }
    }
}
