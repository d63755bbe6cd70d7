//! A mass, an angle or a grip that is another one in some poses: what it does to the wrench.

use missing_physics::data::Run;
use missing_physics::model::{LocalCauses, LocalUnknown, PredictError, Quantity};

use super::model::LiquidTiltModel;
use super::setup::{Off, Vessel};

/// Steps of the differences: of the liquid, rad, m.
const STEP: f64 = 1e-5;

impl LocalCauses for LiquidTiltModel {
    fn unknowns(&self) -> Vec<LocalUnknown> {
        let one = |name: &str, component: &str, unit: &str| {
            LocalUnknown::new(name, vec![Quantity::new(component, unit)])
        };
        let mut all = vec![
            one("another amount of liquid", "relative_mass", ""),
            one("another place of the grip", "grasp_m", "m"),
        ];
        // The surface in a mesh is found anew for every angle, which takes long.
        if matches!(self.setup().vessel, Vessel::Cylinder { .. }) {
            all.push(one("another angle", "angle_rad", "rad"));
        }
        all
    }

    fn response(
        &self,
        (unknown, _): (usize, usize),
        runs: &[Run],
        shared: &[f64],
        nuisance: &[Vec<f64>],
        amounts: &[Vec<f64>],
    ) -> Result<Vec<Vec<f64>>, PredictError> {
        let of_run = |((run, nuisance), amounts): ((&Run, &Vec<f64>), &Vec<f64>)| {
            let n = run.len();
            let mut out = vec![0.0; 3 * n];
            let failed = |reason| PredictError { run: run.label.clone(), reason };
            for (row, amount) in amounts.iter().enumerate().filter(|(_, amount)| **amount != 0.0) {
                let felt = |size| self.wrench(run, shared, nuisance, row, Off::of(unknown, size));
                let (high, low) = (felt(STEP).map_err(failed)?, felt(-STEP).map_err(failed)?);
                for channel in 0..3 {
                    out[channel * n + row] = amount * (high[channel] - low[channel]) / (2.0 * STEP);
                }
            }
            Ok(out)
        };
        runs.iter().zip(nuisance).zip(amounts).map(of_run).collect()
    }
}
