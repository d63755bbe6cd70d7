//! The domain `liquid-tilt`: a closed container of liquid, tilted slowly and felt at the wrist.

mod experiments;
mod figure;
mod local;
mod model;
mod section;
mod setup;
mod spec;

use liquid_haptics::container::mesh::MeshContainer;
use liquid_haptics::wrench::Grasp;
use missing_physics::data::{Recording, Run};
use missing_physics::model::{Model, Quantity, Spec};

use crate::domain::{CheckedRecording, Domain, Loaded, Template};
use crate::plausible;
use crate::reading::{GRAVITY_M_S2, calibration, check_runs, number, resolution};
use crate::recording::{Column, Header, ReadError, Section, Table, quoted};
pub use model::LiquidTiltModel;
pub use setup::{Setup, Vessel};

const CHANNELS: [&str; 3] = ["fx_n", "fy_n", "tau_z_nm"];
const COLUMNS: [Column; 7] = [
    Column { name: "run", what: "label of the run", label: true },
    number("theta_rad", "tilt in radians, clockwise from upright"),
    number("fx_n", "sideways force in newtons"),
    number("fy_n", "upward force in newtons"),
    number("tau_z_nm", "torque in newton metres"),
    number("volume_m3", "measured volume in cubic metres"),
    number("t_s", "time in seconds"),
];
/// A sweep with fewer poses says nothing of two unknowns.
const FEWEST_ROWS: usize = 3;

/// The domain.
#[derive(Debug, Clone, Copy)]
pub struct LiquidTilt;

impl Domain for LiquidTilt {
    fn id(&self) -> &'static str {
        "liquid-tilt"
    }

    fn summary(&self) -> &'static str {
        "a closed container of liquid, tilted slowly and felt at the wrist"
    }

    fn reads(&self) -> &'static [(&'static str, &'static str)] {
        &[
            ("run, theta_rad, fx_n, fy_n, tau_z_nm", "one settled pose a row"),
            ("volume_m3", "optional: the amount that was measured in, one value a run, taken as exact"),
            ("t_s", "optional, for the record"),
            ("[rig] container", "{ shape = \"cylinder\", radius_m, length_m }, its outer surface"),
            (
                "",
                "or { shape = \"mesh\", file = \"x.stl\" } (STL or OBJ, m, z along the axis, bottom at z = 0)",
            ),
            (
                "[rig] container_mass_kg, gripper_mass_kg, grasp_height_m",
                "the load besides the liquid, and where it is held",
            ),
            ("[rig] density_kg_m3", "optional: the liquid is known"),
            ("[rig] gravity_m_s2", "optional, 9.80665"),
            ("[noise] a channel's name", "optional: one sigma from a calibration"),
        ]
    }

    fn columns(&self) -> &'static [Column<'static>] {
        &COLUMNS
    }

    fn spec(&self) -> Spec {
        let grasp = Grasp {
            container_mass_kg: 0.1,
            gripper_mass_kg: 0.5,
            grasp_height_m: 0.1,
            shell_center_m: 0.1,
            gravity_m_s2: GRAVITY_M_S2,
        };
        let setup = Setup {
            vessel: Vessel::Cylinder { radius_m: 0.05, length_m: 0.2 },
            grasp,
            density_kg_m3: None,
            volumes_known: false,
        };
        LiquidTiltModel::new(setup, 100).spec().clone()
    }

    fn template(&self) -> Template {
        Template { header: include_str!("template.toml"), data: ("data.csv", include_str!("template.csv")) }
    }

    fn read(&self, header: &Header) -> Result<CheckedRecording, ReadError> {
        let rig = header.section("rig")?;
        let vessel = vessel(header, &rig)?;
        let grasp = Grasp {
            container_mass_kg: rig.required("container_mass_kg", 0.0, 1e6)?,
            gripper_mass_kg: rig.required("gripper_mass_kg", 0.0, 1e6)?,
            grasp_height_m: rig.required("grasp_height_m", -1e3, 1e3)?,
            shell_center_m: 0.5 * vessel.length_m(),
            gravity_m_s2: rig.number("gravity_m_s2", 1e-3, 1e3)?.unwrap_or(GRAVITY_M_S2),
        };
        let density_kg_m3 = rig.number("density_kg_m3", 1.0, 1e5)?;
        let table = header.table("data", &COLUMNS)?;
        let labels = table.labels("run", "the label of each row's run")?;
        let column = |name: &str, what: &str| table.numbers(name).ok_or_else(|| table.missing(name, what));
        let theta = column("theta_rad", "tilt in radians")?;
        let channels = [
            column("fx_n", "sideways force in newtons")?,
            column("fy_n", "upward force in newtons")?,
            column("tau_z_nm", "torque in newton metres")?,
        ];
        let volumes = table.numbers("volume_m3");
        let calibration = calibration(header, &CHANNELS)?;
        let by_run = check_runs(&table, labels, FEWEST_ROWS, table.numbers("t_s").map(|_| "t_s"))?;
        let capacity = vessel.capacity_m3();
        let mut runs = Vec::new();
        for (label, rows) in by_run {
            check_run(&table, &rows, theta, volumes, capacity)?;
            let pick = |column: &[f64]| rows.iter().map(|&r| column[r]).collect::<Vec<f64>>();
            let mut inputs = vec![pick(theta), rows.iter().map(|&r| r as f64).collect()];
            inputs.extend(volumes.map(pick));
            runs.push(Run { label, inputs, outputs: channels.iter().map(|c| pick(c)).collect(), kind: 0 });
        }
        let mut variables = vec![Quantity::new("theta_rad", "rad"), Quantity::new("row", "")];
        if volumes.is_some() {
            variables.push(Quantity::new("volume_m3", "m^3"));
        }
        let recording = Recording {
            channels: CHANNELS.iter().zip(["N", "N", "N m"]).map(|(n, u)| Quantity::new(*n, u)).collect(),
            variables,
            runs,
            noise_along: None,
            calibration,
            resolution: channels.iter().map(|c| resolution(c)).collect(),
        };
        let setup = Setup { vessel, grasp, density_kg_m3, volumes_known: volumes.is_some() };
        let reach_m = setup.vessel.length_m().max(setup.grasp.grasp_height_m.abs());
        let rig_kg = setup.grasp.container_mass_kg + setup.grasp.gripper_mass_kg;
        let hint = plausible::weigh(&recording.runs, rig_kg, reach_m, setup.grasp.gravity_m_s2);
        let model = LiquidTiltModel::new(setup, labels.len());
        let experiments = experiments::experiments(&model, &recording);
        let mut undetermined = Vec::new();
        if density_kg_m3.is_none() && volumes.is_none() {
            undetermined.push(
                "mass and volume are free in each run: a known liquid (density_kg_m3) or measured volumes (volume_m3) would tell more mechanisms apart".into(),
            );
        }
        let shown = std::sync::Arc::new(recording.clone());
        let loaded = Loaded::drawn(recording, model, experiments, undetermined, move |model, d| {
            figure::figures(model, &shown, d)
        });
        Ok(CheckedRecording::from(loaded).with_hints(hint))
    }
}

