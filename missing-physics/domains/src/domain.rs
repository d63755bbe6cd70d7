//! What a domain is, and what it makes of a recording.

use std::collections::BTreeMap;
use std::sync::Arc;

use missing_physics::data::{Recording, Run};
use missing_physics::diagnosis::Diagnosis;
use missing_physics::engine::{DiagnoseError, Options, diagnose};
use missing_physics::model::{Experiment, Model, Quantity, Spec};
use missing_physics::observer::{Observer, Silent};
use missing_physics_report::Figure;

use crate::recording::{Column, ColumnContents, Header, ReadError};

/// The thesis whose rigs the domains follow, in full; mechanisms cite it by the key with which this begins.
pub const THESIS: &str = "[Matl 2021] Carolyn Chen Matl, Interactive Perception for Robotic Manipulation of Liquids, Grains, and \
     Doughs, dissertation (Doctor of Philosophy), University of California, Berkeley, 2021";

/// One domain: its files, its physics.
pub trait Domain: Sync {
    /// Identifier (`trajectory`).
    fn id(&self) -> &'static str;
    /// What it is, in one sentence.
    fn summary(&self) -> &'static str;
    /// The files, columns and keys that it reads, a line each.
    fn reads(&self) -> &'static [(&'static str, &'static str)];
    /// The columns of its table; none where the recording itself names them.
    fn columns(&self) -> &'static [Column<'static>] {
        &[]
    }
    /// What the columns of numbers are in words, without their units, by name (`z_m`: `height`).
    fn words(&self) -> BTreeMap<String, String> {
        let words = |c: &Column<'_>| {
            let end = c.what.find([',', '(']).unwrap_or(c.what.len());
            c.what[..end].split(" in ").next().unwrap_or_default().trim().to_owned()
        };
        let columns: Vec<(&str, String)> =
            self.columns().iter().filter(|c| !c.label).map(|c| (c.name, words(c))).collect();
        let alike = |of: &str| columns.iter().filter(|(_, words)| words == of).count() > 1;
        let told_apart = |(name, words): &(&str, String)| {
            // The coordinate: `x` of `x_m` and of `spin_x_rad_s`.
            let axis = name.split('_').find(|part| part.len() == 1).filter(|_| alike(words));
            let words = axis.map_or_else(|| words.clone(), |axis| format!("{words} {axis}"));
            ((*name).to_owned(), words)
        };
        columns.iter().map(told_apart).collect()
    }
    /// The fullest model of the domain, for `domains`.
    fn spec(&self) -> Spec;
    /// A recording to begin from.
    fn template(&self) -> Template;
    /// Files that the template's table names: name and contents.
    fn template_files(&self) -> &'static [(&'static str, &'static [u8])] {
        &[]
    }
    /// Whether its channels are what is measured, so that a model of them can predict a run; false where the engine is shown
    /// errors that the domain has whitened.
    fn predicts(&self) -> bool {
        true
    }
    /// Reads and validates the recording that a header describes: nothing is learned, drawn or simulated for it.
    ///
    /// # Errors
    /// [`ReadError`].
    fn read(&self, header: &Header) -> Result<CheckedRecording, ReadError>;
}

/// A template for a new recording.
#[derive(Debug, Clone, Copy)]
pub struct Template {
    /// Contents of `recording.toml`.
    pub header: &'static str,
    /// Name and contents of the data file.
    pub data: (&'static str, &'static str),
}

/// A recording that was read and found sound, and what is still to be learned, drawn or simulated for it.
pub struct CheckedRecording {
    /// What the recording holds.
    pub contents: Contents,
    /// What looks like a mistake in a unit or a sign, a sentence each.
    pub hints: Vec<String>,
    /// The columns of the table that hold numbers.
    pub columns: Vec<ColumnContents>,
    prepare: Box<Prepare>,
}

/// What is still to be done for a recording, watched as it goes on.
type Prepare = dyn FnOnce(&dyn Observer) -> Result<Loaded, ReadError> + Send;

impl CheckedRecording {
    /// A recording whose model takes some work, done by `prepare`.
    pub fn new(
        contents: Contents,
        prepare: impl FnOnce() -> Result<Loaded, ReadError> + Send + 'static,
    ) -> Self {
        Self::long(contents, move |_| prepare())
    }

    /// As [`CheckedRecording::new`], where the work is long: it tells how far it is.
    pub fn long(
        contents: Contents,
        prepare: impl FnOnce(&dyn Observer) -> Result<Loaded, ReadError> + Send + 'static,
    ) -> Self {
        Self { contents, hints: Vec::new(), columns: Vec::new(), prepare: Box::new(prepare) }
    }

    /// The same recording with what looks like a mistake in it.
    pub fn with_hints(mut self, hints: impl IntoIterator<Item = String>) -> Self {
        self.hints.extend(hints);
        self
    }

    /// Does that work: learns and simulates what the recording's model needs.
    ///
    /// # Errors
    /// [`ReadError::Unfit`] where that cannot be done with this recording, or what is wrong with its rows.
    pub fn prepare(self) -> Result<Loaded, ReadError> {
        self.prepare_watched(&Silent)
    }

