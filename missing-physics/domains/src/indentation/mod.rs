//! The domain `indentation`: an indenter pressed into a soft body.

#[cfg(test)]
mod derivatives;
mod experiments;
pub mod model;
mod spec;

use hertz_contact::indenter::Indenter;
use missing_physics::data::{Recording, Run};
use missing_physics::model::{Model, Quantity, Spec};

use super::reading::{calibration, check_runs, number, resolution};
use crate::recording::{Column, Header, ReadError, Section, Table, quoted};
use crate::{Domain, Loaded, Template};
use model::{Condition, IndentationModel, Setup};

const COLUMNS: [Column; 8] = [
    Column { name: "run", what: "label of the run", label: true },
    number("delta_m", "indentation in metres"),
    number("force_n", "force in newtons"),
    number("t_s", "time in seconds"),
    Column { name: "segment", what: "load, hold or unload", label: true },
    number("pressure_pa", "pressure in pascals, the condition of the run"),
    number("stretch_m", "stretch in metres, the condition of the run"),
    Column { name: "site", what: "place or sample, the condition of the run", label: true },
];
/// A curve with fewer rows says nothing of two unknowns.
const FEWEST_ROWS: usize = 3;
/// What the segments are in the model's input.
const SEGMENTS: [&str; 3] = ["load", "hold", "unload"];
/// More conditions than this are a mistake in the column.
const MOST_CONDITIONS: usize = 200;

/// The domain.
#[derive(Debug, Clone, Copy)]
pub struct Indentation;

impl Domain for Indentation {
    fn id(&self) -> &'static str {
        "indentation"
    }

    fn summary(&self) -> &'static str {
        "an indenter pressed into a soft body: force over depth"
    }

    fn reads(&self) -> &'static [(&'static str, &'static str)] {
        &[
            ("run, delta_m, force_n", "positive under compression"),
            ("t_s, segment", "optional: time, and load, hold or unload; relaxation needs the time"),
            (
                "pressure_pa, stretch_m or site",
                "optional: the condition of a run, which has a modulus of its own",
            ),
            (
                "[rig] indenter",
                "{ shape = \"sphere\" or \"cylinder\", radius_m } or { shape = \"cone\", angle_rad }",
            ),
            ("", "without radius_m the modulus times its power of the radius is reported"),
            ("[rig] poisson_ratio, thickness_m", "optional: 0.5; the body's thickness on a rigid base"),
            ("[noise] force_n", "optional: one sigma from a calibration"),
        ]
    }

    fn spec(&self) -> Spec {
        let setup = Setup {
            indenter: Indenter::Sphere { radius_m: 0.01 },
            radius_known: true,
            poisson_ratio: 0.5,
            thickness_m: None,
            timed: true,
        };
        let condition = Condition { name: "modulus_pa".into(), start_pa: 1e4 };
        IndentationModel::new(setup, &[condition], 0.01, 1.0, 10.0)
            .map(|m| m.spec().clone())
            .unwrap_or_default()
    }

    fn template(&self) -> Template {
        Template { header: include_str!("template.toml"), data: ("data.csv", include_str!("template.csv")) }
    }

    fn load(&self, header: &Header) -> Result<Loaded, ReadError> {
        let rig = header.section("rig")?;
        let (indenter, radius_known) = indenter(&rig)?;
        let poisson_ratio = rig.number("poisson_ratio", -0.99, 0.5)?.unwrap_or(0.5);
        let thickness_m = rig.number("thickness_m", 1e-9, 1e3)?;
        let table = header.table("data", &COLUMNS)?;
        let labels = table.labels("run", "the label of each row's run")?;
        let column = |name: &str, what: &str| table.numbers(name).ok_or_else(|| table.missing(name, what));
        let (depths, forces) =
            (column("delta_m", "indentation in metres")?, column("force_n", "force in newtons")?);
        let times = table.numbers("t_s");
        let segments = segments(&table)?;
        let keys = conditions(&table)?;
        let calibration = calibration(header, &["force_n"])?;
        let by_run = check_runs(&table, labels, FEWEST_ROWS, times.map(|_| "t_s"))?;
        let mut known: Vec<String> = Vec::new();
        let mut runs = Vec::new();
        for (label, rows) in by_run {
            let pick = |column: &[f64]| rows.iter().map(|&r| column[r]).collect::<Vec<f64>>();
            let key = match &keys {
                None => String::new(),
                Some((column, keys)) => {
                    if let Some(&row) = rows.iter().find(|&&r| keys[r] != keys[rows[0]]) {
                        return Err(ReadError::Cell {
                            file: table.file.clone(),
                            row: table.lines[row],
                            column: (*column).into(),
                            got: quoted(&keys[row]),
                            expected: format!("{}, as in the rest of its run", quoted(&keys[rows[0]])),
                        });
                    }
                    keys[rows[0]].clone()
                }
            };
            let kind = known.iter().position(|k| *k == key).unwrap_or_else(|| {
                known.push(key);
                known.len() - 1
            });
            if known.len() > MOST_CONDITIONS {
                let expected = format!("at most {MOST_CONDITIONS} conditions");
                return Err(ReadError::TooFewRows {
                    file: table.file.clone(),
                    what: "the file".into(),
                    got: known.len(),
                    expected,
                });
            }
            let mut inputs = vec![pick(depths)];
            inputs.extend(times.map(pick));
            inputs.extend(segments.as_deref().map(pick));
            runs.push(Run { label, inputs, outputs: vec![pick(forces)], kind: kind as u32 });
        }
        let mut variables = vec![Quantity::new("delta_m", "m")];
        variables.extend(times.map(|_| Quantity::new("t_s", "s")));
        variables.extend(segments.as_ref().map(|_| Quantity::new("segment", "")));
        let recording = Recording {
            channels: vec![Quantity::new("force_n", "N")],
            variables,
            runs,
            noise_along: times.map(|_| 1),
            calibration,
            resolution: vec![resolution(forces)],
        };
        let setup = Setup { indenter, radius_known, poisson_ratio, thickness_m, timed: times.is_some() };
        let deepest = depths.iter().fold(0.0, |m: f64, d| m.max(*d));
        if !(deepest > 0.0) {
            return Err(table.cell(0, "delta_m", depths[0], "some rows above 0: nothing was pressed"));
        }
        let strongest = forces.iter().fold(0.0, |m: f64, f| m.max(f.abs())).max(f64::MIN_POSITIVE);
        let names: Vec<Condition> = known
            .iter()
            .enumerate()
            .map(|(kind, key)| Condition {
                name: setup.modulus_name(keys.as_ref().map(|(column, _)| (*column, key.as_str()))),
                start_pa: model::start_modulus(&setup, &recording.runs, kind as u32),
            })
            .collect();
        let longest = recording
            .runs
            .iter()
            .filter_map(|r| Some(r.inputs.get(1)?.last()? - r.inputs.get(1)?.first()?))
            .fold(0.0, f64::max);
        let model = IndentationModel::new(setup, &names, deepest, strongest, longest)
            .map_err(|e| rig.unfit("indenter", "this indenter", e))?;
        let experiments = experiments::experiments(&model, &recording);
        let mut undetermined =
            vec!["only E / (1 - nu^2) is measured: the modulus is for the stated Poisson's ratio".to_owned()];
        if times.is_none() {
            undetermined
                .push("without t_s a body that relaxes cannot be told: viscoelasticity was not tried".into());
        }
        Ok(Loaded {
            recording,
            model: Box::new(model),
            experiments,
            undetermined,
            additions: serde_json::Map::new(),
        })
    }
}

