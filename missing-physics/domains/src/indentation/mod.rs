//! The domain `indentation`: an indenter pressed into a soft body.

#[cfg(test)]
mod derivatives;
mod experiments;
mod local;
mod model;
mod setup;
mod spec;

use hertz_contact::indenter::Indenter;
use missing_physics::data::{Recording, Run};
use missing_physics::model::{Model, Quantity, Spec};

use crate::domain::{CheckedRecording, Domain, Loaded, Template};
use crate::plausible;
use crate::reading::{calibration, check_runs, number, resolution};
use crate::recording::{Column, Header, ReadError, Section, Table, quoted};
pub use model::IndentationModel;
use setup::start_modulus;
pub use setup::{Condition, Setup};

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

    fn columns(&self) -> &'static [Column<'static>] {
        &COLUMNS
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

    fn read(&self, header: &Header) -> Result<CheckedRecording, ReadError> {
        let rig = header.section("rig")?;
        let (indenter, radius_known) = indenter(&rig)?;
        let poisson_ratio = rig.number("poisson_ratio", -0.99, 0.5)?.unwrap_or(0.5);
        let thickness_m = rig.number("thickness_m", 1e-9, 1e3)?;
        let table = header.table("data", &COLUMNS)?;
        let curves = Curves::of(&table)?;
        let timed = curves.times.is_some();
        let runs = curves.by_run(&table)?;
        let mut variables = vec![Quantity::new("delta_m", "m")];
        variables.extend(curves.times.map(|_| Quantity::new("t_s", "s")));
        variables.extend(curves.segments.as_ref().map(|_| Quantity::new("segment", "")));
        let setup = Setup { indenter, radius_known, poisson_ratio, thickness_m, timed };
        let conditions = runs.conditions.iter().enumerate().map(|(kind, key)| Condition {
            name: setup.modulus_name(curves.conditions.as_ref().map(|(column, _)| (*column, key.as_str()))),
            start_pa: start_modulus(&setup, &runs.runs, kind as u32),
        });
        let conditions: Vec<Condition> = conditions.collect();
        let recording = Recording {
            channels: vec![Quantity::new("force_n", "N")],
            variables,
            runs: runs.runs,
            noise_along: curves.times.map(|_| 1),
            calibration: calibration(header, &["force_n"])?,
            resolution: vec![resolution(curves.forces)],
        };
        let deepest = curves.depths.iter().fold(0.0, |m: f64, d| m.max(*d));
        if !(deepest > 0.0) {
            return Err(table.cell(0, "delta_m", curves.depths[0], "some rows above 0: nothing was pressed"));
        }
        let strongest = curves.forces.iter().fold(0.0, |m: f64, f| m.max(f.abs())).max(f64::MIN_POSITIVE);
        let longest = recording
            .runs
            .iter()
            .filter_map(|r| Some(r.inputs.get(1)?.last()? - r.inputs.get(1)?.first()?))
            .fold(0.0, f64::max);
        let model = IndentationModel::new(setup, &conditions, deepest, strongest, longest)
            .map_err(|e| rig.unfit("indenter", "this indenter", e))?;
        let experiments = experiments::experiments(&model, &recording);
        let mut undetermined =
            vec!["only E / (1 - nu^2) is measured: the modulus is for the stated Poisson's ratio".to_owned()];
        if !timed {
            undetermined
                .push("without t_s a body that relaxes cannot be told: viscoelasticity was not tried".into());
        }
        let radius_m = match setup.indenter {
            Indenter::Sphere { radius_m } | Indenter::Cylinder { radius_m } if radius_known => Some(radius_m),
            _ => None,
        };
        let hint = plausible::press(&recording.runs, radius_m);
        let loaded = Loaded::new(recording, model, experiments, undetermined);
        Ok(CheckedRecording::from(loaded).with_hints(hint))
    }
}

/// The columns of a table of curves.
struct Curves<'t> {
    labels: &'t [String],
    depths: &'t [f64],
    forces: &'t [f64],
    times: Option<&'t [f64]>,
    segments: Option<Vec<f64>>,
    /// The condition column, if there is one: its name, and the value of each row as text.
    conditions: Option<(&'static str, Vec<String>)>,
}

/// Curves run by run, and the conditions to which their [`Run::kind`] points.
struct Runs {
    runs: Vec<Run>,
    conditions: Vec<String>,
}

impl<'t> Curves<'t> {
    fn of(table: &'t Table<'_>) -> Result<Self, ReadError> {
        let column = |name: &str, what: &str| table.numbers(name).ok_or_else(|| table.missing(name, what));
        Ok(Self {
            labels: table.labels("run", "the label of each row's run")?,
            depths: column("delta_m", "indentation in metres")?,
            forces: column("force_n", "force in newtons")?,
            times: table.numbers("t_s"),
            segments: segments(table)?,
            conditions: conditions(table)?,
        })
    }

    fn by_run(&self, table: &Table<'_>) -> Result<Runs, ReadError> {
        let mut conditions: Vec<String> = Vec::new();
        let mut runs = Vec::new();
        for (label, rows) in check_runs(table, self.labels, FEWEST_ROWS, self.times.map(|_| "t_s"))? {
            let condition = self.condition(table, &rows)?;
            let kind = conditions.iter().position(|c| *c == condition).unwrap_or_else(|| {
                conditions.push(condition);
                conditions.len() - 1
            });
            if conditions.len() > MOST_CONDITIONS {
                return Err(ReadError::TooFewRows {
                    file: table.file.clone(),
                    what: "the file".into(),
                    got: conditions.len(),
                    expected: format!("at most {MOST_CONDITIONS} conditions"),
                });
            }
            let pick = |column: &[f64]| rows.iter().map(|&r| column[r]).collect::<Vec<f64>>();
            let mut inputs = vec![pick(self.depths)];
            inputs.extend(self.times.map(pick));
            inputs.extend(self.segments.as_deref().map(pick));
            runs.push(Run { label, inputs, outputs: vec![pick(self.forces)], kind: kind as u32 });
        }
        Ok(Runs { runs, conditions })
    }

    /// The condition of a run's rows, which have to agree; empty where there is no condition column.
    fn condition(&self, table: &Table<'_>, rows: &[usize]) -> Result<String, ReadError> {
        let Some((column, keys)) = &self.conditions else { return Ok(String::new()) };
        let first = &keys[rows[0]];
        match rows.iter().find(|&&r| keys[r] != *first) {
            None => Ok(first.clone()),
            Some(&row) => Err(ReadError::Cell {
                file: table.file.clone(),
                row: table.lines[row],
                column: (*column).into(),
                got: quoted(&keys[row]),
                expected: format!("{}, as in the rest of its run", quoted(first)),
            }),
        }
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
