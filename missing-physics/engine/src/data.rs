//! A recording as the engine sees it: runs of rows, with known inputs and measured channels.

use std::collections::HashSet;

use crate::quantity::Quantity;

/// One run: the unit that is left out when a fit is judged on data that it has not seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Label, unique in the recording.
    pub label: String,
    /// Known inputs, one column for each of [`Recording::variables`].
    pub inputs: Vec<Vec<f64>>,
    /// Measurements, one column for each of [`Recording::channels`]; NaN where a row was not measured.
    pub outputs: Vec<Vec<f64>>,
    /// What kind of run it is, for models that know several; 0 for ordinary ones.
    pub kind: u32,
}

impl Run {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.inputs.first().or(self.outputs.first()).map_or(0, Vec::len)
    }

    /// Whether the run has no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A recording: runs that share channels and variables.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// What was measured.
    pub channels: Vec<Quantity>,
    /// What is known without error.
    pub variables: Vec<Quantity>,
    /// The runs.
    pub runs: Vec<Run>,
    /// Index of the variable along which noise may be correlated (time, mostly); `None`: the order of rows.
    pub noise_along: Option<usize>,
    /// One sigma of each channel from a calibration, where there was one.
    pub calibration: Vec<Option<f64>>,
    /// The smallest step between two readings of each channel, where known (zero: not known).
    pub resolution: Vec<f64>,
}

/// What is wrong with a [`Recording`].
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RecordingError {
    /// There is no run, or no channel.
    #[error("a recording needs at least one run and one channel; it has {runs} runs and {channels} channels")]
    Empty {
        /// Number of runs.
        runs: usize,
        /// Number of channels.
        channels: usize,
    },
    /// Two runs have one label.
    #[error("the label {label} stands for two runs, expected another for each")]
    Label {
        /// The label.
        label: String,
    },
    /// A column is missing or has another length than the run's first one.
    #[error("run {run}: column {column} has {got} rows, expected {expected}")]
    Shape {
        /// Label of the run.
        run: String,
        /// Name of the column.
        column: String,
        /// Rows expected.
        expected: usize,
        /// Rows found.
        got: usize,
    },
    /// A known input is not a finite number.
    #[error("run {run}: input {column} is {value} at row {row}, expected a finite number")]
    Input {
        /// Label of the run.
        run: String,
        /// Name of the column.
        column: String,
        /// Row, from 0.
        row: usize,
        /// The value.
        value: f64,
    },
    /// The variable along which noise may be correlated is none of the recording's.
    #[error("noise is said to run along variable {index}, the recording has {variables}")]
    NoiseAlong {
        /// The index.
        index: usize,
        /// Number of variables.
        variables: usize,
    },
    /// A calibration that is not above zero.
    #[error("the calibrated sigma of {channel} is {value}, expected a number above zero")]
    Calibration {
        /// Name of the channel.
        channel: String,
        /// The value.
        value: f64,
    },
}

impl Recording {
    /// Checks shapes and numbers.
    ///
    /// # Errors
    /// The first [`RecordingError`] found.
    pub fn check(&self) -> Result<(), RecordingError> {
        if self.runs.is_empty() || self.channels.is_empty() {
            return Err(RecordingError::Empty { runs: self.runs.len(), channels: self.channels.len() });
        }
        for (channel, sigma) in self.channels.iter().zip(&self.calibration) {
            if let Some(value) = *sigma
                && !(value > 0.0 && value.is_finite())
            {
                return Err(RecordingError::Calibration { channel: channel.name.clone(), value });
            }
        }
        let variables = self.variables.len();
        if let Some(index) = self.noise_along.filter(|&index| index >= variables) {
            return Err(RecordingError::NoiseAlong { index, variables });
        }
        let mut labels = HashSet::new();
        if let Some(twice) = self.runs.iter().find(|run| !labels.insert(&run.label)) {
            return Err(RecordingError::Label { label: twice.label.clone() });
        }
        for run in &self.runs {
            let expected = run.len();
            let columns =
                self.variables.iter().zip(&run.inputs).chain(self.channels.iter().zip(&run.outputs));
            let counts = [(run.inputs.len(), self.variables.len()), (run.outputs.len(), self.channels.len())];
            if counts.iter().any(|(got, expected)| got != expected) {
                return Err(RecordingError::Shape {
                    run: run.label.clone(),
                    column: "(number of columns)".into(),
                    expected: counts[0].1 + counts[1].1,
                    got: counts[0].0 + counts[1].0,
                });
            }
            for (quantity, column) in columns {
                if column.len() != expected {
                    return Err(RecordingError::Shape {
                        run: run.label.clone(),
                        column: quantity.name.clone(),
                        expected,
                        got: column.len(),
                    });
                }
            }
            for (quantity, column) in self.variables.iter().zip(&run.inputs) {
                if let Some(row) = column.iter().position(|v| !v.is_finite()) {
                    return Err(RecordingError::Input {
                        run: run.label.clone(),
                        column: quantity.name.clone(),
                        row,
                        value: column[row],
                    });
                }
            }
        }
        Ok(())
    }
}