fn indenter(rig: &Section<'_>) -> Result<(Indenter, bool), ReadError> {
    const SHAPES: &str = "\"sphere\", \"cylinder\" or \"cone\"";
    let section = rig.section("indenter")?;
    let shape = section.text("shape", SHAPES)?;
    if shape == "cone" {
        let angle_rad = section.required("angle_rad", 1e-3, 1.57)?;
        return Ok((Indenter::Cone { angle_rad }, true));
    }
    let radius = section.number("radius_m", 1e-9, 1e3)?;
    // Without a radius a metre stands for it: what is reported is the modulus times the radius to its power.
    let radius_m = radius.unwrap_or(1.0);
    match shape {
        "sphere" => Ok((Indenter::Sphere { radius_m }, radius.is_some())),
        "cylinder" => Ok((Indenter::Cylinder { radius_m }, radius.is_some())),
        other => Err(section.unfit("shape", quoted(other), SHAPES)),
    }
}

fn segments(table: &Table) -> Result<Option<Vec<f64>>, ReadError> {
    let Ok(labels) = table.labels("segment", "") else { return Ok(None) };
    let number = |(row, label): (usize, &String)| {
        SEGMENTS.iter().position(|s| s == label).map(|at| at as f64).ok_or_else(|| ReadError::Cell {
            file: table.file.clone(),
            row: table.lines[row],
            column: "segment".into(),
            got: quoted(label),
            expected: SEGMENTS.join(", "),
        })
    };
    labels.iter().enumerate().map(number).collect::<Result<Vec<f64>, _>>().map(Some)
}

/// The condition column, if there is one: its name, and the value of each row as text.
fn conditions(table: &Table) -> Result<Option<(&'static str, Vec<String>)>, ReadError> {
    let mut found: Option<(&'static str, Vec<String>)> = None;
    for name in ["pressure_pa", "stretch_m", "site"] {
        let keys = match (table.numbers(name), table.labels(name, "")) {
            (Some(numbers), _) => numbers.iter().map(|v| format!("{}", v + 0.0)).collect(),
            (None, Ok(labels)) => labels.to_vec(),
            (None, Err(_)) => continue,
        };
        if let Some((first, _)) = &found {
            return Err(ReadError::UnknownColumn {
                file: table.file.clone(),
                column: name.into(),
                expected: format!("one condition column, and {first} is there"),
            });
        }
        found = Some((name, keys));
    }
    Ok(found)
}
