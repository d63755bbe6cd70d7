//! Recordings as Python hands them over.

use std::path::PathBuf;

use missing_physics_domains::recording::{self, Memory, Values};
use pyo3::prelude::*;

use crate::array::column;
use crate::errors::Failed;

/// The table of a recording that is handed over as arrays.
const TABLE: &str = "data.csv";

/// A recording: a folder, or a header with columns and files that are in memory.
#[pyclass(frozen, module = "missing_physics._engine")]
pub(crate) struct Source(pub(crate) recording::Source);

#[pymethods]
impl Source {
    /// A recording in a folder.
    #[staticmethod]
    fn folder(path: PathBuf) -> Self {
        Self(recording::Source::folder(path))
    }

    /// A recording in memory: the header as JSON, columns (labels as a list of texts, numbers as an array) and further files.
    #[staticmethod]
    fn memory(
        name: &str,
        header: &str,
        columns: Vec<(String, Bound<'_, PyAny>)>,
        files: Vec<(String, Vec<u8>)>,
    ) -> PyResult<Self> {
        let wrong = |why: String| PyErr::from(Failed::new("RecordingError", format!("{name}: {why}")));
        let header: toml::Table = serde_json::from_str(header).map_err(|e| wrong(e.to_string()))?;
        let header = toml::to_string(&header).map_err(|e| wrong(e.to_string()))?;
        let mut memory = Memory::new(name).with_file("recording.toml", header);
        if !columns.is_empty() {
            let values = columns.into_iter().map(|(name, value)| {
                let values = match value.extract::<Vec<String>>() {
                    Ok(labels) => Values::Labels(labels),
                    Err(_) => Values::Numbers(column(&value, &name)?),
                };
                Ok((name, values))
            });
            memory = memory.with_columns(TABLE, values.collect::<PyResult<Vec<_>>>()?);
        }
        for (name, bytes) in files {
            memory = memory.with_file(&name, bytes);
        }
        Ok(Self(recording::Source::Memory(memory)))
    }

    /// The recording's name, as errors begin with it.
    #[getter]
    fn name(&self) -> String {
        self.0.name()
    }

    /// The program that the recording of a folder starts, with its arguments, where it names one.
    #[getter]
    fn program(&self) -> Option<Vec<String>> {
        match &self.0 {
            recording::Source::Folder(folder) => recording::program_of(folder),
            recording::Source::Memory(_) => None,
        }
    }
}
