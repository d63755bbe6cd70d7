//! From a recording to its model: a fit of the equations alone that does not lose the phase, the step of the integration, and the sizes
//! of the motion.

use missing_physics::data::{Recording, Run};
use missing_physics::fit::least_squares;
use missing_physics::model::Model as _;
use missing_physics::noise::rough_sigma;

use super::equations::Equations;
use super::model::MotionModel;
use super::scales::{Range, Scales, range};

/// The finest step of the integration, in parts of the time between rows.
const FINEST: f64 = 64.0;
/// Errors of the integration that are put up with, in parts of a channel's noise.
const TOLERANCE: f64 = 0.02;
/// And where there is next to no noise, in parts of its range.
const LEAST_TOLERANCE: f64 = 1e-7;
/// Rows that windows shorter than a run have together, at the most: enough to fit the equations by.
const WINDOWED_ROWS: usize = 3000;
/// Rows of the shortest windows in which the equations are fitted first.
const FIRST_WINDOW: usize = 40;

/// The full model.
///
/// # Errors
/// Why the equations give no prediction, in words.
pub(super) fn model(equations: Equations, recording: &Recording) -> Result<MotionModel, String> {
    let step_s = median_step(recording);
    let mut model = MotionModel::baseline(equations, step_s);
    let starts: Vec<f64> = shared_starts(&model);
    resolve(&mut model, recording, &starts)?;
    let fitted = windows(&model, recording, starts);
    resolve(&mut model, recording, &fitted)?;
    let stated = model.stated(&fitted);
    let scales = sizes(&model, recording, &fitted)?;
    Ok(model.full(scales, &stated))
}

fn shared_starts(model: &MotionModel) -> Vec<f64> {
    let shared = |p: &&missing_physics::model::Parameter| p.scope == missing_physics::model::Scope::Shared;
    model.spec().parameters.iter().filter(shared).map(|p| p.start).collect()
}

fn nuisance(model: &MotionModel, run: &Run) -> Vec<f64> {
    let own = |p: &&missing_physics::model::Parameter| p.scope == missing_physics::model::Scope::PerRun;
    let mut start: Vec<f64> = model.spec().parameters.iter().filter(own).map(|p| p.start).collect();
    model.nuisance_start(run, &mut start);
    start
}

fn median_step(recording: &Recording) -> f64 {
    let mut steps: Vec<f64> =
        recording.runs.iter().flat_map(|r| r.inputs[0].windows(2).map(|w| w[1] - w[0])).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(1.0)
}

/// Halves the step of the integration until the predictions of the first rows no longer depend on it.
fn resolve(model: &mut MotionModel, recording: &Recording, shared: &[f64]) -> Result<(), String> {
    let coarsest = median_step(recording);
    let Some(run) = recording.runs.iter().max_by_key(|r| r.len()) else { return Ok(()) };
    let run = rows(run, 0, run.len().min(400));
    let start = nuisance(model, &run);
    let n = run.len();
    let tolerances: Vec<f64> = (0..recording.channels.len()).map(|c| tolerance(recording, &run, c)).collect();
    let predict = |model: &MotionModel| {
        let mut out = vec![0.0; n * recording.channels.len()];
        model.predict(&run, shared, &start, &mut out).map(|()| out).map_err(|e| e.reason)
    };
    let mut step = coarsest;
    model.set_step(step);
    let mut before = predict(model);
    while step > coarsest / FINEST {
        step *= 0.5;
        model.set_step(step);
        let now = predict(model);
        if let (Ok(before), Ok(now)) = (&before, &now) {
            let close = before
                .chunks(n)
                .zip(now.chunks(n))
                .zip(&tolerances)
                .all(|((a, b), tolerance)| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= *tolerance));
            if close {
                model.set_step(2.0 * step);
                return Ok(());
            }
        }
        before = now;
    }
    before.map(|_| ())
}

/// By how much the integration may be off in a channel: little beside the rough part of its rows, or its calibration.
fn tolerance(recording: &Recording, run: &Run, channel: usize) -> f64 {
    let measured = run.inputs[0].iter().zip(&run.outputs[channel]).filter(|(_, v)| v.is_finite());
    let (times, column): (Vec<f64>, Vec<f64>) = measured.unzip();
    let rough = || rough_sigma(&times, &column).unwrap_or(0.0);
    let known = recording.calibration[channel].unwrap_or_else(rough);
    let sigma = known.max(recording.resolution[channel] / 12_f64.sqrt());
    let [low, high] = range(column.iter().copied());
    (TOLERANCE * sigma).max(LEAST_TOLERANCE * (high - low))
}

/// The rows `from..to` of a run, as a run of its own.
fn rows(run: &Run, from: usize, to: usize) -> Run {
    let pick = |columns: &[Vec<f64>]| columns.iter().map(|c| c[from..to].to_vec()).collect();
    Run { label: run.label.clone(), inputs: pick(&run.inputs), outputs: pick(&run.outputs), kind: run.kind }
}

/// Fits the equations in short windows, then in longer ones: a fit over a whole run from far off would lose the phase and settle in a
/// wrong place.
fn windows(model: &MotionModel, recording: &Recording, mut shared: Vec<f64>) -> Vec<f64> {
    let free = MotionModel::baseline(model.equations().free(), model.step_s());
    let longest = recording.runs.iter().map(Run::len).max().unwrap_or(0);
    let mut length = FIRST_WINDOW;
    loop {
        let mut windowed = recording.clone();
        windowed.runs = recording
            .runs
            .iter()
            .flat_map(|run| {
                let count = (run.len() / length).max(1);
                (0..count).map(move |k| {
                    let to = if k + 1 == count { run.len() } else { (k + 1) * length };
                    let mut window = rows(run, k * length, to);
                    window.label = format!("{} {k}", run.label);
                    window
                })
            })
            .collect();
        let whole = length >= longest;
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
            return shared;
        }
        length = length.saturating_mul(3);
    }
}

/// How large the motions are.
fn sizes(model: &MotionModel, recording: &Recording, shared: &[f64]) -> Result<Scales, String> {
    let states = model.equations().states.len();
    let (mut all, mut rates) = (vec![Vec::new(); states], vec![Vec::new(); states]);
    for run in &recording.runs {
        let course = model.course(run, shared, &nuisance(model, run))?;
        for k in 0..states {
            all[k].extend(&course.states[k]);
            rates[k].extend(&course.rates[k]);
        }
    }
    let column = |pick: &dyn Fn(&Run) -> &Vec<f64>| Range {
        range: range(recording.runs.iter().flat_map(|r| pick(r).iter().copied())),
    };
    let duration = |r: &Run| r.inputs[0].last().unwrap_or(&0.0) - r.inputs[0].first().unwrap_or(&0.0);
    let scales = Scales {
        inputs: (0..model.equations().inputs.len()).map(|k| column(&|r| &r.inputs[1 + k])).collect(),
        outputs: (0..recording.channels.len()).map(|k| column(&|r| &r.outputs[k])).collect(),
        step_s: median_step(recording),
        duration_s: recording.runs.iter().map(duration).fold(0.0, f64::max),
        ..Scales::default()
    };
    Ok(scales.measure(model.equations(), &all, &rates))
}
