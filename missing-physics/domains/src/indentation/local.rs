//! A modulus or a stiffness that is another one over some depths: what it does to the force.

use missing_physics::data::Run;
use missing_physics::model::{LocalCauses, LocalUnknown, Model as _, PredictError, Quantity};

use super::model::IndentationModel;

const STIFFNESS: usize = 1;

impl LocalCauses for IndentationModel {
    /// A modulus by which the force of a row is larger as a whole, and a stiffness whose force stays on at larger depths.
    fn unknowns(&self) -> Vec<LocalUnknown> {
        let one = |name: &str, component: &str, unit: &str| {
            LocalUnknown::new(name, vec![Quantity::new(component, unit)])
        };
        vec![one("another modulus", "relative_modulus", ""), one("another stiffness", "stiffness_n_m", "N/m")]
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
            let [offset_m, lift_n] = self.offsets(nuisance);
            if unknown == STIFFNESS {
                let mut force = 0.0;
                let (mut before, mut stiffness) = (0.0, amounts.first().copied().unwrap_or(0.0));
                let step = |(depth, amount): (&f64, &f64)| {
                    let depth = (depth - offset_m).max(0.0);
                    force += 0.5 * (stiffness + amount) * (depth - before);
                    (before, stiffness) = (depth, *amount);
                    force
                };
                return Ok(run.inputs[0].iter().zip(amounts).map(step).collect());
            }
            let mut forces = vec![0.0; run.len()];
            self.predict(run, shared, nuisance, &mut forces)?;
            Ok(forces.iter().zip(amounts).map(|(force, amount)| amount * (force - lift_n)).collect())
        };
        runs.iter().zip(nuisance).zip(amounts).map(of_run).collect()
    }
}
