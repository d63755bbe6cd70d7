//! From a recording to its model: a fit of the equations alone that does not lose the phase, the step of the integration, and the sizes
//! of the motion.

use joint_laws::integrate::Method;
use missing_physics::data::{Recording, Run};
use missing_physics::fit::least_squares;
use missing_physics::model::{Experiment, Model as _, Scope};
use missing_physics::noise::rough_sigma;

use super::equations::Equations;
use super::experiments::experiments;
use super::growth::too_long;
use super::held;
use super::model::{MotionModel, Pace};
use super::of_runs;
use super::scales::{Range, Scales, range};
use super::windows::{Thinned, cut, rows, thin};
use crate::mechanics::Clock;

/// The coarsest step of the integration, in rows.
const COARSEST: f64 = 16.0;
/// The finest, in parts of the time between rows.
const FINEST: f64 = 256.0;
/// Where inputs change in fewer rows than this, steps are short anyway.
const OFTEN: f64 = 3.0;
/// Errors of the integration that are put up with, in sigmas of all rows together.
const UNSEEN: f64 = 0.3;
/// Sum of squares, in sigmas of all rows, by which a motion may differ under inputs that are joined by lines.
const ALIKE: f64 = 1.0;
/// By how much one step a row has to fit better than the exact motion, as a sum of squares in parts of what is left of a reading.
const BETTER: f64 = 20.0;
/// The least noise of a channel that is reckoned with, in parts of its range.
const LEAST_SIGMA: f64 = 3e-5;
/// Rows by which the step is judged.
const RESOLVED_ROWS: usize = 4000;
/// Rows that windows shorter than a run have together, at the most: enough to fit the equations by.
const WINDOWED_ROWS: usize = 3000;
/// Rows of the shortest windows in which the equations are fitted first.
const FIRST_WINDOW: usize = 40;

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
    let (mut fitted, followed) = windows(&model, &recording, starts)?;
    if let Some(length) = followed {
        let mut free = MotionModel::baseline(model.equations().free(), model.pace());
        resolve(&mut free, &cut(&recording, length), &fitted)?;
        model.set_pace(free.pace());
    } else {
        resolve(&mut model, &recording, &fitted)?;
        let by_the_rows = steps.then(|| by_the_rows(&mut model, &recording, &fitted)).flatten();
        if let Some(better) = by_the_rows {
            fitted = better;
            remarks.push(
                "the motion is followed by one Runge-Kutta step a row, as a simulator may have done it: this fits better than the exact \
                 motion"
                    .into(),
            );
        }
    }
    remarks.extend(held::remarks(&model, &recording, &fitted));
    let stated = model.stated(&fitted);
    let Some(length) = followed else {
        let scales = sizes(&model, &recording, &fitted)?;
        let times = [scales.step_s, scales.duration_s];
        let model = model.full(scales, &stated, None);
        let experiments = experiments(&model, &recording, times);
        return Ok(Tuned { model, recording, experiments, remarks });
    };
    let free = MotionModel::baseline(model.equations().free(), model.pace());
    let whole = recording;
    let recording = cut(&whole, length);
    let scales = sizes(&free, &recording, &fitted)?;
    let span = |r: &Run| r.inputs[0].last().unwrap_or(&0.0) - r.inputs[0].first().unwrap_or(&0.0);
    let longest = recording.runs.iter().map(span).fold(0.0, f64::max);
    remarks.push(format!(
        "runs are followed in windows of {longest:.3} s with free starts: over more, a small deviation of the start grows until the \
         motion tells nothing of the physics"
    ));
    let model = model.full(scales, &stated, Some(&whole.runs));
    Ok(Tuned { model, recording, experiments: Vec::new(), remarks })
}

