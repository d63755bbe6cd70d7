//! What the examples share: worlds put before the engine, many at a time, with a progress bar.

pub mod bars;
pub mod dough;
pub mod drops;
pub mod grains;
pub mod liquid;
pub mod plot;
pub mod rig;

use indicatif::{ParallelProgressIterator, ProgressStyle};
use missing_physics::data::{Recording, Run};
use missing_physics::diagnosis::Diagnosis;
use missing_physics::engine::{DiagnoseError, Options, diagnose};
use missing_physics::model::Quantity;
use missing_physics::observer::Silent;
use missing_physics_domains::trajectory::{Axes, Setup, TrajectoryModel};
use rayon::prelude::*;
use worlds::physics::flight::{FlightWorld, Measured};

/// Whether the example was called with `--small`.
pub fn small() -> bool {
    std::env::args().any(|a| a == "--small")
}

/// What follows an option on the command line.
pub fn argument(option: &str) -> Option<String> {
    std::env::args().skip_while(|a| a != option).nth(1)
}

/// The model of a flight of which nothing is known but gravity.
pub fn model(measured: Measured) -> TrajectoryModel {
    let axes = match measured {
        Measured::Height => Axes::Height,
        Measured::Position => Axes::Space,
        Measured::SpecificForce => Axes::Accelerometer,
    };
    TrajectoryModel::new(Setup {
        axes,
        mass_kg: None,
        diameter_m: None,
        gravity_m_s2: 9.80665,
        air_density_kg_m3: 1.2,
        spin: false,
    })
}

/// A drawn world as the engine sees it.
pub fn recording(world: &FlightWorld, seed: u64) -> Recording {
    let drawn = world.draw(seed);
    let unit = if world.measured == Measured::SpecificForce { "m/s^2" } else { "m" };
    Recording {
        channels: drawn.names.iter().map(|n| Quantity::new(*n, unit)).collect(),
        variables: vec![Quantity::new("t_s", "s")],
        runs: drawn
            .runs
            .into_iter()
            .map(|r| Run { label: r.label, inputs: vec![r.t_s], outputs: r.channels, kind: 0 })
            .collect(),
        noise_along: Some(0),
        calibration: vec![None; drawn.names.len()],
        resolution: vec![world.noise.digit; drawn.names.len()],
    }
}

/// Diagnoses `count` draws of a world, which may depend on the seed, in parallel; in order.
///
/// # Errors
/// The first [`DiagnoseError`].
pub fn diagnose_many(
    name: &str,
    world: &(dyn Fn(u64) -> FlightWorld + Sync),
    count: u64,
    first_seed: u64,
    replicates: usize,
) -> Result<Vec<Diagnosis>, DiagnoseError> {
    let model = model(world(first_seed).measured);
    let style = ProgressStyle::with_template("{msg:40} {bar:30} {pos}/{len} {eta}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = indicatif::ProgressBar::new(count).with_style(style).with_message(name.to_owned());
    (first_seed..first_seed + count)
        .into_par_iter()
        .progress_with(bar)
        .map(|seed| {
            let options = Options { seed, replicates, ..Options::default() };
            diagnose(&model, &recording(&world(seed), seed), &[], &options, &Silent)
        })
        .collect()
}

/// Diagnoses `count` recordings that are made from seeds as files, in parallel; in order, `None` where a recording is refused.
///
/// # Errors
/// What went wrong, where it was not the recording.
pub fn diagnose_files(
    files: &(dyn Fn(u64) -> Vec<(String, Vec<u8>)> + Sync),
    count: u64,
    first_seed: u64,
    replicates: usize,
) -> Result<Vec<Option<Diagnosis>>, String> {
    let one = |seed: u64| {
        let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
        for (name, contents) in files(seed) {
            std::fs::write(folder.path().join(name), contents).map_err(|e| e.to_string())?;
        }
        let Ok((_, loaded)) = missing_physics_domains::load(folder.path()) else { return Ok(None) };
        let options = Options { seed, replicates, ..Options::default() };
        match diagnose(&*loaded.model, &loaded.recording, &[], &options, &Silent) {
            Ok(diagnosis) => Ok(Some(diagnosis)),
            Err(DiagnoseError::TooFewRows { .. }) => Ok(None),
            Err(error) => Err(error.to_string()),
        }
    };
    (first_seed..first_seed + count).into_par_iter().map(one).collect()
}
