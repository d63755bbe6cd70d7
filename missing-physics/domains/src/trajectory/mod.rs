//! The domain `trajectory`: an object in flight, filmed, or with an accelerometer on board.

mod experiments;
mod local;
mod model;
mod setup;
mod spec;

use missing_physics::data::{Recording, Run};
use missing_physics::model::{Quantity, Spec};

use crate::domain::{CheckedRecording, Domain, Loaded, Template};
use crate::plausible;
use crate::reading::{GRAVITY_M_S2, calibration, check_runs, number, resolution, sensor_steps};
use crate::recording::{Column, Header, ReadError, Table};
pub use model::TrajectoryModel;
use setup::PLACE;
pub use setup::{Axes, ROD, Setup};

const COLUMNS: [Column; 9] = [
    Column { name: "run", what: "label of the run", label: true },
    number("t_s", "time in seconds"),
    number("x_m", "position in metres"),
    number("y_m", "position in metres"),
    number("z_m", "height in metres"),
    number("accel_z_m_s2", "specific force in metres per second squared"),
    number("spin_x_rad_s", "spin in radians per second"),
    number("spin_y_rad_s", "spin in radians per second"),
    number("spin_z_rad_s", "spin in radians per second"),
];
const SPIN: [&str; 3] = ["spin_x_rad_s", "spin_y_rad_s", "spin_z_rad_s"];
/// A run with fewer rows says nothing beyond its own start.
const FEWEST_ROWS: usize = 4;

/// The domain.
#[derive(Debug, Clone, Copy)]
pub struct Trajectory;

impl Domain for Trajectory {
    fn id(&self) -> &'static str {
        "trajectory"
    }

    fn summary(&self) -> &'static str {
        "an object in flight, seen by a camera or felt by an accelerometer on board"
    }

    fn reads(&self) -> &'static [(&'static str, &'static str)] {
        &[
            ("run, t_s, z_m", "height alone"),
            ("run, t_s, x_m, z_m", "one camera's view of a flight in the plane of its picture, z up"),
            ("run, t_s, x_m, y_m, z_m", "all coordinates, z up"),
            ("run, t_s, accel_z_m_s2", "specific force on board; its offset is fitted in each run"),
            (
                "spin_x_rad_s, spin_y_rad_s, spin_z_rad_s",
                "optional, with all coordinates: known, constant in a run",
            ),
            ("[rig] mass_kg, diameter_m", "optional: with both, drag is a drag coefficient"),
            ("[rig] gravity_m_s2", "optional, 9.80665"),
            ("[rig] air_density_kg_m3", "optional, 1.2"),
            ("[noise] a channel's name", "optional: one sigma from a calibration"),
        ]
    }

    fn columns(&self) -> &'static [Column<'static>] {
        &COLUMNS
    }

    fn spec(&self) -> Spec {
        let setup = Setup {
            axes: Axes::Space,
            mass_kg: Some(1.0),
            diameter_m: Some(1.0),
            gravity_m_s2: GRAVITY_M_S2,
            air_density_kg_m3: 1.2,
            spin: false,
        };
        missing_physics::model::Model::spec(&TrajectoryModel::new(setup)).clone()
    }

    fn template(&self) -> Template {
        Template { header: include_str!("template.toml"), data: ("data.csv", include_str!("template.csv")) }
    }

    fn read(&self, header: &Header) -> Result<CheckedRecording, ReadError> {
        let rig = header.section("rig")?;
        let mass_kg = rig.number("mass_kg", 1e-9, 1e6)?;
        let diameter_m = rig.number("diameter_m", 1e-6, 1e3)?;
        let gravity_m_s2 = rig.number("gravity_m_s2", 0.0, 100.0)?.unwrap_or(GRAVITY_M_S2);
        let air_density_kg_m3 = rig.number("air_density_kg_m3", 0.0, 2e3)?.unwrap_or(1.2);
        let table = header.table("data", &COLUMNS)?;
        let labels = table.labels("run", "the label of each row's run")?;
        let times = table.numbers("t_s").ok_or_else(|| table.missing("t_s", "time in seconds"))?;
        let axes = axes(&table)?;
        let channel_names = axes.channels();
        let spins: Vec<&[f64]> = SPIN.iter().filter_map(|n| table.numbers(n)).collect();
        check_spin(&table, axes, spins.len())?;
        let calibration = calibration(header, channel_names)?;
        let columns: Vec<&[f64]> = channel_names.iter().filter_map(|n| table.numbers(n)).collect();
        let by_run = check_runs(&table, labels, FEWEST_ROWS, Some("t_s"))?;
        let mut runs = Vec::new();
        for (label, rows) in by_run {
            check_spin_is_constant(&table, &rows, &spins)?;
            let pick = |column: &[f64]| rows.iter().map(|&r| column[r]).collect::<Vec<f64>>();
            let mut inputs = vec![pick(times)];
            inputs.extend(spins.iter().map(|s| pick(s)));
            runs.push(Run { label, inputs, outputs: columns.iter().map(|c| pick(c)).collect(), kind: 0 });
        }
        let spin = spins.len() == 3;
        let model =
            TrajectoryModel::new(Setup { axes, mass_kg, diameter_m, gravity_m_s2, air_density_kg_m3, spin });
        let per_run = axes.starts();
        let (values, needed) = (labels.len() * columns.len(), runs.len() * per_run + columns.len() + 2);
        if values < needed {
            let rows = needed.div_ceil(columns.len().max(1));
            let expected = format!("at least {rows} for {} runs with {per_run} unknowns each", runs.len());
            let file = table.file.clone();
            return Err(ReadError::TooFewRows { file, what: "the file".into(), got: labels.len(), expected });
        }
        let unit = if axes == Axes::Accelerometer { "m/s^2" } else { "m" };
        let mut variables = vec![Quantity::new("t_s", "s")];
        variables.extend(SPIN.iter().take(spins.len()).map(|n| Quantity::new(*n, "rad/s")));
        let resolution = sensor_steps(&runs, columns.iter().map(|c| resolution(c)));
        let recording = Recording {
            channels: channel_names.iter().map(|n| Quantity::new(*n, unit)).collect(),
            variables,
            runs,
            noise_along: Some(0),
            calibration,
            resolution,
        };
        let experiments = experiments::experiments(&model, &recording);
        let hint = match axes {
            Axes::Accelerometer => None,
            _ => plausible::fall(&recording.runs, recording.channels.len() - 1, gravity_m_s2),
        };
        let loaded = Loaded::new(recording, model, experiments, undetermined(axes));
        Ok(CheckedRecording::from(loaded).with_hints(hint))
    }
}

