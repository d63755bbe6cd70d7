//! What a repaired model says of a recording, and what there is to choose from.

use missing_physics_domains::all;
use missing_physics_domains::repair::{Repair, RepairError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::json;

use crate::answer::load;
use crate::array::array;
use crate::errors::Failed;
use crate::function::Simulator;
use crate::source::Source;
use crate::watch::watched;

/// Predicts a recording by a repaired model (JSON): names, and for each run its label, inputs, predictions and their sigmas.
#[pyfunction]
#[pyo3(signature = (model, source, simulator, threads))]
pub(crate) fn predict<'py>(
    py: Python<'py>,
    model: &str,
    source: &Source,
    simulator: Option<&Simulator>,
    threads: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let function = simulator.map(|simulator| simulator.function(py));
    let source = &source.0;
    let unread = |why: String| RepairError::NotAModel { file: "the model".into(), why };
    let repair: Repair = serde_json::from_str(model).map_err(|e| Failed::from(unread(e.to_string())))?;
    if repair.format != 1 {
        return Err(Failed::from(unread(format!("its format is {}", repair.format))).into());
    }
    let predicted = watched(py, threads, None, function.as_ref(), |_| {
        let (domain, loaded) = load(source, function.as_ref(), true)?;
        Ok(repair.predict_loaded(domain, loaded, &source.name())?)
    })?;
    let answer = PyDict::new(py);
    let recording = &predicted.recording;
    answer.set_item("variables", recording.variables.iter().map(|v| v.name.as_str()).collect::<Vec<_>>())?;
    answer.set_item("channels", recording.channels.iter().map(|c| c.name.as_str()).collect::<Vec<_>>())?;
    answer.set_item("noise", repair.model.noise.iter().map(|n| n.sigma).collect::<Vec<_>>())?;
    let columns = |all: &[Vec<f64>]| all.iter().map(|c| array(py, c)).collect::<Vec<_>>();
    let runs = recording.runs.iter().zip(&predicted.runs).map(|(run, said)| {
        (run.label.as_str(), columns(&run.inputs), columns(&said.channels), columns(&said.sigma))
    });
    answer.set_item("runs", runs.collect::<Vec<_>>())?;
    Ok(answer)
}

/// The domains with what they read and the mechanisms that they know, as JSON.
#[pyfunction]
pub(crate) fn domains() -> String {
    let mechanism = |m: &missing_physics::model::Mechanism| json!({"id": m.id, "name": m.name, "explanation": m.explanation, "equation": m.equation, "reference": m.reference});
    let described = all().iter().map(|domain| {
        let spec = domain.spec();
        json!({
            "id": domain.id(),
            "summary": domain.summary(),
            "baseline": spec.baseline,
            "reads": domain.reads(),
            "columns": domain.columns().iter().map(|c| json!({"name": c.name, "what": c.what})).collect::<Vec<_>>(),
            "mechanisms": spec.mechanisms.iter().filter(|m| !m.between_runs).map(mechanism).collect::<Vec<_>>(),
        })
    });
    serde_json::Value::Array(described.collect()).to_string()
}

/// The unit that a name ends in (`"z_m"`: `"m"`), or nothing.
#[pyfunction]
pub(crate) fn unit_of(name: &str) -> &'static str {
    missing_physics_domains::recording::unit_of(name)
}

/// The version of the crates.
#[pyfunction]
pub(crate) fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}
