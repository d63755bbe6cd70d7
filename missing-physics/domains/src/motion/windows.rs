//! Long recordings: rows that need not count, and runs that no prediction from their first row can follow.
//!
//! Where a small deviation at the start grows until it is as large as the motion (chaos, an unstable balance, a position that is an
//! acceleration integrated twice), the misfit at a run's end says how well the start was known, not which physics is missing. Such runs
//! are cut into windows whose starts are free (multiple shooting; Bock 1981, doi:10.1007/978-3-642-68220-9_8).

use joint_laws::signal::Between;
use missing_physics::data::{Recording, Run};

use super::equations::Equations;
use super::knots::{fewer, jumps};
use super::scales::range;

/// Measured values that count at the most.
const MOST_VALUES: usize = 12_000;
/// Rows of inputs that are followed at the most.
const MOST_ROWS: usize = 200_000;

/// Joining inputs by lines is worth it where it leaves fewer rows by this factor.
const FEWER: usize = 2;

/// The rows `from..to` of a run, as a run of its own.
pub(super) fn rows(run: &Run, from: usize, to: usize) -> Run {
    let pick = |columns: &[Vec<f64>]| columns.iter().map(|c| c[from..to].to_vec()).collect();
    Run { label: run.label.clone(), inputs: pick(&run.inputs), outputs: pick(&run.outputs), kind: run.kind }
}

/// A recording cut into windows of a number of rows; a run's last one is longer. A window's kind says which run it is of, and whether
/// it is not its first ([`of_run`], [`continues`]).
pub(super) fn cut(recording: &Recording, length: usize) -> Recording {
    let windows = |(number, run): (usize, &Run)| -> Vec<Run> {
        let count = (run.len() / length).max(1);
        let window = |k: usize| {
            let (from, to) = (k * length, if k + 1 == count { run.len() } else { (k + 1) * length });
            let mut window = rows(run, from, to);
            window.kind = 2 * number as u32 + u32::from(k > 0);
            if count > 1 {
                let (begin, end) = (run.inputs[0][from], run.inputs[0][to - 1]);
                window.label = format!("{}, {begin:.4} to {end:.4} s", run.label);
            }
            window
        };
        (0..count).map(window).collect()
    };
    Recording { runs: recording.runs.iter().enumerate().flat_map(windows).collect(), ..recording.clone() }
}

/// The number of the run that a window is of.
pub(super) fn of_run(window: &Run) -> usize {
    (window.kind / 2) as usize
}

/// Whether a window is not its run's first.
pub(super) fn continues(window: &Run) -> bool {
    window.kind % 2 == 1
}

/// A recording of which no more rows count than need be.
pub(super) struct Thinned {
    /// Of so many measured values one counts.
    pub(super) every: usize,
    /// With inputs as they are, while they can.
    pub(super) exact: Recording,
    /// With inputs joined by straight lines between the rows that count, where that makes fewer rows.
    pub(super) joined: Option<Recording>,
}

/// A recording of which no more rows count than need be, where it has more.
pub(super) fn thin(equations: &Equations, recording: &Recording) -> Option<Thinned> {
    let measured = |run: &Run| run.outputs.iter().flatten().filter(|v| v.is_finite()).count();
    let values: usize = recording.runs.iter().map(measured).sum();
    let all: usize = recording.runs.iter().map(Run::len).sum();
    if values <= MOST_VALUES {
        return None;
    }
    let every = values.div_ceil(MOST_VALUES);
    let inputs = 1..=equations.inputs.len();
    let held: Vec<bool> = equations.inputs.iter().map(|i| i.between == Between::Hold).collect();
    let spans: Vec<f64> = inputs
        .clone()
        .map(|k| {
            let [low, high] = range(recording.runs.iter().flat_map(|r| r.inputs[k].iter().copied()));
            high - low
        })
        .collect();
    let (mut exact, mut joined) = (Vec::new(), Vec::new());
    for run in &recording.runs {
        let n = run.len();
        let changes = |i: usize, j: usize| inputs.clone().any(|k| run.inputs[k][i] != run.inputs[k][j]);
        let counts: Vec<Vec<bool>> = run.outputs.iter().map(|column| every_measured(column, every)).collect();
        let counted = |i: usize| counts.iter().any(|c| c[i]);
        let outputs = run.outputs.iter().zip(&counts).map(|(column, counts)| {
            column.iter().zip(counts).map(|(v, counts)| if *counts { *v } else { f64::NAN }).collect()
        });
        let run = Run { outputs: outputs.collect(), ..run.clone() };
        let needed =
            |i: usize| all <= MOST_ROWS && i > 0 && (changes(i, i - 1) || i + 1 < n && changes(i, i + 1));
        let kept: Vec<usize> = (0..n).filter(|&i| i == 0 || counted(i) || needed(i)).collect();
        exact.push(pick(&run, &kept));
        let mut jumps: Vec<usize> = inputs
            .clone()
            .zip(&spans)
            .zip(&held)
            .filter(|(_, held)| **held)
            .flat_map(|((k, span), _)| jumps(&run.inputs[k], *span))
            .collect();
        jumps.sort_unstable();
        jumps.dedup();
        let kept: Vec<usize> =
            (0..n).filter(|&i| i == 0 || counted(i) || jumps.binary_search(&i).is_ok()).collect();
        joined.push(fewer(&run, &kept, &jumps, &held));
    }
    let rows = |runs: &[Run]| runs.iter().map(Run::len).sum::<usize>();
    let fewer = FEWER * rows(&joined) <= rows(&exact) || all > MOST_ROWS;
    let with = |runs: Vec<Run>| Recording { runs, ..recording.clone() };
    let joined = (fewer && !equations.inputs.is_empty()).then(|| with(joined));
    Some(Thinned { every, exact: with(exact), joined })
}

