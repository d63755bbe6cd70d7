//! The domain `motion`: any machine whose equations of motion can be written down, with what is usually left out of them.

mod accelerations;
mod commands;
mod detents;
mod effects;
mod equations;
mod experiments;
mod expression;
mod follow;
mod growth;
mod held;
mod knots;
mod late;
mod law;
mod local;
mod machine;
mod model;
mod of_runs;
mod read;
mod scales;
mod setting;
mod start;
mod tape;
mod tune;
mod units;
mod windows;

#[cfg(test)]
use missing_physics::data::Recording;
#[cfg(test)]
use missing_physics::model::Quantity;
use missing_physics::model::{Model as _, Spec};

use crate::recording::{Header, ReadError};
use crate::{CheckedRecording, Contents, Domain, Loaded, RunContents, Template};
pub use model::MotionModel;

/// The domain.
#[derive(Debug, Clone, Copy)]
pub struct Motion;

impl Domain for Motion {
    fn id(&self) -> &'static str {
        "motion"
    }

    fn summary(&self) -> &'static str {
        "a machine whose equations of motion stand in the recording: a joint, a drive, a pendulum, a hull, a tank"
    }

    fn reads(&self) -> &'static [(&'static str, &'static str)] {
        &[
            ("run, t_s and a column for each output and input", "cells of outputs may be empty"),
            (
                "[model] states",
                "each state's derivative, an expression of states, inputs, parameters and t_s",
            ),
            ("[model] outputs", "what each measured column should read, an expression"),
            ("[model] inputs", "columns known exactly: \"hold\" or \"linear\" between rows"),
            ("[[parameter]] name, unit, start or value", "and optionally lower, upper, scale, per_run"),
            (
                "[start]",
                "a state at a run's first row: a number, or \"measured\"; fitted where it is not listed",
            ),
            (
                "[[joint]] name, position, velocity",
                "and optionally drive, turns: where a joint's effects may act",
            ),
            ("[[level]] state", "a state that holds an amount"),
            ("[noise] an output's name", "optional: one sigma from a calibration"),
        ]
    }

    fn spec(&self) -> Spec {
        // A machine with one of everything.
        listed(equations::Equations::example())
    }

    fn template(&self) -> Template {
        Template { header: include_str!("template.toml"), data: ("data.csv", include_str!("template.csv")) }
    }

    fn read(&self, header: &Header) -> Result<CheckedRecording, ReadError> {
        let (equations, recording) = read::read(header)?;
        let contents = Contents {
            channels: recording.channels.clone(),
            calibration: recording.calibration.clone(),
            variable: recording.variables[0].clone(),
            runs: recording.runs.iter().map(RunContents::of).collect(),
            spec: listed(equations.clone()),
        };
        let (file, whole) = (header.file.clone(), header.gaps());
        Ok(CheckedRecording::new(contents, move || {
            let tuned = tune::tuned(equations, recording, whole).map_err(|why| ReadError::Value {
                file,
                key: "model".into(),
                got: "without an answer".into(),
                expected: format!("equations that can be followed from their starts ({why})"),
            })?;
            Ok(Loaded::new(tuned.recording, tuned.model, tuned.experiments, tuned.remarks))
        }))
    }
}

/// One run of a machine with one input, as tests have it.
#[cfg(test)]
fn recorded(channels: &[&str], input: &str, run: missing_physics::data::Run, resolution: f64) -> Recording {
    let quantity = |name: &str| Quantity::new(name, units::text(name));
    Recording {
        channels: channels.iter().map(|name| quantity(name)).collect(),
        variables: ["t_s", input].map(quantity).to_vec(),
        runs: vec![run],
        noise_along: Some(0),
        calibration: vec![None; channels.len()],
        resolution: vec![resolution; channels.len()],
    }
}

/// Everything that may act beside equations, of sizes that say nothing.
fn listed(equations: equations::Equations) -> Spec {
    let scales = scales::Scales::of_example(&equations);
    let starts: Vec<f64> = equations.parameters.iter().map(|p| p.value).collect();
    MotionModel::baseline(equations, model::Pace::default()).full(scales, &starts, None).spec().clone()
}
