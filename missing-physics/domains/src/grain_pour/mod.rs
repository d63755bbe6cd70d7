//! The domain `grain-pour`: heaps and rings of grains, seen from above.
//!
//! Every picture becomes two dozen statistics. Their means and their spread from pour to pour are learned from a campaign of
//! simulated pours, each seen by the recording's own camera; the engine gets the statistics independent and of variance one.

mod cache;
mod campaign;
#[cfg(test)]
mod codes;
mod discrepancy;
mod excess;
mod learning;
mod model;
mod read;
mod spec;

use granular_infer::statistics::{COUNT, STATISTICS};
use missing_physics::data::{Recording, Run};
use missing_physics::model::{Experiment, Quantity, Spec};

use self::campaign::Campaign;
use self::model::PourModel;
use super::reading::number;
use crate::recording::{Column, Header, ReadError};
use crate::{Domain, Loaded, Template};

const COLUMNS: [Column; 3] = [
    Column { name: "run", what: "label of the run", label: true },
    number("funnel_height_m", "height of the funnel's outlet in metres"),
    Column { name: "depth_image", what: "name of a 16-bit PNG file", label: true },
];

/// Pours of a proposed experiment.
const REPEATS: usize = 3;

/// The domain.
#[derive(Debug, Clone, Copy)]
pub struct GrainPour;

impl Domain for GrainPour {
    fn id(&self) -> &'static str {
        "grain-pour"
    }

    fn summary(&self) -> &'static str {
        "grains poured from a funnel, seen from above by a depth camera"
    }

    fn reads(&self) -> &'static [(&'static str, &'static str)] {
        &[
            ("run, funnel_height_m, depth_image", "one row a pour; the picture is a 16-bit greyscale PNG"),
            (
                "[camera] fx_px, fy_px, cx_px, cy_px, height_m, depth_unit_m",
                "it looks straight down; 0 counts: missing",
            ),
            ("[rig] grain_diameter_m, grain_mass_kg, grain_count", "means, and how many are poured"),
            ("[rig] funnel", "{ outlet_radius_m, cone_half_angle_rad, tube_radius_m }"),
            ("[noise] depth_m", "optional, for the record: the ground shows the noise of a pixel"),
        ]
    }

    fn spec(&self) -> Spec {
        model::any_spec()
    }

    fn template(&self) -> Template {
        Template { header: include_str!("template.toml"), data: ("runs.csv", include_str!("template.csv")) }
    }

    fn predicts(&self) -> bool {
        false
    }

    fn load(&self, header: &Header) -> Result<Loaded, ReadError> {
        let read = read::read(header)?;
        let heights: Vec<f64> = read.pictures.iter().map(|p| p.height_m).collect();
        let range = [
            heights.iter().copied().fold(f64::INFINITY, f64::min),
            heights.iter().copied().fold(0.0, f64::max),
        ];
        let campaign = Campaign::of(&read.rig, range)?;
        let mut model = PourModel::new(&campaign, &read).map_err(|e| ReadError::Open {
            file: header.file.clone(),
            why: format!("nothing can be learned for this camera: {e}"),
        })?;
        let runs: Vec<Run> = read
            .pictures
            .iter()
            .map(|picture| run(&picture.label, picture.height_m, &model.shown(picture, &read)))
            .collect();
        let experiments = [0.6 * range[0], 1.15 * range[1]]
            .map(|height| {
                height.clamp(
                    1.02 * campaign.scale.length * campaign.ranges.height_m[0],
                    0.98 * campaign.scale.length * campaign.ranges.height_m[1],
                )
            })
            .map(|height| propose(&mut model, height));
        let recording = Recording {
            channels: STATISTICS.iter().map(|(name, _)| Quantity::new(name, "sigma")).collect(),
            variables: vec![Quantity::new("funnel_height_m", "m")],
            runs,
            noise_along: None,
            calibration: vec![Some(1.0); COUNT],
            resolution: vec![0.0; COUNT],
        };
        let mut undetermined = vec![
            "each statistic is shown less what those before it say of it, in standard deviations from pour to pour".into(),
            "grains that are not spheres are rods in the model: cubes and flakes are told as rods of some length, or unexplained".into(),
        ];
        undetermined.extend(excess::words(&read, &model.baseline(&read, &campaign)));
        Ok(Loaded {
            recording,
            model: Box::new(model),
            experiments: experiments.into(),
            undetermined,
            additions: serde_json::Map::new(),
        })
    }
}

/// A run of one row.
fn run(label: &str, height_m: f64, values: &[f64]) -> Run {
    Run {
        label: label.into(),
        inputs: vec![vec![height_m]],
        outputs: values.iter().map(|v| vec![*v]).collect(),
        kind: 0,
    }
}

/// Some pours from another height.
fn propose(model: &mut PourModel, height_m: f64) -> Experiment {
    let runs: Vec<Run> = (0..REPEATS)
        .map(|k| {
            let label = format!("next {height_m} {k}");
            model.propose(&label, height_m);
            run(&label, height_m, &[0.0; COUNT])
        })
        .collect();
    Experiment {
        action: vec![("funnel_height_m".into(), height_m)],
        words: format!("pour from {height_m:.3} m, {REPEATS} times"),
        nuisance: vec![Vec::new(); runs.len()],
        runs,
    }
}
