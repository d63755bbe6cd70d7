//! A model of which the tool knows nothing but its predictions.

use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, Mutex, PoisonError};

use missing_physics::data::Run;
use missing_physics::model::{Extensions, ExternalProgram, Model, PredictError, Scope, Spec};

use super::process::{Failure, Pool};
use super::terms::Candidate;

/// Predictions that are kept, in numbers altogether.
const MOST_KEPT: usize = 16 << 20;

/// Where predictions come from.
#[derive(Debug)]
pub(super) enum Simulation {
    /// They were made before: all channels of each run.
    Made(HashMap<String, Vec<f64>>),
    /// A program is asked.
    Asked(Box<Asked>),
}

/// A program that predicts.
#[derive(Debug)]
pub(super) struct Asked {
    pub(super) pool: Pool,
    /// Names of the inputs, as the program gets them.
    pub(super) inputs: Vec<String>,
    /// Names of the channels, as the program answers them.
    pub(super) channels: Vec<String>,
    /// Names of the parameters, with scope and slot.
    pub(super) parameters: Vec<(String, Scope, usize)>,
    pub(super) kept: Mutex<Kept>,
}

/// Predictions by run and parameters.
#[derive(Debug, Default)]
pub(super) struct Kept {
    by: HashMap<(String, Vec<u64>), Arc<Vec<f64>>>,
    numbers: usize,
}

/// The model.
#[derive(Debug)]
pub(super) struct CustomModel {
    pub(super) spec: Spec,
    pub(super) simulation: Simulation,
    pub(super) terms: Vec<Candidate>,
    pub(super) relative_step: f64,
}

impl Asked {
    fn predict(
        &self,
        run: &Run,
        shared: &[f64],
        nuisance: &[f64],
        rows: usize,
    ) -> Result<Arc<Vec<f64>>, Failure> {
        let value = |scope: &Scope, slot: &usize| match scope {
            Scope::Shared => shared[*slot],
            Scope::PerRun => nuisance[*slot],
        };
        let bits = self.parameters.iter().map(|(_, scope, slot)| value(scope, slot).to_bits()).collect();
        let key = (run.label.clone(), bits);
        let lock = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(kept) = lock().by.get(&key).filter(|k| k.len() == rows) {
            return Ok(Arc::clone(kept));
        }
        let parameters: BTreeMap<&str, f64> =
            self.parameters.iter().map(|(name, scope, slot)| (name.as_str(), value(scope, slot))).collect();
        let inputs =
            self.inputs.iter().map(String::as_str).zip(run.inputs.iter().map(Vec::as_slice)).collect();
        let mut out = vec![0.0; rows];
        self.pool.predict(&run.label, parameters, inputs, &self.channels, &mut out)?;
        let out = Arc::new(out);
        let mut kept = lock();
        if kept.numbers + rows > MOST_KEPT {
            *kept = Kept::default();
        }
        kept.numbers += rows;
        kept.by.insert(key, Arc::clone(&out));
        Ok(out)
    }
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
            Simulation::Made(made) => {
                let made = made.get(&run.label).filter(|m| m.len() == out.len());
                out.copy_from_slice(made.ok_or_else(|| fail("no such run was simulated".into()))?);
            }
            Simulation::Asked(asked) => match asked.predict(run, shared, nuisance, out.len()) {
                Ok(predicted) => out.copy_from_slice(&predicted),
                Err(Failure::Here(why) | Failure::Forever(why)) => return Err(fail(why)),
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
            Simulation::Made(_) => None,
            Simulation::Asked(asked) => {
                asked.pool.fault().map(|reason| PredictError { run: "(any)".into(), reason })
            }
        }
    }
}
