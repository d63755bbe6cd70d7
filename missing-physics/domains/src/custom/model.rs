//! A model of which the tool knows nothing but its predictions.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use missing_physics::data::Run;
use missing_physics::model::{
    Extensions, ExternalProgram, Model, MultimodalModel, PredictError, Quantity, Scope, Spec,
    difference_points, finite_differences,
};

use super::answer::Failure;
use super::machine::{JointForce, Machine};
use super::sensors::Sensors;
use super::simulator::{Questions, Simulator};
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
    /// A simulator is asked.
    Program(Box<Program>),
}

/// Parameters by the names that the program knows them by, with scope and slot.
pub(super) type Names = Vec<(String, Scope, usize)>;

/// A question: label and fingerprint of the run, its rows, and the bits of the parameters.
type Asked = (String, u64, usize, Vec<u64>);

/// A simulator that predicts.
#[derive(Debug)]
pub(super) struct Program {
    simulator: Arc<dyn Simulator>,
    /// Names of the inputs, as the program gets them.
    inputs: Vec<String>,
    /// Names of the channels, as the program answers them.
    channels: Vec<String>,
    parameters: Names,
    /// What acts on its joints and inputs.
    machine: Machine,
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
    pub(super) sensors: Sensors,
    /// Slots of parameters of each run, and where their fits begin.
    pub(super) begins: Vec<(usize, Begins)>,
    pub(super) relative_step: f64,
}

