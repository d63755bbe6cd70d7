//! A recording's table: runs of rows with inputs and outputs.

use missing_physics::data::{Recording, Run};
use missing_physics::model::Quantity;

use super::equations::Equations;
use super::units;
use crate::reading::{calibration, check_runs, number, resolution};
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
    let measured: Vec<Vec<f64>> =
        outputs.iter().map(|c| c.iter().copied().filter(|v| v.is_finite()).collect()).collect();
    let recording = Recording {
        channels: names.iter().map(|n| quantity(n)).collect(),
        variables: std::iter::once(quantity("t_s"))
            .chain(equations.inputs.iter().map(|i| quantity(&i.name)))
            .collect(),
        runs,
        noise_along: Some(0),
        calibration: calibration(header, &names)?,
        resolution: measured.iter().map(|c| resolution(c)).collect(),
    };
    drop(table);
    Ok((equations, recording))
}
