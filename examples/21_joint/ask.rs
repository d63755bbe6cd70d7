//! Motions of a joint recorded, and what the tool says of them.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use hw_traits::clock::Clock;
use hw_traits::motor::Motor;
use missing_physics::diagnosis::{Diagnosis, Estimate};
use missing_physics::engine::Options;
use missing_physics::observer::Silent;
use missing_physics_domains::Loaded;

use super::Outcome;
use super::joint::{CURRENT_S, CYCLE_S};

/// How long the first motion lasts, s.
const FAST_S: f64 = 1.25;
/// How long the joint rests before a motion, s.
pub(super) const REST_S: f64 = 20.0;

/// What whoever built the joint knows of it.
fn header() -> String {
    format!(
        r#"format = 1
domain = "motion"
data = "data.csv"

[model]
states = {{ angle_rad = "rate_rad_s", rate_rad_s = "gain*motor_n_m - weight_per_s2*sin(angle_rad) - damping_per_s*rate_rad_s", motor_n_m = "(command_n_m - motor_n_m)/{CURRENT_S}" }}
outputs = {{ encoder_rad = "angle_rad", current_n_m = "motor_n_m" }}
inputs = {{ command_n_m = "hold" }}

[[parameter]]
name = "gain"
unit = "1/(kg m^2)"
start = 50.0

[[parameter]]
name = "weight_per_s2"
unit = "1/s^2"
start = 25.0

[[parameter]]
name = "damping_per_s"
unit = "1/s"
start = 1.0

[start]
rate_rad_s = 0.0
motor_n_m = 0.0

[[joint]]
name = "joint"
position = "angle_rad"
velocity = "rate_rad_s"
turns = true
"#
    )
}

/// Commands of a motion, one a cycle, N m.
pub(super) type Commands = Vec<f64>;

/// Fast swings of three frequencies at once.
pub(super) fn fast() -> Commands {
    let rows = (FAST_S / CYCLE_S) as usize;
    let at = |row: usize| {
        let t = row as f64 * CYCLE_S;
        let waves = [(1.1, 0.4), (1.7, 0.45), (2.9, 0.5)];
        let sum: f64 = waves.iter().map(|(hz, nm)| nm * (TAU * hz * t).sin()).sum();
        sum * (t / 0.5).min(1.0)
    };
    (0..rows).map(at).collect()
}

/// Drives a joint from rest by commands; rows of the recording.
pub(super) fn record<J: Motor + Clock>(joint: &mut J, label: usize, commands: &[f64]) -> Outcome<String> {
    let as_text = |e: J::Error| format!("{e:?}");
    joint.drive(0.0).map_err(as_text)?;
    joint.sleep_s(REST_S).map_err(as_text)?;
    let mut rows = String::new();
    let mut said = joint.read().map_err(as_text)?;
    let begun_s = said.t_s;
    for command_nm in commands {
        let (t_s, reading) = (said.t_s - begun_s, said.value);
        writeln!(rows, "{label},{t_s:.4},{:.6},{:.5},{command_nm:.6}", reading.angle_rad, reading.torque_nm)?;
        joint.drive(*command_nm).map_err(as_text)?;
        said = joint.read().map_err(as_text)?;
    }
    joint.drive(0.0).map_err(as_text)?;
    Ok(rows)
}

/// What the tool says of a recording.
pub(super) fn ask(rows: &str, seed: u64) -> Outcome<(Loaded, Diagnosis)> {
    let folder = tempfile::tempdir()?;
    std::fs::write(folder.path().join("recording.toml"), header())?;
    std::fs::write(
        folder.path().join("data.csv"),
        format!("run,t_s,encoder_rad,current_n_m,command_n_m\n{rows}"),
    )?;
    let (_, loaded) = missing_physics_domains::load(folder.path()).map_err(|e| e.to_string())?;
    let options = Options { seed, replicates: 199, ..Options::default() };
    let diagnosis = loaded.diagnose(&options, &Silent)?;
    Ok((loaded, diagnosis))
}

/// The commands of what the tool proposes, one a cycle.
pub(super) fn proposed(loaded: &Loaded, diagnosis: &Diagnosis) -> Option<(String, Commands)> {
    let next = diagnosis.next_experiment.as_ref()?;
    let experiment = loaded.experiments.iter().find(|e| e.action == next.action)?;
    let [times, commands] = &experiment.runs.first()?.inputs[..] else { return None };
    let lasts_s = times.last()?;
    let at = |row: usize| {
        let t = row as f64 * CYCLE_S;
        let k = times.partition_point(|s| *s <= t).clamp(1, times.len() - 1);
        let share = (t - times[k - 1]) / (times[k] - times[k - 1]);
        commands[k - 1] + share * (commands[k] - commands[k - 1])
    };
    Some((next.words.clone(), (0..=(lasts_s / CYCLE_S) as usize).map(at).collect()))
}

/// A parameter of a mechanism that was chosen.
pub(super) fn parameter<'a>(diagnosis: &'a Diagnosis, id: &str, name: &str) -> Option<&'a Estimate> {
    let chosen = diagnosis.chosen.iter().any(|c| c == id);
    let mechanism = diagnosis.mechanisms.iter().find(|m| chosen && m.id == id)?;
    mechanism.parameters.iter().find(|p| p.name == name)
}
