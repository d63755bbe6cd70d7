//! The domains of `missing-physics`: what a recording of each holds, and the full model that is put before the engine.
//!
//! [`recording`] reads files, a folder a domain makes a model of them, [`repair`] keeps the repaired model in a file. Each domain
//! has a cargo feature of its name.
#![cfg_attr(
    not(all(
        feature = "bounce",
        feature = "custom",
        feature = "dough-roll",
        feature = "grain-pour",
        feature = "indentation",
        feature = "liquid-tilt",
        feature = "slosh",
        feature = "trajectory"
    )),
    allow(
        dead_code,
        unused_imports,
        reason = "helpers that several domains share are compiled whichever of them are asked for"
    )
)]

#[cfg(feature = "bounce")]
pub mod bounce;
mod builder;
#[cfg(feature = "custom")]
pub mod custom;
#[cfg(feature = "dough-roll")]
pub mod dough_roll;
#[cfg(any(feature = "indentation", feature = "trajectory"))]
mod dual;
#[cfg(feature = "grain-pour")]
pub mod grain_pour;
#[cfg(feature = "indentation")]
pub mod indentation;
#[cfg(any(feature = "dough-roll", feature = "liquid-tilt"))]
mod kept;
#[cfg(feature = "liquid-tilt")]
pub mod liquid_tilt;
mod reading;
pub mod recording;
pub mod repair;
#[cfg(feature = "slosh")]
pub mod slosh;
#[cfg(feature = "trajectory")]
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
    /// What the domain adds to the answer (impacts that were heard in sound), by the key it has there.
    pub additions: serde_json::Map<String, serde_json::Value>,
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
        #[cfg(feature = "trajectory")]
        &trajectory::Trajectory,
        #[cfg(feature = "liquid-tilt")]
        &liquid_tilt::LiquidTilt,
        #[cfg(feature = "slosh")]
        &slosh::Slosh,
        #[cfg(feature = "indentation")]
        &indentation::Indentation,
        #[cfg(feature = "bounce")]
        &bounce::Bounce,
        #[cfg(feature = "dough-roll")]
        &dough_roll::DoughRoll,
        #[cfg(feature = "grain-pour")]
        &grain_pour::GrainPour,
        #[cfg(feature = "custom")]
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
        None => {
            Err(format!("unknown domain {}, expected one of: {}", recording::quoted(id), known.join(", ")))
        }
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
        got: recording::quoted(id),
        expected,
    })?;
    let loaded = domain.load(header)?;
    header.finish()?;
    Ok((domain, loaded))
}
