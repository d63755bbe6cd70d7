//! A function of Python's in the place of a program that simulates.

use std::sync::{Arc, Mutex, PoisonError};

use missing_physics_domains::custom::{Failure, JointForce, Questions, Simulator as Simulates, fill};
use numpy::PyArray1;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping};

use crate::array::{array, column, rows};

/// The function, and why it is not asked any more.
#[derive(Debug)]
pub(crate) struct Function {
    call: Py<PyAny>,
    batched: bool,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    fault: Option<String>,
    raised: Option<PyErr>,
}

/// A simulator: `predict(parameters, inputs)` and whether it takes many sets of parameters at once.
#[pyclass(frozen, module = "missing_physics._engine")]
pub(crate) struct Simulator {
    call: Py<PyAny>,
    batched: bool,
}

#[pymethods]
impl Simulator {
    #[new]
    fn new(predict: Py<PyAny>, batched: bool) -> Self {
        Self { call: predict, batched }
    }
}

impl Simulator {
    /// The function afresh: what went wrong before is forgotten.
    pub(crate) fn function(&self, py: Python<'_>) -> Arc<Function> {
        let state = Mutex::default();
        Arc::new(Function { call: self.call.clone_ref(py), batched: self.batched, state })
    }
}

/// Why a question has no answer.
enum Wrong {
    Raised(PyErr),
    Failed(Failure),
}

impl From<PyErr> for Wrong {
    fn from(error: PyErr) -> Self {
        Self::Raised(error)
    }
}

impl From<Failure> for Wrong {
    fn from(failure: Failure) -> Self {
        Self::Failed(failure)
    }
}

impl Function {
    /// What the function raised, if it did.
    pub(crate) fn raised(&self) -> Option<PyErr> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).raised.take()
    }

    /// The function is not asked any more.
    pub(crate) fn stop(&self) {
        self.give_up("stopped".into());
    }

    /// What the function answers; where it has joints, it gets as a third argument what acts on each of them.
    fn answer<'py, F: IntoPyObject<'py>>(
        &self,
        py: Python<'py>,
        parameters: &Bound<'py, PyDict>,
        asked: &Questions<'_>,
        of_joint: impl Fn(&[&JointForce]) -> F,
    ) -> PyResult<Bound<'py, PyAny>> {
        let call = self.call.bind(py);
        if asked.joints.is_empty() {
            return call.call1((parameters, inputs(py, asked)?));
        }
        let forces = PyDict::new(py);
        for (k, name) in asked.joints.iter().enumerate() {
            let of_sets: Vec<&JointForce> = asked.forces.iter().filter_map(|set| set.get(k)).collect();
            forces.set_item(name, of_joint(&of_sets))?;
        }
        call.call1((parameters, inputs(py, asked)?, forces))
    }

    /// One set of parameters: a number a name, a column a channel.
    fn one(&self, py: Python<'_>, asked: &Questions<'_>, set: &[f64]) -> Result<Vec<f64>, Wrong> {
        let parameters = PyDict::new(py);
        for (name, value) in asked.parameters.iter().zip(set) {
            parameters.set_item(name, value)?;
        }
        let answer = self.answer(py, &parameters, asked, |forces| forces.first().map(|acts| texts(acts)))?;
        let mut out = vec![0.0; asked.rows * asked.channels.len()];
        for (name, out) in asked.channels.iter().zip(out.chunks_mut(asked.rows.max(1))) {
            let values = column(&channel(&answer, asked.channels, name)?, name)?;
            fill(name, values.into_iter().map(Some), out)?;
        }
        Ok(out)
    }

    /// All sets at once: a column a name, one row a set in each channel.
    fn all(&self, py: Python<'_>, asked: &Questions<'_>) -> Result<Vec<Vec<f64>>, Wrong> {
        let parameters = PyDict::new(py);
        for (k, name) in asked.parameters.iter().enumerate() {
            let values: Vec<f64> = asked.sets.iter().map(|set| set[k]).collect();
            parameters.set_item(name, PyArray1::from_vec(py, values))?;
        }
        // Without parameters nothing else says how many answers are expected.
        let count = asked.sets.len();
        let all = |forces: &[&JointForce]| forces.iter().copied().map(texts).collect::<Vec<_>>();
        let answer = self.answer(py, &parameters, asked, all)?;
        let mut outs = vec![vec![0.0; asked.rows * asked.channels.len()]; count];
        for (c, name) in asked.channels.iter().enumerate() {
            let all = rows(&channel(&answer, asked.channels, name)?, name)?;
            if all.len() != count {
                let got = all.len();
                let why = format!(
                    "the simulator answered {got} rows of {name}, expected {count}, one a set of parameters"
                );
                return Err(Failure::Fatal(why).into());
            }
            for (values, out) in all.into_iter().zip(&mut outs) {
                fill(name, values.into_iter().map(Some), &mut out[c * asked.rows..(c + 1) * asked.rows])?;
            }
        }
        Ok(outs)
    }

    /// Keeps what ends everything.
    fn failure(&self, py: Python<'_>, wrong: Wrong) -> Failure {
        match wrong {
            Wrong::Failed(Failure::Fatal(why)) => self.give_up(why),
            Wrong::Failed(failure) => failure,
            Wrong::Raised(error) => {
                let words = error.value(py).to_string();
                let class = py.import("missing_physics.errors").and_then(|m| m.getattr("NoPrediction"));
                if class.is_ok_and(|class| error.matches(py, class).unwrap_or(false)) {
                    return Failure::NoPrediction(format!("the simulator says {words:?}"));
                }
                let kind = error.get_type(py).to_string();
                let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
                let why = state
                    .fault
                    .get_or_insert_with(|| format!("the simulator raised {kind}: {words}"))
                    .clone();
                state.raised.get_or_insert(error);
                Failure::Fatal(why)
            }
        }
    }
}

