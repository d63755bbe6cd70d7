//! The domain `grain-pour`: heaps and rings of grains, seen from above.
//!
//! Every picture becomes two dozen statistics. Their means and their spread from pour to pour are learned from a campaign of
//! simulated pours, each seen by the recording's own camera; the engine gets the statistics independent and of variance one.

#[cfg(test)]
mod another_simulator;
mod cache;
mod campaign;
mod discrepancy;
mod excess;
mod figure;
mod law;
mod learning;
mod model;
mod read;
mod spec;
mod statistic;

use granular_infer::statistics::{COUNT, STATISTICS};
use missing_physics::data::{Recording, Run};
use missing_physics::model::{Experiment, Quantity, Spec};
use missing_physics::observer::Observer;

use self::campaign::Campaign;
use self::model::PourModel;
use self::read::Read;
use crate::domain::{CheckedRecording, Contents, Domain, Loaded, RunContents, Template};
use crate::recording::{Column, Header, ReadError};

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

    fn columns(&self) -> &'static [Column<'static>] {
        &read::COLUMNS
    }

    fn spec(&self) -> Spec {
        model::any_spec()
    }

    fn template(&self) -> Template {
        Template { header: include_str!("template.toml"), data: ("runs.csv", include_str!("template.csv")) }
    }

    fn template_files(&self) -> &'static [(&'static str, &'static [u8])] {
        &[
            ("pour-1.png", include_bytes!("template/pour-1.png")),
            ("pour-2.png", include_bytes!("template/pour-2.png")),
            ("pour-3.png", include_bytes!("template/pour-3.png")),
        ]
    }

    fn predicts(&self) -> bool {
        false
    }

    fn read(&self, header: &Header) -> Result<CheckedRecording, ReadError> {
        let read = read::read(header)?;
        let file = header.file.clone();
        Ok(CheckedRecording::long(contents(&read), move |observer| prepare(read, file, observer)))
    }
}

/// What a recording holds.
fn contents(read: &Read) -> Contents {
    Contents {
        channels: channels(),
        calibration: vec![Some(1.0); COUNT],
        variable: funnel_height(),
        runs: read.pictures.iter().map(|p| RunContents::new(&p.label, &[p.height_m])).collect(),
        spec: model::any_spec(),
    }
}

fn channels() -> Vec<Quantity> {
    STATISTICS.iter().map(|(name, _)| Quantity::new(name, "sigma")).collect()
}

fn funnel_height() -> Quantity {
    Quantity::new("funnel_height_m", "m")
}

/// Learns what pictures of such pours show: from the pours that come with the tool or, for another rig, from new ones.
fn prepare(read: Read, file: String, observer: &dyn Observer) -> Result<Loaded, ReadError> {
    let range = read.heights_m();
    let campaign = Campaign::of(&read.rig, range, observer)?;
    let mut model = PourModel::new(&campaign, &read, observer).map_err(|e| ReadError::Unfit {
        file,
        why: format!("nothing can be learned for this camera: {e}"),
    })?;
    let runs = read.pictures.iter().map(|p| run(&p.label, p.height_m, &model.whitened(p, &read))).collect();
    let ([lowest, highest], length) = (campaign.ranges.height_m, campaign.scale.length);
    let experiments = [0.6 * range[0], 1.15 * range[1]]
        .map(|height| height.clamp(1.02 * length * lowest, 0.98 * length * highest))
        .map(|height| propose(&mut model, height));
    let recording = Recording {
        channels: channels(),
        variables: vec![funnel_height()],
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
    Ok(Loaded::drawn(recording, model, experiments.into(), undetermined, move |model, d| {
        figure::figures(&read, model, d)
    }))
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
