//! Bins along a variable.

use crate::problem::Problem;

/// Intervals have their ends at these quantiles of a variable.
const BINS: usize = 24;

/// The variables along which an interval may lie: the inputs, in the order of the recording, or the number of the row.
pub(crate) fn variables(problem: &Problem<'_>) -> Vec<Option<usize>> {
    if problem.recording.variables.is_empty() {
        return vec![None];
    }
    (0..problem.recording.variables.len()).map(Some).collect()
}

/// A variable's name, for a person.
pub(crate) fn variable_name(problem: &Problem<'_>, variable: Option<usize>) -> String {
    variable.map_or_else(|| "row".into(), |v| problem.recording.variables[v].name.clone())
}

/// A variable's value at a row; the number of the row where there is no variable.
pub(crate) fn value(problem: &Problem<'_>, variable: Option<usize>, run: usize, row: usize) -> f64 {
    variable.map_or(row as f64, |v| problem.recording.runs[run].inputs[v][row])
}

/// Edges of at most [`BINS`] bins with as many rows each.
pub(crate) fn edges(problem: &Problem<'_>, channel: usize, variable: Option<usize>) -> Vec<f64> {
    let mut values: Vec<f64> = (0..problem.rows.len())
        .flat_map(|r| problem.rows[r].valid[channel].iter().map(move |&i| (r, i)))
        .map(|(r, i)| value(problem, variable, r, i))
        .collect();
    values.sort_by(f64::total_cmp);
    if values.is_empty() {
        return values;
    }
    let last = values.len() - 1;
    let mut edges: Vec<f64> = (0..=BINS).map(|k| values[k * last / BINS]).collect();
    edges.dedup();
    edges
}

/// The bin of a value.
pub(crate) fn bin(value: f64, edges: &[f64]) -> usize {
    edges.partition_point(|e| *e <= value).clamp(1, edges.len() - 1) - 1
}
