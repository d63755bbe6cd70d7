//! A force that acts for a while, or at some place: what it does to the readings.

use bounce_audio::flight::{Flight, State};
use missing_physics::data::Run;
use missing_physics::model::{LocalCauses, LocalUnknown, PredictError, Quantity};

use super::model::{Camera, TrajectoryModel, tilted};
use super::setup::{Axes, ROD};
use crate::dual::Moving;

/// A step in speed (m/s) or place (m) at which the change of the acceleration is asked for.
const STEP: f64 = 1e-3;

/// A flight, the camera that sees it, and its states at the rows.
type Followed = (Flight<f64>, Camera<f64>, Vec<State<f64>>);

impl TrajectoryModel {
    /// The flight as it is without the force, and the camera.
    fn followed(&self, run: &Run, shared: &[f64], nuisance: &[f64]) -> Result<Followed, PredictError> {
        let (flight, camera, _) = self.effects(run, (shared, nuisance), Moving::default());
        let start = self.start(nuisance);
        let times = &run.inputs[0];
        let begin = times.first().copied().unwrap_or(0.0);
        let elapsed: Vec<f64> = times.iter().map(|t| (t - begin) / (1.0 + camera.clock_rate)).collect();
        let mut states = vec![start; elapsed.len()];
        flight
            .states(&start, &elapsed, &mut states)
            .map_err(|e| PredictError { run: run.label.clone(), reason: e.to_string() })?;
        Ok((flight, camera, states))
    }

    /// How place and velocity change, `[row]`, by an acceleration along an axis of the given size at each row (up to half way to the next).
    fn pushed(
        run: &Run,
        flight: &Flight<f64>,
        states: &[State<f64>],
        axis: usize,
        amounts: &[f64],
    ) -> Vec<[f64; 3]> {
        let times = &run.inputs[0];
        let origin = states.first().map_or([0.0; 3], |s| s.position);
        let mut places = Vec::with_capacity(states.len());
        let (mut place, mut velocity) = ([0.0_f64; 3], [0.0_f64; 3]);
        for i in 0..states.len() {
            if i > 0 {
                let h = times[i] - times[i - 1];
                let before = &states[i - 1];
                let mut moved = *before;
                let size = place.iter().chain(&velocity).fold(0.0_f64, |m, v| m.max(v.abs()));
                let scale = if size > 0.0 { STEP / size } else { 0.0 };
                for k in 0..3 {
                    moved.position[k] += scale * place[k];
                    moved.velocity[k] += scale * velocity[k];
                }
                // The force of drag and the like follows the change of the state.
                let (a, b) = (flight.acceleration(&moved, &origin), flight.acceleration(before, &origin));
                for k in 0..3 {
                    let follows = if scale > 0.0 { (a[k] - b[k]) / scale } else { 0.0 };
                    let [now, next] = if k == axis { [amounts[i - 1], amounts[i]] } else { [0.0; 2] };
                    place[k] += h * velocity[k] + h * h * (0.5 * follows + 0.375 * now + 0.125 * next);
                    velocity[k] += h * (follows + 0.5 * (now + next));
                }
            }
            places.push(place);
        }
        places
    }
}

impl LocalCauses for TrajectoryModel {
    /// A force; of a felt flight it is what the sensor reads.
    fn unknowns(&self) -> Vec<LocalUnknown> {
        if self.axes() == Axes::Accelerometer {
            return Vec::new();
        }
        let component =
            |axis: &usize| Quantity::new(format!("acceleration_{}_m_s2", ["x", "y", "z"][*axis]), "m/s^2");
        vec![LocalUnknown::new("a force", self.axes().seen().iter().map(component).collect())]
    }

    fn response(
        &self,
        (_, component): (usize, usize),
        runs: &[Run],
        shared: &[f64],
        nuisance: &[Vec<f64>],
        amounts: &[Vec<f64>],
    ) -> Result<Vec<Vec<f64>>, PredictError> {
        let of_run = |((run, nuisance), amounts): ((&Run, &Vec<f64>), &Vec<f64>)| {
            let n = run.len();
            let mut out = vec![0.0; run.outputs.len() * n];
            if run.kind == ROD || amounts.iter().all(|a| *a == 0.0) {
                return Ok(out);
            }
            let (flight, camera, states) = self.followed(run, shared, nuisance)?;
            let seen = self.axes().seen();
            let places = Self::pushed(run, &flight, &states, seen[component], amounts);
            for (i, place) in places.into_iter().enumerate() {
                let place = if self.axes().along_ground() { tilted(place, camera.tilt) } else { place };
                for (c, axis) in seen.iter().enumerate() {
                    out[c * n + i] = camera.scale * place[*axis];
                }
            }
            Ok(out)
        };
        runs.iter().zip(nuisance).zip(amounts).map(of_run).collect()
    }

    fn states(&self) -> Vec<Quantity> {
        if self.axes() == Axes::Accelerometer {
            return Vec::new();
        }
        let place = |column: &&str| Quantity::new(*column, "m");
        self.axes().channels().iter().map(place).chain([Quantity::new("speed_m_s", "m/s")]).collect()
    }

    fn state(&self, run: &Run, shared: &[f64], nuisance: &[f64]) -> Result<Vec<Vec<f64>>, PredictError> {
        if self.axes() == Axes::Accelerometer {
            return Ok(Vec::new());
        }
        let (_, _, states) = self.followed(run, shared, nuisance)?;
        let place = |k: &usize| states.iter().map(|s| s.position[*k]).collect();
        let speed = |s: &State<f64>| s.velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
        Ok(self.axes().seen().iter().map(place).chain([states.iter().map(speed).collect()]).collect())
    }
}
