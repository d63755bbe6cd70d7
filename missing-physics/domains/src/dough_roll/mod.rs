//! The domain `dough-roll`: a dough that is rolled, one row a roll.
//!
//! Each dough is followed through its rolls by a filter, and what the engine sees are its innovations. What was not learned of
//! the dynamics ties them over all doughs; they are taken apart by its covariance first.

mod experiments;
mod forces;
mod least;
mod model;
mod read;
mod rolls;
mod spec;

use dough_mbrl::dynamics::Dynamics;
use missing_physics::data::Recording;
use missing_physics::model::{Quantity, Spec};

use self::model::DoughModel;
use self::read::Read;
use self::rolls::{CHANNELS, RunOfRolls, Step};
use crate::domain::{CheckedRecording, Contents, Domain, Loaded, RunContents, Template};
use crate::recording::{Column, Header, ReadError};

/// The domain.
#[derive(Debug, Clone, Copy)]
pub struct DoughRoll;

impl Domain for DoughRoll {
    fn id(&self) -> &'static str {
        "dough-roll"
    }

    fn summary(&self) -> &'static str {
        "a dough rolled by an elastic band, against dynamics learned from earlier rolls"
    }

    fn reads(&self) -> &'static [(&'static str, &'static str)] {
        &[
            ("run, step", "a run is one dough; step counts its rolls"),
            ("length_m, width_m, height_m", "before the roll"),
            ("throw_m, depth_m", "the band's throw, and how deep it was pressed"),
            ("next_length_m, next_width_m, next_height_m", "after the roll"),
            ("t_s", "optional: since the dough was made; without it there is no drying"),
            ("[rig] training", "optional: a CSV file of the same columns; else the first half of the runs"),
            ("[rig] band", "optional: { k0_n_m, k1_n_m2, throw0_m, k2_per_m }"),
            ("[rig] mass_kg, density_kg_m3", "optional, for the record"),
            ("[noise] the dimensions", "optional, for the record: the training rolls show the noise"),
        ]
    }

    fn columns(&self) -> &'static [Column<'static>] {
        &read::COLUMNS
    }

    fn spec(&self) -> Spec {
        spec::build(Some(1000.0), 3.0, 10.0).0
    }

    fn template(&self) -> Template {
        Template { header: include_str!("template.toml"), data: ("data.csv", include_str!("template.csv")) }
    }

    fn predicts(&self) -> bool {
        false
    }

    fn read(&self, header: &Header) -> Result<CheckedRecording, ReadError> {
        let read = read::read(header)?;
        let lengths = read.runs.iter().flat_map(|(_, steps)| steps.iter().map(|s| s.roll.state[0]));
        let hint = crate::plausible::dough(&lengths.collect::<Vec<f64>>());
        Ok(CheckedRecording::new(contents(&read), || prepare(read)).with_hints(hint))
    }
}

/// What a recording holds.
fn contents(read: &Read) -> Contents {
    let steps: Vec<Step> = read.runs.iter().flat_map(|(_, steps)| steps.iter().copied()).collect();
    let run = |(label, steps): &RunOfRolls| {
        RunContents::new(label, &steps.iter().map(|s| s.roll.state[0]).collect::<Vec<f64>>())
    };
    Contents {
        channels: channels(),
        calibration: vec![None; CHANNELS.len()],
        variable: Quantity::new("length_m", "m"),
        runs: read.runs.iter().map(run).collect(),
        spec: spec::for_rolls(&read.band, read.timed, &steps).0,
    }
}

fn channels() -> Vec<Quantity> {
    CHANNELS.iter().map(|name| Quantity::new(*name, "m")).collect()
}

/// Learns the dynamics from the training rolls, and follows the others by them.
fn prepare(read: Read) -> Result<Loaded, ReadError> {
    let dynamics = Dynamics::learn(&read.training).map_err(|e| ReadError::TooFewRows {
        file: read.training_file.clone(),
        what: "the training".into(),
        got: read.training.iter().map(Vec::len).sum(),
        expected: format!("rolls that determine the dynamics: {e}"),
    })?;
    let steps: Vec<Step> = read.runs.iter().flat_map(|(_, steps)| steps.iter().copied()).collect();
    let mut model = DoughModel::new(read.band, dynamics, read.timed, &steps);
    let runs = model.add(&read.runs);
    let experiments = experiments::experiments(&mut model, &read.runs);
    let recording = Recording {
        channels: channels(),
        // What dough and band are comes before the number of the roll and the time, with which a dough only grows.
        variables: [
            ("length_m", "m"),
            ("width_m", "m"),
            ("height_m", "m"),
            ("throw_m", "m"),
            ("depth_m", "m"),
            ("force_n", "N"),
            ("step", ""),
            ("t_s", "s"),
        ]
        .map(|(name, unit)| Quantity::new(name, unit))
        .into(),
        runs,
        noise_along: None,
        calibration: vec![None; CHANNELS.len()],
        resolution: vec![0.0; CHANNELS.len()],
    };
    Ok(Loaded::new(recording, model, experiments, undetermined(&read)))
}

fn undetermined(read: &Read) -> Vec<String> {
    let mut undetermined = vec![
        "what the training rolls did not show (deeper rolls, longer doughs) counts as not known, not as misfit".into(),
    ];
    if !read.timed {
        undetermined
            .push("without t_s, drying is not told from a band that tires or another stiffness".into());
    }
    if read.one_picture() {
        undetermined.push(
            "a state before a roll repeats the one after the roll before it: from one picture, noise is not told \
             from what rolls do, and p-values mislead; take a second picture before each roll"
                .into(),
        );
    }
    undetermined
}
