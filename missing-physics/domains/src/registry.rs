//! The domains there are, and recordings read by the one that they name.

use std::path::Path;

use missing_physics::observer::Observer;

use crate::domain::{CheckedRecording, Domain, Loaded};
use crate::recording::{Header, ReadError, Source, quoted};

/// All domains of this version that were compiled in.
pub fn all() -> &'static [&'static dyn Domain] {
    &[
        #[cfg(feature = "trajectory")]
        &crate::trajectory::Trajectory,
        #[cfg(feature = "liquid-tilt")]
        &crate::liquid_tilt::LiquidTilt,
        #[cfg(feature = "slosh")]
        &crate::slosh::Slosh,
        #[cfg(feature = "indentation")]
        &crate::indentation::Indentation,
        #[cfg(feature = "bounce")]
        &crate::bounce::Bounce,
        #[cfg(feature = "dough-roll")]
        &crate::dough_roll::DoughRoll,
        #[cfg(feature = "grain-pour")]
        &crate::grain_pour::GrainPour,
        #[cfg(feature = "motion")]
        &crate::motion::Motion,
        #[cfg(feature = "custom")]
        &crate::custom::Custom,
    ]
}

/// No domain has this identifier.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown domain {}, expected one of: {}", quoted(.id), .known.join(", "))]
pub struct UnknownDomain {
    /// The identifier that was asked for.
    pub id: String,
    /// The identifiers there are.
    pub known: Vec<&'static str>,
}

/// The domain of an identifier.
///
/// # Errors
/// [`UnknownDomain`], which names the domains there are.
pub fn find(id: &str) -> Result<&'static dyn Domain, UnknownDomain> {
    let found = all().iter().find(|d| d.id() == id).copied();
    found.ok_or_else(|| UnknownDomain { id: id.into(), known: known() })
}

/// Reads and validates the recording in a folder: nothing is learned, drawn or simulated for it.
///
/// # Errors
/// [`ReadError`].
pub fn check(folder: &Path) -> Result<(&'static dyn Domain, CheckedRecording), ReadError> {
    check_source(&Source::folder(folder))
}

/// As [`check`], for a recording in a folder or in memory.
///
/// # Errors
/// [`ReadError`].
pub fn check_source(source: &Source) -> Result<(&'static dyn Domain, CheckedRecording), ReadError> {
    read(&Header::read(source)?)
}

/// Reads the recording in a folder and makes its model.
///
/// # Errors
/// [`ReadError`].
pub fn load(folder: &Path) -> Result<(&'static dyn Domain, Loaded), ReadError> {
    load_source(&Source::folder(folder))
}

/// As [`load`], watched where that takes long.
///
/// # Errors
/// As [`CheckedRecording::prepare_watched`].
pub fn load_watched(
    folder: &Path,
    observer: &dyn Observer,
) -> Result<(&'static dyn Domain, Loaded), ReadError> {
    let (domain, checked) = check(folder)?;
    Ok((domain, checked.prepare_watched(observer)?))
}

/// As [`load`], for a recording in a folder or in memory.
///
/// # Errors
/// [`ReadError`].
pub fn load_source(source: &Source) -> Result<(&'static dyn Domain, Loaded), ReadError> {
    let (domain, checked) = check_source(source)?;
    Ok((domain, checked.prepare()?))
}

/// Reads a recording in whose table cells may be empty, where nothing was measured, and makes its model: what is to be predicted.
///
/// # Errors
/// [`ReadError`].
pub fn load_with_gaps(source: &Source) -> Result<(&'static dyn Domain, Loaded), ReadError> {
    let (domain, checked) = read(&Header::read_with_gaps(source)?)?;
    Ok((domain, checked.prepare()?))
}

fn read(header: &Header) -> Result<(&'static dyn Domain, CheckedRecording), ReadError> {
    let expected = format!("one of: {}", known().join(", "));
    let id = header.root().text("domain", &expected)?;
    let domain = find(id).map_err(|_| header.root().unfit("domain", quoted(id), expected))?;
    let mut checked = domain.read(header)?;
    header.finish()?;
    checked.columns = header.columns();
    checked.hints.extend(header.placeholders());
    Ok((domain, checked))
}

fn known() -> Vec<&'static str> {
    all().iter().map(|d| d.id()).collect()
}