fn axes(table: &Table) -> Result<Axes, ReadError> {
    let has = |n: &str| table.numbers(n).is_some();
    if has("accel_z_m_s2") {
        return match PLACE.into_iter().find(|n| has(n)) {
            None => Ok(Axes::Accelerometer),
            Some(column) => Err(ReadError::UnknownColumn {
                file: table.file.clone(),
                column: column.into(),
                expected: "positions or accel_z_m_s2, not both".into(),
            }),
        };
    }
    match (has("x_m"), has("y_m"), has("z_m")) {
        (false, false, true) => Ok(Axes::Height),
        (true, false, true) => Ok(Axes::Plane),
        (true, true, true) => Ok(Axes::Space),
        (_, _, false) => Err(table.missing("z_m", "height in metres (or accel_z_m_s2)")),
        (false, true, true) => Err(table.missing("x_m", "z_m alone, x_m and z_m, or x_m, y_m and z_m")),
    }
}

fn check_spin(table: &Table, axes: Axes, spins: usize) -> Result<(), ReadError> {
    if spins == 0 || (spins == 3 && axes == Axes::Space) {
        return Ok(());
    }
    let absent = SPIN.into_iter().find(|n| table.numbers(n).is_none());
    match absent {
        Some(column) => Err(table.missing(column, "all three components of the spin, or none")),
        None => {
            let absent = ["x_m", "y_m"].into_iter().find(|n| table.numbers(n).is_none()).unwrap_or("y_m");
            Err(table.missing(absent, "all coordinates where the spin is given"))
        }
    }
}

fn check_spin_is_constant(table: &Table, rows: &[usize], spins: &[&[f64]]) -> Result<(), ReadError> {
    for pair in rows.windows(2) {
        for (spin, name) in spins.iter().zip(SPIN) {
            if spin[pair[1]] != spin[pair[0]] {
                let expected = format!("{}, as in the rest of its run", spin[pair[0]]);
                return Err(table.cell(pair[1], name, spin[pair[1]], expected));
            }
        }
    }
    Ok(())
}

fn undetermined(axes: Axes) -> Vec<String> {
    match axes {
        Axes::Space => Vec::new(),
        Axes::Height => {
            vec!["magnus-lift, wind and camera-tilt need x and y as well: they were not tried".into()]
        }
        Axes::Plane => vec![
            "one camera does not see what comes towards it: wind and spin across the picture were not tried"
                .into(),
        ],
        Axes::Accelerometer => vec![
            "buoyancy is one with the sensor's offset: it was not tried".into(),
            "a reading of one axis shows no lift and no wind, and there is no camera: they were not tried"
                .into(),
        ],
    }
}
