//! The domain `dough-roll`: a dough that is rolled, one row a roll.
//!
//! Each dough is followed through its rolls by a filter, and what the engine sees are its innovations. What was not learned of
//! the dynamics ties them over all doughs; they are taken apart by its covariance first.

mod experiments;
mod forces;
mod model;
mod read;
mod spec;

use dough_mbrl::dynamics::Dynamics;
use missing_physics::data::Recording;
use missing_physics::model::{Quantity, Spec};

use self::model::{CHANNELS, DoughModel};
use super::reading::number;
use crate::recording::{Column, Header, ReadError};
use crate::{Domain, Loaded, Template};

const COLUMNS: [Column; 11] = [
    Column { name: "run", what: "label of the run", label: true },
    number("step", "number of the roll in its run"),
    number("length_m", "length in metres"),
    number("width_m", "width in metres"),
    number("height_m", "height in metres"),
    number("throw_m", "throw of the band in metres"),
    number("depth_m", "depth of the roll in metres"),
    number("next_length_m", "length after the roll in metres"),
    number("next_width_m", "width after the roll in metres"),
    number("next_height_m", "height after the roll in metres"),
    number("t_s", "time in seconds"),
];

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

    fn spec(&self) -> Spec {
        spec::build(Some(1000.0), 3.0, 10.0).0
    }

    fn template(&self) -> Template {
        Template { header: include_str!("template.toml"), data: ("data.csv", include_str!("template.csv")) }
    }

    fn predicts(&self) -> bool {
        false
    }

    fn load(&self, header: &Header) -> Result<Loaded, ReadError> {
        let read = read::read(header)?;
        let dynamics = Dynamics::learn(&read.training).map_err(|e| ReadError::TooFewRows {
            file: read.blame.file.clone(),
            what: "the training".into(),
            got: read.training.iter().map(Vec::len).sum(),
            expected: format!("rolls that determine the dynamics: {e}"),
        })?;
        let steps: Vec<_> = read.runs.iter().flat_map(|(_, steps)| steps.iter().copied()).collect();
        let mut model = DoughModel::new(read.band, dynamics, read.timed, &steps);
        let runs = model.add(&read.runs);
        let experiments = experiments::experiments(&mut model, &read.runs);
        let variable = |name: &str, unit: &str| Quantity::new(name, unit);
        let recording = Recording {
            channels: CHANNELS.iter().map(|name| Quantity::new(*name, "m")).collect(),
            // What dough and band are comes before the number of the roll and the time, with which a dough only grows.
            variables: vec![
                variable("length_m", "m"),
                variable("width_m", "m"),
                variable("height_m", "m"),
                variable("throw_m", "m"),
                variable("depth_m", "m"),
                variable("force_n", "N"),
                variable("step", ""),
                variable("t_s", "s"),
            ],
            runs,
            noise_along: None,
            calibration: vec![None; CHANNELS.len()],
            resolution: vec![0.0; CHANNELS.len()],
        };
        let mut undetermined = vec![
            "what the training rolls did not show (deeper rolls, longer doughs) counts as not known, not as misfit"
                .into(),
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
        Ok(Loaded {
            recording,
            model: Box::new(model),
            experiments,
            undetermined,
            additions: serde_json::Map::new(),
        })
    }
}
