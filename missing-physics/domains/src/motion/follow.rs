//! How a motion is followed: the step of the integration, a fit of the equations that does not lose the phase, and the sizes of the motion.

use joint_laws::integrate::Method;
use missing_physics::data::{Recording, Run};
use missing_physics::fit::reweighted_least_squares;
use missing_physics::model::Model as _;
use missing_physics::noise::rough_sigma;

use super::growth::{lost, missed, strays, too_long};
use super::machine::Driven;
use super::model::{MotionModel, Pace};
use super::scales::{Range, Scales, range, rms};
use super::windows::{cut, rows};
use crate::mechanics::Clock;

/// The coarsest step of the integration, in rows.
const COARSEST: f64 = 16.0;
/// The finest, in parts of the time between rows.
const FINEST: f64 = 256.0;
/// Where inputs change in fewer rows than this, steps are short anyway.
const OFTEN: f64 = 3.0;
/// Errors of the integration that are put up with, in sigmas of all rows together.
const UNSEEN: f64 = 0.3;
/// The same of a scheme of a lower order, whose errors grow faster with what a mechanism adds.
const UNSEEN_OF_CHEAPER: f64 = 0.1;
/// The least noise of a channel that is reckoned with, in parts of its range.
const LEAST_SIGMA: f64 = 3e-5;
/// Rows by which the step is judged.
const RESOLVED_ROWS: usize = 4000;
/// Rows that windows shorter than a run have together, at the most: enough to fit the equations by.
const WINDOWED_ROWS: usize = 3000;
/// Rows of the shortest windows in which the equations are fitted first.
const FIRST_WINDOW: usize = 40;
/// A fit misses windows by little, where it misses them by less than this part of an output's spread.
const NEAR: f64 = 0.05;
/// A drive does next to nothing where it does less than this part of the most that it does.
const LEAST_EFFECT: f64 = 0.02;
/// Effects of a drive that differ by less than this part are the same at any pose.
const SAME_EFFECT: f64 = 1e-6;
/// What happens in windows that are too long: to the motion, or to a fit of it.
const GROWS: &str = "a small deviation of the start grows until the motion tells nothing of the physics";
const STRAYS: &str = "the fit of the equations settles on another motion";

/// Median time between two rows, s.
pub(super) fn median_step(recording: &Recording) -> f64 {
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
        Pace::fixed(Method::Kutta, rows)
    } else {
        Pace::fixed(Method::DormandPrince, rows * COARSEST.min(spacing))
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
    let first = first_pace(recording);
    let start = model.nuisance(run);
    let n = run.len();
    let rows: usize = recording.runs.iter().map(Run::len).sum();
    let sigmas: Vec<f64> = (0..recording.channels.len()).map(|c| sigma(recording, run, c)).collect();
    let predict = |model: &MotionModel| {
        let mut out = vec![0.0; n * recording.channels.len()];
        model.predict(run, shared, &start, &mut out).map(|()| out).map_err(|e| e.reason)
    };
    // How far two predictions are apart in sigmas of all rows together, squared.
    let apart = |a: &[f64], b: &[f64]| {
        let columns = a.chunks(n).zip(b.chunks(n)).zip(&sigmas);
        let seen: f64 = columns
            .map(|((a, b), sigma)| a.iter().zip(b).map(|(a, b)| ((a - b) / sigma).powi(2)).sum::<f64>())
            .sum();
        seen * rows as f64 / n as f64
    };
    // Whether they are the same to all tests.
    let alike = |a: &[f64], b: &[f64]| apart(a, b) <= UNSEEN.powi(2);
    model.set_pace(first);
    let mut before = predict(model);
    let finest = median_step(recording) / FINEST;
    let mut step_s = first.step_s;
    while step_s > finest {
        let coarser = step_s;
        step_s *= 0.5;
        model.set_pace(Pace::fixed(first.method, step_s));
        let now = predict(model);
        if let (Ok(before), Ok(now)) = (&before, &now)
            && alike(before, now)
        {
            model.set_pace(Pace::fixed(first.method, coarser));
            let fixed = evaluations(model, run, shared, &start);
            if let Ok(course) = model.course(run, shared, &start) {
                model.set_state_sizes(course.states.iter().map(|state| rms(state)).collect());
            }
            // Where inputs end every step, a cheaper scheme may do as well.
            if first.method == Method::Kutta && coarser == first.step_s {
                model.set_pace(Pace::fixed(Method::Heun, coarser));
                if predict(model).is_ok_and(|cheaper| apart(&cheaper, now) <= UNSEEN_OF_CHEAPER.powi(2)) {
                    return Ok(());
                }
            }
            // Where few places ask for short steps, only those get them.
            model.set_pace(Pace { finest_s: step_s, ..first });
            let cheaper = evaluations(model, run, shared, &start) < fixed;
            if !(cheaper && predict(model).is_ok_and(|cut| alike(&cut, now))) {
                model.set_pace(Pace::fixed(first.method, coarser));
            }
            return Ok(());
        }
        before = now;
    }
    before.map(|_| ())
}

