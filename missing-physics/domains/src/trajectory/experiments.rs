//! What could be thrown, dropped or filmed next.

use missing_physics::data::{Recording, Run};
use missing_physics::model::Experiment;

use super::model::TrajectoryModel;
use super::setup::{Axes, ROD};
use crate::reading::upper_median;

/// Frames of a proposed run.
const MOST_FRAMES: usize = 200;
/// Repeats of a proposed run.
const REPEATS: usize = 3;

/// Drops and throws within about twice of what was recorded, and a rod of known length.
pub(super) fn experiments(model: &TrajectoryModel, recording: &Recording) -> Vec<Experiment> {
    let (axes, gravity_m_s2) = (model.axes(), model.gravity_m_s2());
    let mut list = Vec::new();
    let frame = frame_s(recording);
    if axes == Axes::Accelerometer || gravity_m_s2 <= 0.0 {
        return list;
    }
    let (height, speed) = recorded(recording, gravity_m_s2);
    for drop in [1.0, 2.0, 5.0, 10.0, 20.0, 40.0, 80.0] {
        if drop <= 2.0 * height {
            let duration = (2.0 * drop / gravity_m_s2).sqrt();
            let nuisance = begins(model, [0.0, 0.0, drop], [0.0; 3]);
            let words = format!("drop it from {drop} m as well, {REPEATS} times");
            list.push(repeated(
                recording,
                vec![("drop_height_m".into(), drop)],
                words,
                duration,
                frame,
                nuisance,
            ));
        }
    }
    if axes.along_ground() {
        for factor in [0.5, 1.0, 2.0] {
            let launch = (factor * speed * 2.0).round() / 2.0;
            for degrees in [30.0_f64, 60.0, 85.0] {
                if launch < 0.5 {
                    continue;
                }
                let (sin, cos) = degrees.to_radians().sin_cos();
                let duration = (2.0 * launch * sin / gravity_m_s2).max(4.0 * frame);
                let action = vec![
                    ("launch_speed_m_s".into(), launch),
                    ("launch_angle_rad".into(), (degrees.to_radians() * 1e3).round() / 1e3),
                ];
                let words =
                    format!("throw it at {launch} m/s, {degrees} degrees above level, {REPEATS} times");
                let nuisance = begins(model, [0.0, 0.0, 1.0], [launch * cos, 0.0, launch * sin]);
                list.push(repeated(recording, action, words, duration, frame, nuisance));
            }
        }
    }
    let mut rod = template(recording, vec![0.0, 1.0]);
    rod.kind = ROD;
    let nuisance = begins(model, [0.0; 3], [0.0; 3]);
    list.push(Experiment {
        action: vec![("known_length_m".into(), 1.0)],
        words: "film an upright rod of exactly 1 m, 10 times, and read its ends".into(),
        runs: vec![rod; 10],
        nuisance: vec![nuisance; 10],
    });
    list
}

/// The nuisance parameters of a run that begins at a place (m) with a velocity (m/s).
fn begins(model: &TrajectoryModel, place: [f64; 3], velocity: [f64; 3]) -> Vec<f64> {
    let seen = model.axes().seen();
    let mut begins: Vec<f64> =
        seen.iter().map(|k| place[*k]).chain(seen.iter().map(|k| velocity[*k])).collect();
    begins.resize(model.nuisance_count(), 0.0);
    begins
}

fn repeated(
    recording: &Recording,
    action: Vec<(String, f64)>,
    words: String,
    duration: f64,
    frame: f64,
    nuisance: Vec<f64>,
) -> Experiment {
    let frames = ((duration / frame) as usize + 1).clamp(4, MOST_FRAMES);
    let step = frame.max(duration / MOST_FRAMES as f64);
    let run = template(recording, (0..frames).map(|i| i as f64 * step).collect());
    Experiment { action, words, runs: vec![run; REPEATS], nuisance: vec![nuisance; REPEATS] }
}

/// A run with the given times, the recording's last spin and no measurements yet.
fn template(recording: &Recording, times: Vec<f64>) -> Run {
    let n = times.len();
    let mut inputs = vec![times];
    for variable in 1..recording.variables.len() {
        let spin = recording.runs.last().and_then(|r| r.inputs[variable].first()).copied().unwrap_or(0.0);
        inputs.push(vec![spin; n]);
    }
    Run { label: "next".into(), inputs, outputs: vec![vec![0.0; n]; recording.channels.len()], kind: 0 }
}

fn frame_s(recording: &Recording) -> f64 {
    let gaps = recording.runs.iter().flat_map(|r| r.inputs[0].windows(2).map(|w| w[1] - w[0]));
    upper_median(gaps.collect()).unwrap_or(1.0 / 30.0).max(1e-4)
}

/// The largest fall in m and the largest speed in m/s that were recorded.
fn recorded(recording: &Recording, gravity_m_s2: f64) -> (f64, f64) {
    let (mut fall, mut speed): (f64, f64) = (0.0, 0.0);
    for run in &recording.runs {
        let Some(z) = run.outputs.last() else { continue };
        let (low, high) =
            z.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        fall = fall.max(high - low);
        let (Some(first), Some(last)) = (run.inputs[0].first(), run.inputs[0].last()) else { continue };
        let mean = run.outputs.iter().filter_map(|c| Some((c.last()? - c.first()?) / (last - first)));
        let square: f64 = mean.map(|v| v * v).sum();
        speed = speed.max(square.sqrt().max(0.5 * gravity_m_s2 * (last - first)));
    }
    (fall, speed)
}
