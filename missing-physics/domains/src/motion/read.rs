//! A recording's table: runs of rows with inputs and outputs.

use missing_physics::data::{Recording, Run};
use missing_physics::model::Quantity;

use super::equations::Equations;
use super::units;
use crate::reading::{calibration, check_runs, number, sensor_steps};
use crate::recording::{Column, Header, ReadError};

/// A run with fewer rows says nothing beyond its own start.
const FEWEST_ROWS: usize = 4;

/// Reads the equations and the table.
///
/// # Errors
/// [`ReadError`].
pub(super) fn read(header: &Header) -> Result<(Equations, Recording), ReadError> {
    let equations = Equations::read(header)?;
    let mut columns =
        vec![Column { name: "run", what: "label of the run", label: true }, number("t_s", "time in seconds")];
    columns.extend(equations.outputs.iter().map(|o| number(&o.name, "what was measured")));
    columns.extend(equations.inputs.iter().map(|i| number(&i.name, "an input, known exactly")));
    let table = header.sparse_table("data", &columns)?;
    let labels = table.labels("run", "the label of each row's run")?;
    let wanted = |name: &str, what: &str| table.numbers(name).ok_or_else(|| table.missing(name, what));
    let times = wanted("t_s", "time in seconds")?;
    if let Some(row) = times.iter().position(|t| t.is_nan()) {
        return Err(table.cell(row, "t_s", f64::NAN, "a time in seconds"));
    }
    let outputs = equations
        .outputs
        .iter()
        .map(|o| wanted(&o.name, "a measured column, as [model] outputs says"))
        .collect::<Result<Vec<_>, _>>()?;
    let inputs = equations
        .inputs
        .iter()
        .map(|i| {
            let column = wanted(&i.name, "an input, as [model] inputs says")?;
            match column.iter().position(|v| v.is_nan()) {
                None => Ok(column),
                Some(row) => {
                    Err(table.cell(row, &i.name, f64::NAN, "a number: an input is known in every row"))
                }
            }
        })
        .collect::<Result<Vec<_>, _>>()?;
    let runs: Vec<Run> = check_runs(&table, labels, FEWEST_ROWS, Some("t_s"))?
        .into_iter()
        .map(|(label, rows)| {
            let pick = |column: &[f64]| rows.iter().map(|&r| column[r]).collect::<Vec<f64>>();
            let known = std::iter::once(pick(times)).chain(inputs.iter().map(|c| pick(c)));
            Run {
                label,
                inputs: known.collect(),
                outputs: outputs.iter().map(|c| pick(c)).collect(),
                kind: 0,
            }
        })
        .collect();
    for (output, column) in equations.outputs.iter().zip(&outputs) {
        if !header.gaps() && column.iter().all(|v| v.is_nan()) {
            let expected = "at least one measured row".into();
            return Err(ReadError::TooFewRows {
                file: table.file.clone(),
                what: output.name.clone(),
                got: 0,
                expected,
            });
        }
    }
    let names: Vec<&str> = equations.outputs.iter().map(|o| o.name.as_str()).collect();
    let quantity = |name: &str| Quantity::new(name, units::text(name));
    let steps = outputs.iter().map(|c| quantum(c.iter().copied().filter(|v| v.is_finite()).collect()));
    let resolution = sensor_steps(&runs, steps);
    let recording = Recording {
        channels: names.iter().map(|n| quantity(n)).collect(),
        variables: std::iter::once(quantity("t_s"))
            .chain(equations.inputs.iter().map(|i| quantity(&i.name)))
            .collect(),
        runs,
        noise_along: Some(0),
        calibration: calibration(header, &names)?,
        resolution,
    };
    drop(table);
    Ok((equations, recording))
}

/// Gaps between readings are multiples of a step to this part of it, where readings come in steps.
const EVEN: f64 = 0.1;

/// The step in which a column's readings come, else 0: an encoder's step is no round number, and readings are rounded once more when they
/// are written.
fn quantum(mut readings: Vec<f64>) -> f64 {
    readings.sort_by(f64::total_cmp);
    let largest = readings.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let gaps: Vec<f64> = readings.windows(2).map(|w| w[1] - w[0]).filter(|g| *g > 1e-9 * largest).collect();
    let least = gaps.iter().copied().fold(f64::INFINITY, f64::min);
    let steps: f64 = gaps.iter().map(|g| (g / least).round()).sum();
    let step = gaps.iter().sum::<f64>() / steps;
    let even = |g: &f64| (g / step - (g / step).round()).abs() < EVEN;
    if gaps.len() > 2 && gaps.iter().all(even) { step } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::quantum;

    /// An encoder of 40,000 steps a turn, written to the micrometre; and readings that come in no steps.
    #[test]
    fn the_step_of_an_encoder_is_found_although_it_is_rounded() {
        let step = std::f64::consts::TAU / 40_000.0;
        let written = |k: i32| (f64::from(k * k % 997) * step * 1e6).round() / 1e6;
        let found = quantum((0..300).map(written).collect());
        assert!((found / step - 1.0).abs() < 1e-4, "{found}");
        assert_eq!(quantum((0..300).map(|k| f64::from(k).sin()).collect()), 0.0);
    }
}
