//! The repaired model in a file: written by a diagnosis, used by whoever wants to simulate with what was found.
//!
//! ```no_run
//! use missing_physics_domains::repair::Repair;
//!
//! let repair = Repair::read("model.json".as_ref())?;
//! let predicted = repair.predict("next-recording".as_ref())?;
//! println!("{:?} +- {:?}", predicted.runs[0].channels[0], predicted.runs[0].sigma[0]);
//! # Ok::<(), missing_physics_domains::repair::RepairError>(())
//! ```

use std::path::Path;

use missing_physics::data::Recording;
use missing_physics::diagnosis::{Diagnosis, Verdict};
use missing_physics::repaired::{PredictedRun, Repaired, RepairedError};
use serde::{Deserialize, Serialize};

use crate::domain::{Domain, Loaded};
use crate::recording::{ReadError, Source, one_line, read_text};

/// A repaired model of a domain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Repair {
    /// Format of the file: 1.
    pub format: u32,
    /// The domain whose simulation it repairs.
    pub domain: String,
    /// The verdict of the diagnosis that it is from; none in files of versions that did not say it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub verdict: Option<Verdict>,
    /// What is on, and by how much.
    pub model: Repaired,
}

/// A recording and what a repaired model says of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Predicted {
    /// The recording; NaN where nothing was measured.
    pub recording: Recording,
    /// What the model says, run by run.
    pub runs: Vec<PredictedRun>,
}

/// Why there is no repaired model, or no prediction.
#[derive(Debug, thiserror::Error)]
pub enum RepairError {
    /// A file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The file is no repaired model.
    #[error("{file}: no repaired model of format 1 ({why})")]
    NotAModel {
        /// The file.
        file: String,
        /// What is wrong with it.
        why: String,
    },
    /// The recording is of another domain.
    #[error("{folder}: a recording of the domain {got}, expected {expected} as in the model")]
    OtherDomain {
        /// The recording's folder.
        folder: String,
        /// Its domain.
        got: &'static str,
        /// The model's domain.
        expected: String,
    },
    /// The domain has no channels to predict.
    #[error(
        "the domain {domain} judges errors that it has whitened, not channels: its repaired model predicts none"
    )]
    NoChannels {
        /// The domain.
        domain: &'static str,
    },
    /// The model and the recording do not fit.
    #[error("{folder}: {error}")]
    Model {
        /// The recording's folder.
        folder: String,
        /// Why.
        error: RepairedError,
    },
}

impl Repair {
    /// The model that a diagnosis ended with.
    pub fn new(domain: &dyn Domain, diagnosis: &Diagnosis) -> Self {
        Self {
            format: 1,
            domain: domain.id().into(),
            verdict: Some(diagnosis.verdict),
            model: diagnosis.repaired.clone(),
        }
    }

    /// What whoever predicts by this model should know, one sentence; none where the diagnosis left nothing open.
    pub fn caveat(&self) -> Option<&'static str> {
        match self.verdict? {
            Verdict::Adequate | Verdict::Explained => None,
            Verdict::Ambiguous => Some(
                "the model is one of several that explained its recording equally well: in other conditions they may predict otherwise",
            ),
            Verdict::Partly => {
                Some("the model leaves a part of its recording unexplained, which its intervals do not hold")
            }
            Verdict::Unexplained if self.model.law.is_some() => Some(
                "the model holds an empirical law of an unexplained recording: beyond the conditions recorded there it says nothing",
            ),
            Verdict::Unexplained => Some(
                "the model is the plain simulation, which does not explain the recording that it was fitted to, and no other does",
            ),
        }
    }

    /// The model as JSON.
    pub fn to_json(&self) -> String {
        // Numbers, texts and lists always serialise.
        let mut text = serde_json::to_string_pretty(self).unwrap_or_default();
        text.push('\n');
        text
    }

    /// Reads a model.
    ///
    /// # Errors
    /// [`RepairError::Read`], [`RepairError::NotAModel`].
    pub fn read(path: &Path) -> Result<Self, RepairError> {
        let text = read_text(path)?;
        let not = |why: String| RepairError::NotAModel { file: path.display().to_string(), why };
        let repair: Self = serde_json::from_str(&text).map_err(|e| not(one_line(&e.to_string())))?;
        if repair.format != 1 {
            return Err(not(format!("its format is {}", repair.format)));
        }
        Ok(repair)
    }

    /// Predicts the recording in a folder, whose cells may be empty where nothing was measured: the shared parameters are the
    /// model's, what each run has for itself (where it began) is fitted to its measured rows.
    ///
    /// # Errors
    /// [`RepairError`].
    pub fn predict(&self, folder: &Path) -> Result<Predicted, RepairError> {
        self.predict_source(&Source::folder(folder))
    }

    /// As [`Repair::predict`], for a recording in a folder or in memory.
    ///
    /// # Errors
    /// [`RepairError`].
    pub fn predict_source(&self, source: &Source) -> Result<Predicted, RepairError> {
        let (domain, loaded) = crate::registry::load_with_gaps(source)?;
        self.predict_loaded(domain, loaded, &source.name())
    }

    /// As [`Repair::predict`], for a recording of a domain that was read before; errors begin with its name.
    ///
    /// # Errors
    /// [`RepairError`], but for what can be wrong with files.
    pub fn predict_loaded(
        &self,
        domain: &dyn Domain,
        loaded: Loaded,
        name: &str,
    ) -> Result<Predicted, RepairError> {
        let name = || name.to_owned();
        if domain.id() != self.domain {
            let (got, expected) = (domain.id(), self.domain.clone());
            return Err(RepairError::OtherDomain { folder: name(), got, expected });
        }
        if !domain.predicts() {
            return Err(RepairError::NoChannels { domain: domain.id() });
        }
        let runs = self
            .model
            .predict(&*loaded.model, &loaded.recording)
            .map_err(|error| RepairError::Model { folder: name(), error })?;
        Ok(Predicted { recording: loaded.recording, runs })
    }
}