    /// As [`CheckedRecording::prepare`], watched.
    ///
    /// # Errors
    /// As [`CheckedRecording::prepare`], and [`ReadError::Unfit`] where the observer stops long work.
    pub fn prepare_watched(self, observer: &dyn Observer) -> Result<Loaded, ReadError> {
        let mut loaded = (self.prepare)(observer)?;
        loaded.hints = self.hints;
        Ok(loaded)
    }
}

impl From<Loaded> for CheckedRecording {
    /// A recording whose model is a formula: nothing is left to do.
    fn from(loaded: Loaded) -> Self {
        let recording = &loaded.recording;
        let contents = Contents {
            channels: recording.channels.clone(),
            calibration: recording.calibration.clone(),
            variable: recording.variables.first().cloned().unwrap_or_else(|| Quantity::new("row", "")),
            runs: recording.runs.iter().map(RunContents::of).collect(),
            spec: loaded.model.spec().clone(),
        };
        Self::new(contents, || Ok(loaded))
    }
}

impl std::fmt::Debug for CheckedRecording {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("CheckedRecording").field("contents", &self.contents).finish_non_exhaustive()
    }
}

/// What a recording holds.
#[derive(Debug, Clone)]
pub struct Contents {
    /// What is measured.
    pub channels: Vec<Quantity>,
    /// The calibrated sigma of each channel, where there is one.
    pub calibration: Vec<Option<f64>>,
    /// The first of the variables that are known.
    pub variable: Quantity,
    /// The runs in the order of the file.
    pub runs: Vec<RunContents>,
    /// Parameters and mechanisms of its model; where these begin may yet change.
    pub spec: Spec,
}

/// What a run holds.
#[derive(Debug, Clone, PartialEq)]
pub struct RunContents {
    /// Its label.
    pub label: String,
    /// Number of its rows.
    pub rows: usize,
    /// The first variable in its first and its last row.
    pub from_to: [f64; 2],
}

impl RunContents {
    /// The contents of a run with some values of the first variable.
    pub fn new(label: &str, variable: &[f64]) -> Self {
        let end = |value: Option<&f64>| value.copied().unwrap_or(0.0);
        let from_to = [end(variable.first()), end(variable.last())];
        Self { label: label.to_owned(), rows: variable.len(), from_to }
    }

    pub(crate) fn of(run: &Run) -> Self {
        Self::new(&run.label, run.inputs.first().map_or(&[], Vec::as_slice))
    }
}

/// A recording with the model of its set-up.
pub struct Loaded {
    /// The data.
    pub recording: Recording,
    /// The full model.
    pub model: Arc<dyn Model + Send>,
    /// What the rig could do next.
    pub experiments: Vec<Experiment>,
    /// What such data cannot determine, one sentence each.
    pub undetermined: Vec<String>,
    /// What looks like a mistake in a unit or a sign, one sentence each.
    pub hints: Vec<String>,
    /// What the domain adds to the answer (impacts that were heard in sound), by the key it has there.
    pub additions: serde_json::Map<String, serde_json::Value>,
    draw: Option<Draw>,
}

/// Draws what the domain's people look at.
type Draw = Box<dyn Fn(&Diagnosis) -> Vec<Figure> + Send + Sync>;

impl Loaded {
    /// A recording with its model, to whose answer the domain adds nothing.
    pub fn new(
        recording: Recording,
        model: impl Model + Send + 'static,
        experiments: Vec<Experiment>,
        undetermined: Vec<String>,
    ) -> Self {
        let (hints, additions) = (Vec::new(), serde_json::Map::new());
        let model = Arc::new(model);
        Self { recording, model, experiments, undetermined, hints, additions, draw: None }
    }

    /// As [`Loaded::new`], with pictures that are drawn from the model and its diagnosis.
    pub fn drawn<M: Model + Send + 'static>(
        recording: Recording,
        model: M,
        experiments: Vec<Experiment>,
        undetermined: Vec<String>,
        draw: impl Fn(&M, &Diagnosis) -> Vec<Figure> + Send + Sync + 'static,
    ) -> Self {
        let (hints, additions) = (Vec::new(), serde_json::Map::new());
        let model = Arc::new(model);
        let shown = Arc::clone(&model);
        let draw: Option<Draw> = Some(Box::new(move |diagnosis| draw(&shown, diagnosis)));
        Self { recording, model, experiments, undetermined, hints, additions, draw }
    }

    /// The pictures that the domain's people look at, for a report: drawn from the recording and the fitted model.
    pub fn figures(&self, diagnosis: &Diagnosis) -> Vec<Figure> {
        self.draw.as_ref().map_or_else(Vec::new, |draw| draw(diagnosis))
    }
    /// Diagnoses the recording: what the engine finds, beside what the domain knows of such data and of this recording's units.
    ///
    /// # Errors
    /// As [`missing_physics::engine::diagnose`].
    pub fn diagnose(&self, options: &Options, observer: &dyn Observer) -> Result<Diagnosis, DiagnoseError> {
        let mut found = diagnose(&*self.model, &self.recording, &self.experiments, options, observer)?;
        found.undetermined.extend(self.undetermined.iter().cloned());
        found.remarks.extend(self.hints.iter().map(|hint| format!("look at the units: {hint}")));
        Ok(found)
    }
}

impl std::fmt::Debug for Loaded {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Loaded").field("recording", &self.recording).finish_non_exhaustive()
    }
}
