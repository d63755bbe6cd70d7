//! The domain `slosh`: the decay of a liquid's wave after a fast rotation, felt at the wrist.

mod envelope;
mod experiments;
mod local;
mod model;
mod reading;
mod setup;
mod spec;
mod start;

use missing_physics::data::{Recording, Run};
use missing_physics::model::{Model, Quantity, Spec};

use crate::domain::{CheckedRecording, Domain, Loaded, Template};
use crate::plausible;
use crate::reading::{GRAVITY_M_S2, calibration, check_runs, number, resolution};
use crate::recording::{Column, Header, ReadError, Section};
pub use model::{FILLS, SloshModel};
pub use setup::{Channel, Setup};

const COLUMNS: [Column; 4] = [
    Column { name: "run", what: "label of the run", label: true },
    number("t_s", "time in seconds since the motion ended"),
    number("tau_z_nm", "torque in newton metres"),
    number("fx_n", "sideways force in newtons"),
];
/// A run with fewer rows says nothing of a wave.
const FEWEST_ROWS: usize = 8;

/// The domain.
#[derive(Debug, Clone, Copy)]
pub struct Slosh;

impl Domain for Slosh {
    fn id(&self) -> &'static str {
        "slosh"
    }

    fn summary(&self) -> &'static str {
        "the decay of a liquid's wave in an upright cylinder, felt at the wrist"
    }

    fn reads(&self) -> &'static [(&'static str, &'static str)] {
        &[
            ("run, t_s, tau_z_nm", "torque; t = 0 when the motion ends"),
            ("run, t_s, fx_n", "the sideways force in its place"),
            ("[rig] container", "{ shape = \"cylinder\", radius_m, length_m (optional) }"),
            ("[rig] liquid_mass_kg, volume_m3", "of the liquid: its density and its depth"),
            ("[rig] grasp_height_m, temperature_k", "optional, for the record"),
            ("[noise] the channel's name", "optional: one sigma from a calibration"),
        ]
    }

    fn columns(&self) -> &'static [Column<'static>] {
        &COLUMNS
    }

    fn spec(&self) -> Spec {
        let setup = Setup {
            radius_m: 0.04,
            length_m: None,
            volume_m3: 3e-4,
            density_kg_m3: 1000.0,
            gravity_m_s2: GRAVITY_M_S2,
            channel: Channel::Torque,
        };
        SloshModel::new(setup, &[]).map(|m| m.spec().clone()).unwrap_or_default()
    }

    fn template(&self) -> Template {
        Template { header: include_str!("template.toml"), data: ("data.csv", include_str!("template.csv")) }
    }

    fn read(&self, header: &Header) -> Result<CheckedRecording, ReadError> {
        let (mut setup, rig) = setup(header)?;
        let table = header.table("data", &COLUMNS)?;
        let labels = table.labels("run", "the label of each row's run")?;
        let times = table.numbers("t_s").ok_or_else(|| table.missing("t_s", "time in seconds"))?;
        let (channel, values) = match (table.numbers("tau_z_nm"), table.numbers("fx_n")) {
            (Some(torque), None) => (Channel::Torque, torque),
            (None, Some(force)) => (Channel::Force, force),
            (None, None) => return Err(table.missing("tau_z_nm", "the torque (or fx_n, the sideways force)")),
            (Some(_), Some(_)) => {
                return Err(ReadError::UnknownColumn {
                    file: table.file.clone(),
                    column: "fx_n".into(),
                    expected: "tau_z_nm or fx_n, not both".into(),
                });
            }
        };
        setup.channel = channel;
        let calibration = calibration(header, &[channel.name()])?;
        let mut runs = Vec::new();
        for (label, rows) in check_runs(&table, labels, FEWEST_ROWS, Some("t_s"))? {
            if times[rows[0]] < 0.0 {
                return Err(table.cell(
                    rows[0],
                    "t_s",
                    times[rows[0]],
                    "0 or more: t = 0 when the motion ends",
                ));
            }
            let pick = |column: &[f64]| rows.iter().map(|&r| column[r]).collect::<Vec<f64>>();
            runs.push(Run { label, inputs: vec![pick(times)], outputs: vec![pick(values)], kind: 0 });
        }
        let recording = Recording {
            channels: vec![Quantity::new(channel.name(), channel.unit())],
            variables: vec![Quantity::new("t_s", "s")],
            runs,
            noise_along: Some(0),
            calibration,
            resolution: vec![resolution(values)],
        };
        let model = SloshModel::new(setup, &recording.runs)
            .map_err(|e| rig.unfit("volume_m3", format!("{}", setup.volume_m3), e.to_string()))?;
        let experiments = experiments::experiments(&model, &recording);
        let undetermined = vec![
            "the amplitude of the wave and the lever to the sensor are one number: neither is known alone"
                .into(),
        ];
        let expected = self::setup::cylinder(&setup, 1.0).ok().map(|c| c.angular_frequency_rad_s(0, 0.0));
        let hint = expected.and_then(|expected| plausible::swing(&recording.runs, expected));
        let loaded = Loaded::new(recording, model, experiments, undetermined);
        Ok(CheckedRecording::from(loaded).with_hints(hint))
    }
}

fn setup(header: &Header) -> Result<(Setup, Section<'_>), ReadError> {
    let rig = header.section("rig")?;
    let container = rig.section("container")?;
    let shape = container.text("shape", "\"cylinder\"")?;
    if shape != "cylinder" {
        return Err(container.unfit(
            "shape",
            crate::recording::quoted(shape),
            "\"cylinder\": the modes of other shapes are not in this domain",
        ));
    }
    let radius_m = container.required("radius_m", 1e-4, 1e3)?;
    let length_m = container.number("length_m", 1e-4, 1e3)?;
    let mass_kg = rig.required("liquid_mass_kg", 1e-9, 1e9)?;
    let volume_m3 = rig.required("volume_m3", 1e-12, 1e9)?;
    rig.number("grasp_height_m", -1e3, 1e3)?;
    rig.number("temperature_k", 1.0, 1e4)?;
    let capacity = std::f64::consts::PI * radius_m * radius_m * length_m.unwrap_or(f64::INFINITY);
    if volume_m3 > capacity * (1.0 + 1e-6) {
        let expected = format!("at most {capacity:.4e}, what the container holds");
        return Err(rig.unfit("volume_m3", format!("{volume_m3}"), expected));
    }
    let density_kg_m3 = mass_kg / volume_m3;
    if !(10.0..=3e4).contains(&density_kg_m3) {
        let expected = format!("a mass of 10 to 30000 kg/m^3 for volume_m3 = {volume_m3}");
        return Err(rig.unfit("liquid_mass_kg", format!("{mass_kg}"), expected));
    }
    let setup = Setup {
        radius_m,
        length_m,
        volume_m3,
        density_kg_m3,
        gravity_m_s2: GRAVITY_M_S2,
        channel: Channel::Torque,
    };
    Ok((setup, rig))
}