fn vessel(header: &Header, rig: &Section<'_>) -> Result<Vessel, ReadError> {
    const SHAPES: &str = "\"cylinder\" or \"mesh\"";
    let container = rig.section("container")?;
    match container.text("shape", SHAPES)? {
        "cylinder" => {
            let radius_m = container.required("radius_m", 1e-4, 1e3)?;
            let length_m = container.required("length_m", 1e-4, 1e3)?;
            Ok(Vessel::Cylinder { radius_m, length_m })
        }
        "mesh" => {
            let name = container.text("file", "the name of an STL or OBJ file")?;
            let bytes = header.named_file(&header.file, "rig.container.file", name)?.bytes;
            let place = nalgebra::Isometry3::identity();
            let mesh = if name.to_ascii_lowercase().ends_with(".obj") {
                MeshContainer::from_obj(&bytes, 1.0, &place)
            } else {
                MeshContainer::from_stl(&bytes, 1.0, &place)
            };
            let mesh =
                mesh.map_err(|e| container.unfit("file", quoted(name), format!("a closed mesh: {e}")))?;
            let (low, high) = mesh.bounds();
            if low.z.abs() > 1e-3 * (high.z - low.z) {
                let expected = format!("a mesh with its bottom at z = 0, not {} m", low.z);
                return Err(container.unfit("file", quoted(name), expected));
            }
            Ok(Vessel::Mesh(std::sync::Arc::new(mesh)))
        }
        shape => Err(container.unfit("shape", quoted(shape), SHAPES)),
    }
}

fn check_run(
    table: &Table,
    rows: &[usize],
    theta: &[f64],
    volumes: Option<&[f64]>,
    capacity: f64,
) -> Result<(), ReadError> {
    for &row in rows {
        if !(-1e-9..=std::f64::consts::PI + 1e-3).contains(&theta[row]) {
            return Err(table.cell(row, "theta_rad", theta[row], "0 to pi"));
        }
        let Some(volumes) = volumes else { continue };
        if !(0.0..=capacity).contains(&volumes[row]) {
            let expected = format!("0 to {capacity:.6e}, what the container holds");
            return Err(table.cell(row, "volume_m3", volumes[row], expected));
        }
        if volumes[row] != volumes[rows[0]] {
            let expected = format!("{}, as in the rest of its run", volumes[rows[0]]);
            return Err(table.cell(row, "volume_m3", volumes[row], expected));
        }
    }
    Ok(())
}