/// Some rows of a run.
fn pick(run: &Run, rows: &[usize]) -> Run {
    let pick = |columns: &[Vec<f64>]| columns.iter().map(|c| rows.iter().map(|&i| c[i]).collect()).collect();
    Run { label: run.label.clone(), inputs: pick(&run.inputs), outputs: pick(&run.outputs), kind: run.kind }
}

/// Which values of a column count: of those that are measured, each of a number.
fn every_measured(column: &[f64], every: usize) -> Vec<bool> {
    let mut before = 0_usize;
    let mut counts = |v: &f64| {
        before += usize::from(v.is_finite());
        v.is_finite() && (before - 1_usize).is_multiple_of(every)
    };
    column.iter().map(&mut counts).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use missing_physics::model::{Model as _, Scope};

    use super::super::follow::{first_pace, sizes};
    use super::super::model::MotionModel;
    use super::super::recorded;
    use super::*;
    use crate::recording::{Header, Memory, Source};

    const DRIVE: &str = r#"
format = 1
[model]
states = { angle_rad = "rate_rad_s", rate_rad_s = "80*command_v - 9*rate_rad_s" }
outputs = { encoder_rad = "angle_rad", tacho_rad_s = "rate_rad_s" }
inputs = { command_v = "hold" }
"#;

    /// A command that is on its way, or that a slow drive still follows, when a window begins: the motion in each window is that of the
    /// whole run.
    #[test]
    fn a_command_of_the_window_before_acts_in_the_next() {
        let header = Header::parse(Source::Memory(Memory::new("a drive")), DRIVE, false).unwrap();
        let times: Vec<f64> = (0..160).map(|k| 0.01 * f64::from(k)).collect();
        let command: Vec<f64> = times.iter().map(|t| (3.0 * t).sin() + (17.0 * t).cos()).collect();
        let outputs = vec![command.clone(), command.clone()];
        let run = Run { label: "1".into(), inputs: vec![times, command], outputs, kind: 0 };
        let columns = ["encoder_rad", "tacho_rad_s"];
        let recording = recorded(&columns, "command_v", run, 0.0);
        let equations = Equations::read(&header).unwrap();
        let baseline = MotionModel::baseline(equations, first_pace(&recording));
        let scales = sizes(&baseline, &recording, &[]).unwrap();
        let model = |cut: Option<&[Run]>| baseline.clone().full(scales.clone(), &[], cut);
        let (whole, windowed) = (model(None), model(Some(&recording.runs)));
        for (effect, size) in [("input-delay", 0.043), ("input-lag", 0.03)] {
            let spec = whole.spec();
            let mechanism = spec.mechanisms.iter().find(|m| m.id == effect).unwrap();
            let mut shared = spec.starts(Scope::Shared);
            shared[spec.slots()[mechanism.parameters[0]]] = size;
            let run = &recording.runs[0];
            let mut all = vec![0.0; 2 * run.len()];
            whole.predict(run, &shared, &[0.3, -0.2], &mut all).unwrap();
            let mut first = 0;
            for window in &cut(&recording, 50).runs {
                let mut here = vec![0.0; 2 * window.len()];
                let begins = [all[first], all[run.len() + first]];
                windowed.predict(window, &shared, &begins, &mut here).unwrap();
                for (channel, here) in here.chunks(window.len()).enumerate() {
                    for (row, value) in here.iter().enumerate() {
                        let expected = all[channel * run.len() + first + row];
                        let label = &window.label;
                        assert!(
                            (value - expected).abs() < 1e-3,
                            "{effect} {label} {row}: {value} {expected}"
                        );
                    }
                }
                first += window.len();
            }
        }
    }
}