/// How many evaluations of the equations a run takes.
fn evaluations(model: &MotionModel, run: &Run, shared: &[f64], nuisance: &[f64]) -> usize {
    model.along(run, shared, nuisance, |_, _, _| {}).unwrap_or(usize::MAX)
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
pub(super) fn liveliest(recording: &Recording) -> Option<Run> {
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
pub(super) fn sigma(recording: &Recording, run: &Run, channel: usize) -> f64 {
    let measured = run.inputs[0].iter().zip(&run.outputs[channel]).filter(|(_, v)| v.is_finite());
    let (times, column): (Vec<f64>, Vec<f64>) = measured.unzip();
    let rough = || rough_sigma(&times, &column).unwrap_or(0.0);
    let known = recording.calibration[channel].unwrap_or_else(rough);
    let sigma = known.max(recording.resolution[channel] / 12_f64.sqrt());
    let [low, high] = range(column.iter().copied());
    sigma.max(LEAST_SIGMA * (high - low))
}

/// The longest windows in which a motion can be followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Longest {
    /// Their number of rows.
    pub(super) rows: usize,
    /// What longer ones do.
    pub(super) beyond: &'static str,
}

/// A fit of the equations to longer and longer windows.
pub(super) struct Windowed {
    /// The parameters at its end,
    pub(super) fitted: Vec<f64>,
    /// and those of the longest windows that it misses by little: beyond, what is left out may lead it anywhere.
    pub(super) near: Vec<f64>,
    /// The longest windows that can be followed, where whole runs cannot.
    pub(super) followed: Option<Longest>,
}

/// Fits the equations in short windows, then in longer ones: a fit over a whole run from far off would lose the phase and settle in a
/// wrong place.
///
/// What is left out may lead a fit to short windows to parameters of a motion that runs away (a stop pushes back like a spring that is
/// negative): where the parameters that the recording states do not, the fit to longer windows begins at these.
pub(super) fn windows(
    model: &MotionModel,
    recording: &Recording,
    mut shared: Vec<f64>,
) -> Result<Windowed, String> {
    let free = model.freed();
    let stated = shared.clone();
    let longest = recording.runs.iter().map(Run::len).max().unwrap_or(0);
    // What cannot be followed to its end is cut in two at least.
    let cut_at = |followed: usize, beyond| Some(Longest { rows: followed.min((longest / 2).max(1)), beyond });
    let mut length = FIRST_WINDOW;
    let mut followed = FIRST_WINDOW;
    let mut missed_before = f64::INFINITY;
    let mut near = shared.clone();
    loop {
        let whole = length >= longest;
        if length > FIRST_WINDOW {
            let shorter = cut(recording, followed);
            let grows = |shared: &[f64]| -> Result<bool, String> {
                let sizes = sizes(&free, &shorter, shared)?;
                Ok(too_long(&free, recording, shared, &sizes.moves, length.min(longest)))
            };
            if grows(&shared)? {
                if shared == stated || grows(&stated)? {
                    return Ok(Windowed { fitted: shared, near, followed: cut_at(followed, GROWS) });
                }
                shared.clone_from(&stated);
            }
        }
        let mut windowed = if whole { recording.clone() } else { cut(recording, length) };
        if !whole {
            // Evenly spread, not all of them.
            let most =
                (WINDOWED_ROWS / length).max(2 * model.spec().parameters.len()).min(windowed.runs.len());
            let every = windowed.runs.len() as f64 / most as f64;
            windowed.runs = (0..most).map(|k| windowed.runs[(k as f64 * every) as usize].clone()).collect();
        }
        let model = if whole { model } else { &free };
        let fit_from = |shared: &[f64]| {
            let fit = reweighted_least_squares(model, &windowed, shared).ok()?;
            Some((missed(model, recording, &windowed, &fit), fit.shared))
        };
        let mut fit = fit_from(&shared);
        if shared != stated && fit.as_ref().is_none_or(|(missed, _)| strays(*missed)) {
            let other = fit_from(&stated);
            fit = [fit, other].into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0));
        }
        if let Some((missed, fitted)) = fit {
            if lost(missed, missed_before) {
                return Ok(Windowed { fitted: shared, near, followed: cut_at(followed, STRAYS) });
            }
            (shared, missed_before) = (fitted, missed);
            if missed < NEAR {
                near.clone_from(&shared);
            }
        }
        followed = length;
        if whole {
            return Ok(Windowed { fitted: shared, near, followed: None });
        }
        length = length.saturating_mul(2);
    }
}