impl Program {
    /// A simulator that was not asked yet.
    pub(super) fn new(
        simulator: Arc<dyn Simulator>,
        inputs: &[Quantity],
        channels: &[Quantity],
        parameters: Names,
        machine: Machine,
        relative_step: f64,
    ) -> Self {
        let names = |quantities: &[Quantity]| quantities.iter().map(|q| q.name.clone()).collect();
        let (inputs, channels) = (names(inputs), names(channels));
        Self {
            simulator,
            inputs,
            channels,
            parameters,
            machine,
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
        let values = self.values(shared, nuisance);
        self.predictions.get_or(asked(run, hash(&run.inputs), rows, &values), rows, || {
            let set = [values];
            let mut first = self.ask(run, rows, &set)?;
            if !self.asked_twice.swap(true, Ordering::SeqCst) {
                let second = self.ask(run, rows, &set)?;
                self.same(&first[0], &second[0]).map_err(|why| self.simulator.give_up(why))?;
            }
            Ok(Arc::new(first.swap_remove(0)))
        })
    }

    /// Asks at once for what is not remembered of some sets of parameters.
    fn foresee(&self, run: &Run, rows: usize, points: &[(&[f64], &[f64])]) -> Result<(), Failure> {
        let key = hash(&run.inputs);
        let sets = points.iter().map(|(shared, nuisance)| self.values(shared, nuisance));
        let unknown = |set: &Vec<f64>| !self.predictions.knows(&asked(run, key, rows, set));
        let sets: Vec<Vec<f64>> = sets.filter(unknown).collect();
        if sets.len() < 2 {
            return Ok(());
        }
        for (set, out) in sets.iter().zip(self.ask(run, rows, &sets)?) {
            self.predictions.get_or(asked(run, key, rows, set), rows, || Ok::<_, Failure>(Arc::new(out)))?;
        }
        Ok(())
    }

    /// The parameters' values in the order of their names, then those of what acts on its inputs and joints.
    fn values(&self, shared: &[f64], nuisance: &[f64]) -> Vec<f64> {
        let value = |(_, scope, slot): &(String, Scope, usize)| match scope {
            Scope::Shared => shared[*slot],
            Scope::PerRun => nuisance[*slot],
        };
        self.parameters.iter().map(value).chain(self.machine.values(shared)).collect()
    }

    /// As many answers as there are sets, each with all rows of all channels.
    fn ask(&self, run: &Run, rows: usize, sets: &[Vec<f64>]) -> Result<Vec<Vec<f64>>, Failure> {
        // Sets with the same inputs are asked for at once.
        let (first, last) = (self.parameters.len(), self.parameters.len() + self.machine.of_inputs());
        let alike = |a: &Vec<f64>, b: &Vec<f64>| a[first..last] == b[first..last];
        let answers = sets.chunk_by(alike).map(|sets| self.ask_alike(run, rows, sets));
        Ok(answers.collect::<Result<Vec<_>, _>>()?.concat())
    }

    /// The same of sets at which the inputs act alike.
    fn ask_alike(&self, run: &Run, rows: usize, sets: &[Vec<f64>]) -> Result<Vec<Vec<f64>>, Failure> {
        let names: Vec<&str> = self.parameters.iter().map(|(name, ..)| name.as_str()).collect();
        let (stated, further): (Vec<Vec<f64>>, Vec<&[f64]>) = sets
            .iter()
            .map(|set| {
                let (stated, further) = set.split_at(names.len());
                (stated.to_vec(), further)
            })
            .unzip();
        if let Some(why) = further.iter().find_map(|values| self.machine.unknown(values)) {
            return Err(Failure::NoPrediction(why));
        }
        let acting = further.first().and_then(|values| self.machine.inputs(values, run));
        let columns = acting.as_ref().unwrap_or(&run.inputs).iter().map(Vec::as_slice);
        let inputs: Vec<(&str, &[f64])> = self.inputs.iter().map(String::as_str).zip(columns).collect();
        let forces: Vec<Vec<JointForce>> = further.iter().map(|values| self.machine.forces(values)).collect();
        let answers = self.simulator.predict(&Questions {
            run: &run.label,
            parameters: &names,
            sets: &stated,
            inputs: &inputs,
            joints: self.machine.joints(),
            forces: &forces,
            channels: &self.channels,
            rows: rows / self.channels.len().max(1),
        })?;
        if answers.len() == sets.len() && answers.iter().all(|answer| answer.len() == rows) {
            return Ok(answers);
        }
        let (got, expected) = (answers.len(), sets.len());
        let why = format!("the simulator gave {got} answers, expected {expected} of {rows} numbers each");
        Err(self.simulator.give_up(why))
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

/// Where the fit of a run's own parameter begins.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Begins {
    /// At these values, by label of the run.
    Given(HashMap<String, f64>),
    /// At the first reading of this channel.
    Measured(usize),
}

impl Begins {
    fn of(&self, run: &Run) -> Option<f64> {
        match self {
            Self::Given(values) => values.get(&run.label).copied(),
            Self::Measured(channel) => run.outputs[*channel].iter().copied().find(|v| v.is_finite()),
        }
    }
}

fn asked(run: &Run, inputs: u64, rows: usize, values: &[f64]) -> Asked {
    (run.label.clone(), inputs, rows, bits(values))
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
        self.sensors.read(shared, run.inputs.first().map_or(&[], Vec::as_slice), out);
        Ok(())
    }

    fn nuisance_start(&self, run: &Run, nuisance: &mut [f64]) {
        for (slot, begins) in &self.begins {
            if let Some(value) = begins.of(run) {
                nuisance[*slot] = value;
            }
        }
    }

    fn relative_step(&self) -> f64 {
        self.relative_step
    }

    fn jacobian(
        &self,
        run: &Run,
        shared: &[f64],
        nuisance: &[f64],
        shared_free: &[usize],
        nuisance_free: &[usize],
        out: &mut [f64],
        jacobian: &mut [f64],
    ) -> Result<(), PredictError> {
        if let Simulation::Program(program) = &self.simulation
            && program.simulator.batches()
        {
            let pairs = difference_points(self, shared, nuisance, shared_free, nuisance_free);
            let mut points = vec![(shared, nuisance)];
            points.extend(
                pairs.iter().flat_map(|p| [&p.high, &p.low]).map(|(s, n)| (s.as_slice(), n.as_slice())),
            );
            // What cannot be foreseen is asked for one by one, and fails there.
            let _ = program.foresee(run, out.len(), &points);
        }
        finite_differences(self, run, shared, nuisance, shared_free, nuisance_free, out, jacobian)
    }

    fn extensions(&self) -> Extensions<'_> {
        Extensions { program: Some(self), modes: Some(self), ..Extensions::default() }
    }
}

impl MultimodalModel for CustomModel {
    fn starts(&self, mechanism: usize, _: &[Run], _: &[Vec<Vec<f64>>]) -> Vec<Vec<(usize, f64)>> {
        let parameters = &self.spec.mechanisms[mechanism].parameters;
        let mut starts = self.sensors.starts(parameters);
        if let Simulation::Program(program) = &self.simulation {
            starts.extend(program.machine.starts(parameters));
        }
        starts
    }
}

impl ExternalProgram for CustomModel {
    fn fatal_error(&self) -> Option<PredictError> {
        match &self.simulation {
            Simulation::Precomputed(_) => None,
            Simulation::Program(program) => {
                program.simulator.fault().map(|reason| PredictError { run: "(any)".into(), reason })
            }
        }
    }
}
