//! The domains: what each reads, and the full model that it puts before the engine.

pub mod bounce;
mod builder;
pub mod custom;
pub mod dough_roll;
mod dual;
pub mod grain_pour;
pub mod indentation;
mod kept;
pub mod liquid_tilt;
mod reading;
pub mod slosh;
pub mod trajectory;

use missing_physics::data::Recording;
use missing_physics::model::{Experiment, Model, Spec};

use crate::recording::{Header, ReadError};

/// Standard gravity, m/s^2 (CGPM 1901).
const GRAVITY_M_S2: f64 = 9.80665;

/// A recording that was read, with the model of its set-up.
pub struct Loaded {
    /// The data.
    pub recording: Recording,
    /// The full model.
    pub model: Box<dyn Model + Send>,
    /// What the rig could do next.
    pub experiments: Vec<Experiment>,
    /// What such data cannot determine, one sentence each.
    pub undetermined: Vec<String>,
    /// Impacts, where they were heard in sound.
    pub impacts: Vec<Impact>,
}

/// An impact that was heard.
#[derive(Debug, Clone, PartialEq)]
pub struct Impact {
    /// Label of the run.
    pub run: String,
    /// When, s since the beginning of the sound.
    pub t_s: f64,
    /// Where on the table, m, where there were microphones enough.
    pub place_m: Option<[f64; 2]>,
}

impl std::fmt::Debug for Loaded {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Loaded").field("recording", &self.recording).finish_non_exhaustive()
    }
}

/// A template for a new recording.
#[derive(Debug, Clone, Copy)]
pub struct Template {
    /// Contents of `recording.toml`.
    pub header: &'static str,
    /// Name and contents of the data file.
    pub data: (&'static str, &'static str),
}

/// One domain of RECORDINGS: its files, its physics.
pub trait Domain: Sync {
    /// Identifier (`trajectory`).
    fn id(&self) -> &'static str;
    /// What it is, in one sentence.
    fn summary(&self) -> &'static str;
    /// The files, columns and keys that it reads, a line each.
    fn reads(&self) -> &'static [(&'static str, &'static str)];
    /// The fullest model of the domain, for `domains`.
    fn spec(&self) -> Spec;
    /// A recording to begin from.
    fn template(&self) -> Template;
    /// Whether its channels are what is measured, so that a model of them can predict a run; false where the engine is shown
    /// errors that the domain has whitened.
    fn predicts(&self) -> bool {
        true
    }
    /// Reads the recording that a header describes.
    ///
    /// # Errors
    /// [`ReadError`].
    fn load(&self, header: &Header) -> Result<Loaded, ReadError>;
}

/// All domains of this version.
pub fn all() -> &'static [&'static dyn Domain] {
    &[
        &trajectory::Trajectory,
        &liquid_tilt::LiquidTilt,
        &slosh::Slosh,
        &indentation::Indentation,
        &bounce::Bounce,
        &dough_roll::DoughRoll,
        &grain_pour::GrainPour,
        &custom::Custom,
    ]
}

/// The domain of an identifier.
///
/// # Errors
/// A sentence that names the domains there are.
pub fn find(id: &str) -> Result<&'static dyn Domain, String> {
    let known: Vec<&str> = all().iter().map(|d| d.id()).collect();
    match all().iter().find(|d| d.id() == id) {
        Some(domain) => Ok(*domain),
        None => Err(format!(
            "unknown domain {}, expected one of: {}",
            crate::recording::quoted(id),
            known.join(", ")
        )),
    }
}

/// Reads the recording in a folder.
///
/// # Errors
/// [`ReadError`].
pub fn load(folder: &std::path::Path) -> Result<(&'static dyn Domain, Loaded), ReadError> {
    load_with(&Header::read(folder)?)
}

/// Reads a recording in whose table cells may be empty, where nothing was measured: what is to be predicted.
///
/// # Errors
/// [`ReadError`].
pub fn load_with_gaps(folder: &std::path::Path) -> Result<(&'static dyn Domain, Loaded), ReadError> {
    load_with(&Header::read_with_gaps(folder)?)
}

fn load_with(header: &Header) -> Result<(&'static dyn Domain, Loaded), ReadError> {
    let known: Vec<&str> = all().iter().map(|d| d.id()).collect();
    let expected = format!("one of: {}", known.join(", "));
    let id = header.root().text("domain", &expected)?;
    let domain = find(id).map_err(|_| ReadError::Value {
        file: header.file.clone(),
        key: "domain".into(),
        got: crate::recording::quoted(id),
        expected,
    })?;
    let loaded = domain.load(header)?;
    header.finish()?;
    Ok((domain, loaded))
}