/// By joint, whether its drive moves it more or less by the pose of a machine whose joints carry one another: then so do its forces.
///
/// None of a drive that turns its sign, or does next to nothing, anywhere: what it does hangs on its direction then, not on what the joint carries.
fn levers(model: &MotionModel, recording: &Recording, shared: &[f64]) -> Result<Vec<bool>, String> {
    let joints = &model.equations().joints;
    let mut seen: Vec<Vec<f64>> = vec![Vec::new(); joints.len()];
    let coupled = |k: &usize| !joints[*k].reacts.is_empty();
    if !(0..joints.len()).any(|k| coupled(&k)) {
        return Ok(vec![false; joints.len()]);
    }
    for run in &recording.runs {
        model.along(run, shared, &model.nuisance(run), |machine, t, x| {
            let zero = vec![0.0; x.len()];
            for k in (0..joints.len()).filter(coupled) {
                // A drive of which two units do not twice what one does is none that is told by a number.
                let effect = |machine: &mut Driven<'_, f64>, x: &[f64]| {
                    machine.effect_at(k, t, x).filter(|effect| effect.is_finite()).unwrap_or(f64::INFINITY)
                };
                seen[k].extend([effect(machine, x), effect(machine, &zero)]);
            }
        })?;
    }
    let lever = |seen: Vec<f64>| {
        let [least, most] = seen.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], effect| {
            [least.min(*effect), most.max(*effect)]
        });
        let largest = least.abs().max(most.abs());
        let inertia = least * most > 0.0 && least.abs().min(most.abs()) > LEAST_EFFECT * largest;
        inertia && largest.is_finite() && most - least > SAME_EFFECT * largest
    };
    Ok(seen.into_iter().map(lever).collect())
}

/// How large the motions are.
pub(super) fn sizes(model: &MotionModel, recording: &Recording, shared: &[f64]) -> Result<Scales, String> {
    let states = model.equations().states.len();
    let levers = levers(model, recording, shared)?;
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
        runs: recording.runs.len(),
        levers,
        ..Scales::default()
    };
    Ok(scales.measure(model.equations(), &all, &rates))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use missing_physics::model::Scope;

    use super::super::equations::Equations;
    use super::super::recorded;
    use super::*;
    use crate::recording::{Header, Memory, Source};

    const CLIPPED: &str = r#"
format = 1
[model]
states = { angle_rad = "rate_rad_s", rate_rad_s = "300*min(max(gain*(goal_rad - angle_rad), -1), 1) - 8*rate_rad_s" }
outputs = { encoder_rad = "angle_rad" }
inputs = { goal_rad = "linear" }
[start]
angle_rad = 0.0
rate_rad_s = 0.0
[[parameter]]
name = "gain"
start = 2.0
"#;

    /// A servo whose command is clipped now and then: only the rows in which that begins or ends ask for short steps, and what is predicted
    /// is the motion of steps that are all shorter still.
    #[test]
    fn steps_are_short_only_where_an_expression_has_a_kink() {
        let header = Header::parse(Source::Memory(Memory::new("a servo")), CLIPPED, false).unwrap();
        let equations = Equations::read(&header).unwrap();
        let times: Vec<f64> = (0..800).map(|k| 0.01 * f64::from(k)).collect();
        let goal: Vec<f64> = times.iter().map(|t| (1.5 * t).sin() + 0.4 * (7.0 * t).sin()).collect();
        // Readings in steps of a tenth of a milliradian.
        let encoder = goal.iter().map(|g| (1e4 * g).round() * 1e-4).collect();
        let run = Run { label: "1".into(), inputs: vec![times, goal], outputs: vec![encoder], kind: 0 };
        let recording = recorded(&["encoder_rad"], "goal_rad", run, 1e-4);
        let mut model = MotionModel::baseline(equations, first_pace(&recording));
        let shared = model.spec().starts(Scope::Shared);
        resolve(&mut model, &recording, &shared).unwrap();
        let found = model.pace();
        assert!(found.finest_s < found.step_s, "{found:?}");
        let run = &recording.runs[0];
        let all = |model: &MotionModel| {
            let mut out = vec![0.0; run.len()];
            model.predict(run, &shared, &[], &mut out).unwrap();
            (out, evaluations(model, run, &shared, &[]))
        };
        let (cut, cost) = all(&model);
        model.set_pace(Pace::fixed(Method::Kutta, 0.01 / 256.0));
        let (fine, _) = all(&model);
        let worst = cut.iter().zip(&fine).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 2e-5, "{worst}");
        // As many steps as rows, and a few more.
        assert!(cost < 9 * run.len(), "{cost}");
    }
}
