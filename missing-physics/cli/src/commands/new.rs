//! `new`: a commented recording to begin from.

use std::path::Path;

use super::error::CommandError;
use super::output::write_new;
use missing_physics_domains as domains;

/// Writes a template of a domain into a folder that is new or empty.
///
/// # Errors
/// [`CommandError`] for an unknown domain or a folder that holds something.
pub fn new(domain: &str, folder: &Path) -> Result<String, CommandError> {
    let domain = domains::find(domain)?;
    fresh(folder)?;
    let template = domain.template();
    write_new(&folder.join("recording.toml"), template.header)?;
    write_new(&folder.join(template.data.0), template.data.1)?;
    for (name, contents) in domain.template_files() {
        write_new(&folder.join(name), contents)?;
    }
    Ok(format!(
        "{0}: a template of the domain {1}. Put your rows into {2} and what you know into recording.toml, then:\n  \
         missing-physics check {0}\n  missing-physics diagnose {0}\n",
        folder.display(),
        domain.id(),
        template.data.0
    ))
}

/// Makes a folder, if it is not there; says whether it made one.
///
/// # Errors
/// [`CommandError::NotEmpty`], or what the file system says.
pub(super) fn fresh(folder: &Path) -> Result<bool, CommandError> {
    let fail = |error| CommandError::Io { path: folder.into(), error };
    let there = folder.exists();
    if there {
        let empty = folder.is_dir() && std::fs::read_dir(folder).map_err(fail)?.next().is_none();
        if !empty {
            return Err(CommandError::NotEmpty { folder: folder.into() });
        }
    }
    std::fs::create_dir_all(folder).map_err(fail)?;
    Ok(!there)
}