/// A recording may come from a simulator that takes one step of Runge and Kutta's a row: where that fits better than the exact motion by
/// more than what is left anyway leaves open, and differs from it by less than the noise of a reading, the motion is followed like that.
/// The parameters fitted then.
fn by_the_rows(model: &mut MotionModel, recording: &Recording, shared: &[f64]) -> Option<Vec<f64>> {
    let exact = model.pace();
    let rows = Pace { method: Method::Kutta, step_s: median_step(recording) };
    if exact == rows {
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

/// Median time between two rows, s.
fn median_step(recording: &Recording) -> f64 {
    let step_s = Clock::of(&recording.runs).step_s;
    if step_s > 0.0 { step_s } else { 1.0 }
}

/// The coarsest pace that is worth a try: long steps where inputs do not end them.
pub(super) fn first_pace(recording: &Recording) -> Pace {
    let rows = median_step(recording);
    let changes = |column: &Vec<f64>| column.windows(2).filter(|w| w[0] != w[1]).count();
    let (mut all, mut changing) = (0, 0);
    for run in &recording.runs {
        all += run.len();
        changing += run.inputs[1..].iter().map(changes).max().unwrap_or(0);
    }
    let spacing = all as f64 / (changing + recording.runs.len()) as f64;
    if spacing < OFTEN {
        Pace { method: Method::Kutta, step_s: rows }
    } else {
        Pace { method: Method::DormandPrince, step_s: rows * COARSEST.min(spacing) }
    }
}

/// Halves the step of the integration until what predictions of the liveliest rows change by can be told from the noise in no test: an
/// error of the integration is the same in all rows, and what is far below the noise in each shows in all of them together. Of a motion
/// that cannot be followed so far only the beginning is looked at.
pub(super) fn resolve(model: &mut MotionModel, recording: &Recording, shared: &[f64]) -> Result<(), String> {
    let Some(mut run) = liveliest(recording) else { return Ok(()) };
    loop {
        let Err(why) = resolve_by(model, recording, &run, shared) else { return Ok(()) };
        if run.len() <= FIRST_WINDOW {
            return Err(format!("{why} in run {}, {}", run.label, begun(model, &run, shared)));
        }
        run = rows(&run, 0, run.len() / 2);
    }
}

/// The same by a run's rows.
fn resolve_by(
    model: &mut MotionModel,
    recording: &Recording,
    run: &Run,
    shared: &[f64],
) -> Result<(), String> {
    let mut pace = first_pace(recording);
    let start = model.nuisance(run);
    let n = run.len();
    let rows: usize = recording.runs.iter().map(Run::len).sum();
    let sigmas: Vec<f64> = (0..recording.channels.len()).map(|c| sigma(recording, run, c)).collect();
    let predict = |model: &MotionModel| {
        let mut out = vec![0.0; n * recording.channels.len()];
        model.predict(run, shared, &start, &mut out).map(|()| out).map_err(|e| e.reason)
    };
    model.set_pace(pace);
    let mut before = predict(model);
    let finest = median_step(recording) / FINEST;
    while pace.step_s > finest {
        let coarser = pace;
        pace.step_s *= 0.5;
        model.set_pace(pace);
        let now = predict(model);
        if let (Ok(before), Ok(now)) = (&before, &now) {
            let columns = before.chunks(n).zip(now.chunks(n)).zip(&sigmas);
            let seen: f64 = columns
                .map(|((a, b), sigma)| a.iter().zip(b).map(|(a, b)| ((a - b) / sigma).powi(2)).sum::<f64>())
                .sum();
            if seen * rows as f64 / n as f64 <= UNSEEN.powi(2) {
                model.set_pace(coarser);
                return Ok(());
            }
        }
        before = now;
    }
    before.map(|_| ())
}

/// From which states and by which parameters a motion was followed, in words.
fn begun(model: &MotionModel, run: &Run, shared: &[f64]) -> String {
    let equations = model.equations();
    let states = model.begins(run, &model.nuisance(run));
    let named = |name: &str, value: f64| format!("{name} = {}", (value * 1e6).round() / 1e6);
    let states = equations.states.iter().zip(states).map(|(s, v)| named(&s.name, v));
    let parameters = equations.parameters.iter().zip(model.stated(shared)).map(|(p, v)| named(&p.name, v));
    format!("from {}", states.chain(parameters).collect::<Vec<_>>().join(", "))
}

/// The rows by which the step is judged: of the run in which most happens, from its beginning on.
fn liveliest(recording: &Recording) -> Option<Run> {
    let happens = |run: &Run| -> f64 {
        let spread = |c: usize| {
            let [low, high] = range(run.outputs[c].iter().copied());
            let [lowest, highest] = range(recording.runs.iter().flat_map(|r| r.outputs[c].iter().copied()));
            (high - low) / (highest - lowest)
        };
        (0..run.outputs.len()).map(spread).sum()
    };
    let run = recording.runs.iter().max_by(|a, b| happens(a).total_cmp(&happens(b)))?;
    Some(rows(run, 0, run.len().min(RESOLVED_ROWS)))
}

/// A channel's noise: its calibration, or the rough part of its rows, and where there is next to none a little of its range.
fn sigma(recording: &Recording, run: &Run, channel: usize) -> f64 {
    let measured = run.inputs[0].iter().zip(&run.outputs[channel]).filter(|(_, v)| v.is_finite());
    let (times, column): (Vec<f64>, Vec<f64>) = measured.unzip();
    let rough = || rough_sigma(&times, &column).unwrap_or(0.0);
    let known = recording.calibration[channel].unwrap_or_else(rough);
    let sigma = known.max(recording.resolution[channel] / 12_f64.sqrt());
    let [low, high] = range(column.iter().copied());
    sigma.max(LEAST_SIGMA * (high - low))
}

/// Fits the equations in short windows, then in longer ones: a fit over a whole run from far off would lose the phase and settle in a
/// wrong place. The second is the number of rows of the longest windows that can be followed, where whole runs cannot.
pub(super) fn windows(
    model: &MotionModel,
    recording: &Recording,
    mut shared: Vec<f64>,
) -> Result<(Vec<f64>, Option<usize>), String> {
    let free = MotionModel::baseline(model.equations().free(), model.pace());
    let longest = recording.runs.iter().map(Run::len).max().unwrap_or(0);
    let mut length = FIRST_WINDOW;
    let mut followed = FIRST_WINDOW;
    loop {
        let whole = length >= longest;
        if length > FIRST_WINDOW {
            let sizes = sizes(&free, &cut(recording, followed), &shared)?;
            if too_long(&free, recording, &shared, &sizes.states, length.min(longest)) {
                return Ok((shared, Some(followed)));
            }
        }
        followed = length;
        let mut windowed = if whole { recording.clone() } else { cut(recording, length) };
        if !whole {
            // Evenly spread, not all of them.
            let most =
                (WINDOWED_ROWS / length).max(2 * model.spec().parameters.len()).min(windowed.runs.len());
            let every = windowed.runs.len() as f64 / most as f64;
            windowed.runs = (0..most).map(|k| windowed.runs[(k as f64 * every) as usize].clone()).collect();
        }
        let model = if whole { model } else { &free };
        if let Ok(fit) = least_squares(model, &windowed, &shared) {
            shared = fit.shared;
        }
        if whole {
            return Ok((shared, None));
        }
        length = length.saturating_mul(2);
    }
}

/// How large the motions are.
fn sizes(model: &MotionModel, recording: &Recording, shared: &[f64]) -> Result<Scales, String> {
    let states = model.equations().states.len();
    let (mut all, mut rates) = (vec![Vec::new(); states], vec![Vec::new(); states]);
    for run in &recording.runs {
        let course = model.course(run, shared, &model.nuisance(run))?;
        for k in 0..states {
            all[k].extend(&course.states[k]);
            rates[k].extend(&course.rates[k]);
        }
    }
    // Where a state is measured as it stands, the equations alone may lead it elsewhere.
    for (c, output) in model.equations().outputs.iter().enumerate() {
        let measured: Vec<f64> =
            recording.runs.iter().flat_map(|r| &r.outputs[c]).copied().filter(|v| v.is_finite()).collect();
        if let Some(state) = output.state.filter(|_| !measured.is_empty()) {
            all[state] = measured;
        }
    }
    let column = |pick: &dyn Fn(&Run) -> &Vec<f64>| Range {
        range: range(recording.runs.iter().flat_map(|r| pick(r).iter().copied())),
    };
    let scales = Scales {
        inputs: (0..model.equations().inputs.len()).map(|k| column(&|r| &r.inputs[1 + k])).collect(),
        outputs: (0..recording.channels.len()).map(|k| column(&|r| &r.outputs[k])).collect(),
        step_s: median_step(recording),
        duration_s: Clock::of(&recording.runs).duration_s,
        ..Scales::default()
    };
    Ok(scales.measure(model.equations(), &all, &rates))
}
