//! A push on the liquid that acts for a while: what it does to the reading.

use missing_physics::data::Run;
use missing_physics::model::{LocalCauses, LocalUnknown, PredictError, Quantity};

use super::model::SloshModel;

impl LocalCauses for SloshModel {
    /// A push on the first mode, as the acceleration of its reading.
    fn unknowns(&self) -> Vec<LocalUnknown> {
        let (name, unit) = match self.channel().unit() {
            "N" => ("forcing_n_s2", "N/s^2"),
            _ => ("forcing_nm_s2", "N m/s^2"),
        };
        vec![LocalUnknown::new("a push", vec![Quantity::new(name, unit)])]
    }

    fn response(
        &self,
        _: (usize, usize),
        runs: &[Run],
        shared: &[f64],
        nuisance: &[Vec<f64>],
        amounts: &[Vec<f64>],
    ) -> Result<Vec<Vec<f64>>, PredictError> {
        let of_run = |((run, nuisance), amounts): ((&Run, &Vec<f64>), &Vec<f64>)| {
            let [omega, ratio] = self.first_mode(run, [shared, nuisance]);
            let decay = ratio * omega;
            let ringing = omega * (1.0 - ratio * ratio).sqrt();
            let times = &run.inputs[0];
            let (mut reading, mut rate) = (0.0, 0.0);
            let mut out = vec![0.0; run.len()];
            for i in 1..out.len() {
                let h = times[i] - times[i - 1];
                rate += 0.5 * h * amounts[i - 1];
                // A step of the damped oscillator by itself.
                let (sin, cos) = (ringing * h).sin_cos();
                let along = (rate + decay * reading) / ringing;
                let shrinks = (-decay * h).exp();
                let next = shrinks * (reading * cos + along * sin);
                rate = shrinks * (ringing * (along * cos - reading * sin)) - decay * next;
                reading = next;
                rate += 0.5 * h * amounts[i];
                out[i] = reading;
            }
            out
        };
        Ok(runs.iter().zip(nuisance).zip(amounts).map(of_run).collect())
    }
}
