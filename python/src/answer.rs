//! A recording in, everything that is said of it out.

use std::sync::Arc;

use missing_physics::engine::Options;
use missing_physics_domains::repair::Repair;
use missing_physics_domains::{Domain, Loaded, THESIS, custom, find, load_source, load_with_gaps, recording};
use missing_physics_report::{self as report, ReportContext};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Value, json};

use crate::array::array;
use crate::errors::Failed;
use crate::function::{Function, Simulator};
use crate::source::Source;
use crate::watch::watched;

/// Reads a recording, with the function that predicts it where there is one.
pub(crate) fn load(
    source: &recording::Source,
    function: Option<&Arc<Function>>,
    gaps: bool,
) -> Result<(&'static dyn Domain, Loaded), Failed> {
    let Some(function) = function else {
        return Ok(if gaps { load_with_gaps(source) } else { load_source(source) }?);
    };
    let domain = find("custom").map_err(|e| Failed::new("RecordingError", e.to_string()))?;
    let function: Arc<Function> = Arc::clone(function);
    Ok((domain, custom::load_with(source, function, gaps)?))
}

/// Diagnoses a recording: the answer as JSON, text, page, picture and repaired model, and the curves.
#[pyfunction]
#[pyo3(signature = (source, simulator, seed, alpha, threads, progress))]
pub(crate) fn diagnose<'py>(
    py: Python<'py>,
    source: &Source,
    simulator: Option<&Simulator>,
    seed: u64,
    alpha: f64,
    threads: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let function = simulator.map(|simulator| simulator.function(py));
    let source = &source.0;
    let options = Options { seed, ..Options::with_alpha(alpha) };
    let (domain, found, context) = watched(py, threads, progress.as_ref(), function.as_ref(), |observer| {
        let (domain, loaded) = load(source, function.as_ref(), false)?;
        let found = loaded.diagnose(&options, observer)?;
        let figures = loaded.figures(&found);
        let context = ReportContext {
            domain: domain.id().into(),
            recording: source.name(),
            title: title(source),
            citations: vec![THESIS.into()],
            words: domain.words(),
            additions: loaded.additions,
            figures,
            provenance: provenance(source, &options),
        };
        Ok((domain, found, context))
    })?;
    let answer = PyDict::new(py);
    answer.set_item("json", report::json(&found, &context))?;
    answer.set_item("text", report::text(&found, &context))?;
    answer.set_item("html", report::html(&found, &context))?;
    answer.set_item("svg", report::picture(&found, &context))?;
    let repair = Repair::new(domain, &found);
    answer.set_item("model", domain.predicts().then(|| repair.to_json()))?;
    answer.set_item("caveat", repair.caveat())?;
    answer.set_item("variables", &found.variables)?;
    answer.set_item("channels", &found.channels)?;
    let columns = |all: &[Vec<f64>]| all.iter().map(|c| array(py, c)).collect::<Vec<_>>();
    let curves = found.curves.iter().map(|c| {
        (c.run.as_str(), columns(&c.inputs), columns(&c.measured), columns(&c.before), columns(&c.after))
    });
    answer.set_item("curves", curves.collect::<Vec<_>>())?;
    Ok(answer)
}

/// As the command has it: version, seed, alpha, and what was read.
fn provenance(source: &recording::Source, options: &Options) -> Value {
    let sha256 = source.sha256();
    json!({"version": env!("CARGO_PKG_VERSION"), "seed": options.seed, "alpha": options.alpha, "sha256": sha256})
}

/// The folder's own name, as the command has it.
fn title(source: &recording::Source) -> String {
    let recording::Source::Folder(folder) = source else { return source.name() };
    folder.file_name().map_or_else(|| "recording".into(), |name| name.to_string_lossy().into_owned())
}