/// A force and a friction as Python gets them.
fn texts(acts: &JointForce) -> (String, String) {
    (acts.force.clone(), acts.friction.clone())
}

/// The inputs of a run, each an array of its own.
fn inputs<'py>(py: Python<'py>, asked: &Questions<'_>) -> PyResult<Bound<'py, PyDict>> {
    let inputs = PyDict::new(py);
    for (name, values) in asked.inputs {
        inputs.set_item(name, array(py, values))?;
    }
    Ok(inputs)
}

/// What was answered for a channel: by its name, or the whole where there is one channel and no names.
fn channel<'py>(
    answer: &Bound<'py, PyAny>,
    channels: &[String],
    name: &str,
) -> Result<Bound<'py, PyAny>, Wrong> {
    if let Ok(by_name) = answer.cast::<PyDict>() {
        if let Some(found) = by_name.get_item(name)? {
            return Ok(found);
        }
    } else if let Ok(by_name) = answer.cast::<PyMapping>() {
        if by_name.contains(name)? {
            return Ok(by_name.get_item(name)?);
        }
    } else if channels.len() == 1 {
        return Ok(answer.clone());
    }
    let got = match answer.call_method0(intern!(answer.py(), "keys")) {
        Ok(keys) => format!(
            "the channels {:?}",
            keys.try_iter()?.filter_map(|k| k.ok()?.extract().ok()).collect::<Vec<String>>()
        ),
        Err(_) => format!("a {}", answer.get_type().name()?),
    };
    Err(Failure::Fatal(format!("the simulator answered {got}, expected a dict with {name}")).into())
}

impl Simulates for Function {
    fn predict(&self, questions: &Questions<'_>) -> Result<Vec<Vec<f64>>, Failure> {
        if let Some(fault) = self.fault() {
            return Err(Failure::Fatal(fault));
        }
        Python::attach(|py| {
            let answers = if self.batched {
                self.all(py, questions)
            } else {
                let each = (0..questions.sets.len()).map(|k| {
                    let forces = questions.forces.get(k..=k).unwrap_or_default();
                    self.one(py, &Questions { forces, ..*questions }, &questions.sets[k])
                });
                each.collect()
            };
            answers.map_err(|wrong| self.failure(py, wrong))
        })
    }

    fn batches(&self) -> bool {
        self.batched
    }

    fn fault(&self) -> Option<String> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).fault.clone()
    }

    fn give_up(&self, why: String) -> Failure {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        Failure::Fatal(state.fault.get_or_insert(why).clone())
    }
}
