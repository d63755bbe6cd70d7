//! A model of which the tool knows nothing but its predictions.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use missing_physics::data::Run;
use missing_physics::model::{Extensions, ExternalProgram, Model, PredictError, Quantity, Scope, Spec};

use super::answer::Failure;
use super::process::Pool;
use super::terms::Candidate;
use crate::memo::{Memo, bits};

/// How many predicted numbers are remembered altogether.
const MOST_NUMBERS: usize = 16 << 20;

/// Answers to one question are to agree to this part of the step of derivatives.
const BEYOND_STEP: f64 = 1e-3;

/// Where predictions come from.
#[derive(Debug)]
pub(super) enum Simulation {
    /// They were made before: all channels of each run.
    Precomputed(HashMap<String, Vec<f64>>),
    /// A program is asked.
    Program(Box<Program>),
}

/// Parameters by the names that the program knows them by, with scope and slot.
pub(super) type Names = Vec<(String, Scope, usize)>;

/// A question: label and fingerprint of the run, its rows, and the bits of the parameters.
type Asked = (String, u64, usize, Vec<u64>);

/// A program that predicts.
#[derive(Debug)]
pub(super) struct Program {
    pool: Pool,
    /// Names of the inputs, as the program gets them.
    inputs: Vec<String>,
    /// Names of the channels, as the program answers them.
    channels: Vec<String>,
    parameters: Names,
    /// Predictions by run, a hash of its inputs, number of rows, and the bits of the parameters.
    predictions: Memo<Asked, Arc<Vec<f64>>>,
    /// By how much the answers to one question may differ, relative to the largest number of a channel.
    tolerance: f64,
    /// Whether a question was asked twice.
    asked_twice: AtomicBool,
}

/// The model of the domain `custom`.
#[derive(Debug)]
pub(super) struct CustomModel {
    pub(super) spec: Spec,
    pub(super) simulation: Simulation,
    pub(super) terms: Vec<Candidate>,
    pub(super) relative_step: f64,
}

impl Program {
    /// A program that is started when it is first asked.
    pub(super) fn new(
        pool: Pool,
        inputs: &[Quantity],
        channels: &[Quantity],
        parameters: Names,
        relative_step: f64,
    ) -> Self {
        let names = |quantities: &[Quantity]| quantities.iter().map(|q| q.name.clone()).collect();
        let (inputs, channels) = (names(inputs), names(channels));
        Self {
            pool,
            inputs,
            channels,
            parameters,
            predictions: Memo::new(MOST_NUMBERS),
            tolerance: BEYOND_STEP * relative_step,
            asked_twice: AtomicBool::new(false),
        }
    }

    fn predict(
        &self,
        run: &Run,
        shared: &[f64],
        nuisance: &[f64],
        rows: usize,
    ) -> Result<Arc<Vec<f64>>, Failure> {
        let value = |(_, scope, slot): &(String, Scope, usize)| match scope {
            Scope::Shared => shared[*slot],
            Scope::PerRun => nuisance[*slot],
        };
        let values: Vec<f64> = self.parameters.iter().map(value).collect();
        let asked = (run.label.clone(), hash(&run.inputs), rows, bits(&values));
        self.predictions.get_or(asked, rows, || {
            let ask = || {
                let names = self.parameters.iter().map(|(name, ..)| name.as_str());
                let parameters = names.zip(values.iter().copied()).collect();
                let columns = run.inputs.iter().map(Vec::as_slice);
                let inputs = self.inputs.iter().map(String::as_str).zip(columns).collect();
                let mut out = vec![0.0; rows];
                self.pool.predict(&run.label, parameters, inputs, &self.channels, &mut out).map(|()| out)
            };
            let out = ask()?;
            if !self.asked_twice.swap(true, Ordering::SeqCst) {
                self.same(&out, &ask()?).map_err(|why| self.pool.give_up(why))?;
            }
            Ok(Arc::new(out))
        })
    }

    /// Two answers to one question are one; or how they differ.
    fn same(&self, first: &[f64], second: &[f64]) -> Result<(), String> {
        let rows = (first.len() / self.channels.len().max(1)).max(1);
        let columns = first.chunks(rows).zip(second.chunks(rows)).zip(&self.channels);
        for ((first, second), name) in columns {
            let largest = first.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            let apart = |(a, b): (&f64, &f64)| (a - b).abs() > self.tolerance * largest;
            if let Some(row) = first.iter().zip(second).position(apart) {
                return Err(format!(
                    "the simulator answered one question twice, with {} and with {} for {name} at row {row}, expected \
                     the same answer: seed its random numbers, keep nothing from question to question",
                    first[row], second[row]
                ));
            }
        }
        Ok(())
    }
}

/// Tells a run's inputs from another's that has its label.
fn hash(inputs: &[Vec<f64>]) -> u64 {
    let mut hasher = DefaultHasher::new();
    inputs.iter().for_each(|column| bits(column).hash(&mut hasher));
    hasher.finish()
}

impl Model for CustomModel {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn predict(
        &self,
        run: &Run,
        shared: &[f64],
        nuisance: &[f64],
        out: &mut [f64],
    ) -> Result<(), PredictError> {
        let fail = |reason: String| PredictError { run: run.label.clone(), reason };
        match &self.simulation {
            Simulation::Precomputed(made) => {
                let made = made.get(&run.label).filter(|m| m.len() == out.len());
                out.copy_from_slice(made.ok_or_else(|| fail("no such run was simulated".into()))?);
            }
            Simulation::Program(program) => match program.predict(run, shared, nuisance, out.len()) {
                Ok(predicted) => out.copy_from_slice(&predicted),
                Err(Failure::NoPrediction(why) | Failure::Fatal(why)) => return Err(fail(why)),
            },
        }
        if self.terms.iter().any(|t| shared[t.slot] != 0.0) {
            let predicted = out.to_vec();
            for term in self.terms.iter().filter(|t| shared[t.slot] != 0.0) {
                term.apply(shared[term.slot], &run.inputs, &predicted, out);
            }
        }
        Ok(())
    }

    fn relative_step(&self) -> f64 {
        self.relative_step
    }

    fn extensions(&self) -> Extensions<'_> {
        Extensions { program: Some(self), ..Extensions::default() }
    }
}

impl ExternalProgram for CustomModel {
    fn fatal_error(&self) -> Option<PredictError> {
        match &self.simulation {
            Simulation::Precomputed(_) => None,
            Simulation::Program(program) => {
                program.pool.fault().map(|reason| PredictError { run: "(any)".into(), reason })
            }
        }
    }
}
