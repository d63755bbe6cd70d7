//! What could be tilted next.

use std::f64::consts::PI;

use missing_physics::data::{Recording, Run};
use missing_physics::model::Experiment;

use super::model::LiquidTiltModel;

/// Ranges of proposed sweeps, in half turns.
const RANGES: [(f64, f64); 7] =
    [(0.0, 1.0), (0.0, 0.5), (0.5, 1.0), (0.0, 0.25), (0.25, 0.5), (0.5, 0.75), (0.75, 1.0)];
/// Poses of a proposed sweep.
const POSES: usize = 19;

/// A sweep with another fill, sweeps over a part of the range, and an empty container.
pub(super) fn experiments(model: &LiquidTiltModel, recording: &Recording) -> Vec<Experiment> {
    let setup = model.setup();
    let capacity = setup.vessel.capacity_m3();
    let density = setup.density_kg_m3.unwrap_or(1000.0);
    let last = recording.runs.iter().flat_map(|r| &r.inputs[1]).fold(0.0, |m: f64, r| m.max(*r));
    let sweep = |from: f64, to: f64, volume: f64| {
        let theta: Vec<f64> =
            (0..POSES).map(|i| from + (to - from) * i as f64 / (POSES - 1) as f64).collect();
        let row = (0..POSES).map(|i| last + 1.0 + i as f64).collect();
        let mut inputs = vec![theta, row];
        if setup.volumes_known {
            inputs.push(vec![volume; POSES]);
        }
        Run { label: "next".into(), inputs, outputs: vec![vec![0.0; POSES]; 3], kind: 0 }
    };
    let mut list = Vec::new();
    let mut add = |action: Vec<(&str, f64)>, words: String, run: Run, volume: f64| {
        list.push(Experiment {
            action: action.into_iter().map(|(name, value)| (name.to_owned(), value)).collect(),
            words,
            runs: vec![run],
            nuisance: vec![model.nuisance(density * volume, volume)],
        });
    };
    for share in [0.0, 0.1, 0.25, 0.5, 0.75, 0.95] {
        let volume = share * capacity;
        let bottle = if share == 0.0 {
            "the empty container".to_owned()
        } else {
            format!("it with {:.0} mL in it", volume * 1e6)
        };
        for (from, to) in RANGES.map(|(from, to)| (from * PI, to * PI)) {
            let range = if (from, to) == (0.0, PI) {
                "from upright to upside down".to_owned()
            } else {
                format!("from {:.0} to {:.0} degrees", from.to_degrees(), to.to_degrees())
            };
            let action = vec![("from_rad", from), ("theta_rad", to), ("volume_m3", volume)];
            add(action, format!("sweep {bottle} {range}"), sweep(from, to, volume), volume);
        }
    }
    list
}
