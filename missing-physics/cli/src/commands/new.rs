//! `new`: a commented recording to begin from.

use std::path::Path;

use super::error::{CommandError, write_whole};
use missing_physics_domains as domains;

/// Writes a template of a domain into a folder that is new or empty.
///
/// # Errors
/// [`CommandError`] for an unknown domain or a folder that holds something.
pub fn new(domain: &str, folder: &Path) -> Result<String, CommandError> {
    let domain = domains::find(domain)?;
    let fail = |error| CommandError::Io { path: folder.into(), error };
    if folder.exists() {
        let empty = folder.is_dir() && std::fs::read_dir(folder).map_err(fail)?.next().is_none();
        if !empty {
            return Err(CommandError::NotEmpty { folder: folder.into() });
        }
    }
    std::fs::create_dir_all(folder).map_err(fail)?;
    let template = domain.template();
    write_whole(&folder.join("recording.toml"), template.header)?;
    write_whole(&folder.join(template.data.0), template.data.1)?;
    Ok(format!(
        "{0}: a template of the domain {1}. Put your rows into {2} and what you know into recording.toml, then:\n  \
         missing-physics check {0}\n  missing-physics diagnose {0}\n",
        folder.display(),
        domain.id(),
        template.data.0
    ))
}
