//! Long recordings: rows that need not count, and runs that no prediction from their first row can follow.
//!
//! Where a small deviation at the start grows until it is as large as the motion (chaos, an unstable balance, a position that is an
//! acceleration integrated twice), the misfit at a run's end says how well the start was known, not which physics is missing. Such runs
//! are cut into windows whose starts are free (multiple shooting; Bock 1981, doi:10.1007/978-3-642-68220-9_8).

use missing_physics::data::{Recording, Run};

use super::equations::Equations;

/// Measured values that count at the most.
const MOST_VALUES: usize = 12_000;
/// Rows of inputs that are followed at the most.
const MOST_ROWS: usize = 200_000;

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

/// A recording of which no more rows count than need be, and by how much it was thinned; inputs stay as they are while they can.
pub(super) fn thin(equations: &Equations, recording: &mut Recording) -> Option<usize> {
    let measured = |run: &Run| run.outputs.iter().flatten().filter(|v| v.is_finite()).count();
    let values: usize = recording.runs.iter().map(measured).sum();
    let all: usize = recording.runs.iter().map(Run::len).sum();
    if values <= MOST_VALUES {
        return None;
    }
    let every = values.div_ceil(MOST_VALUES);
    let inputs = 1..=equations.inputs.len();
    for run in &mut recording.runs {
        let n = run.len();
        let changes = |i: usize, j: usize| inputs.clone().any(|k| run.inputs[k][i] != run.inputs[k][j]);
        let counts: Vec<Vec<bool>> = run.outputs.iter().map(|column| every_measured(column, every)).collect();
        let needed =
            |i: usize| all <= MOST_ROWS && i > 0 && (changes(i, i - 1) || i + 1 < n && changes(i, i + 1));
        let kept: Vec<usize> =
            (0..n).filter(|&i| i == 0 || counts.iter().any(|c| c[i]) || needed(i)).collect();
        let pick = |column: &Vec<f64>| kept.iter().map(|&i| column[i]).collect();
        let picked: Vec<Vec<f64>> = run.inputs.iter().map(pick).collect();
        let thinned = |(column, counts): (&Vec<f64>, &Vec<bool>)| {
            kept.iter().map(|&i| if counts[i] { column[i] } else { f64::NAN }).collect()
        };
        let outputs: Vec<Vec<f64>> = run.outputs.iter().zip(&counts).map(thinned).collect();
        (run.inputs, run.outputs) = (picked, outputs);
    }
    Some(every)
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
