//! `import`: a laboratory's files in, a recording out.

use std::path::Path;

use missing_physics_import::{Request, import as make, survey};

use super::error::CommandError;
use super::list::check;
use super::new::fresh;
use super::output::write_new;

/// Makes a recording of files in a folder that is new or empty, and checks it; without a folder it says what it would make, and without
/// a domain what the files hold.
///
/// # Errors
/// [`CommandError`]; nothing is left behind then.
pub fn import(request: &Request, domain: Option<&str>, out: Option<&Path>) -> Result<String, CommandError> {
    let Some(domain) = domain else {
        let known: Vec<&str> = missing_physics_domains::all().iter().map(|d| d.id()).collect();
        let next = format!("\nsay what it is a recording of: --domain {}\n", known.join(" | "));
        return Ok(survey(&request.files)? + &next);
    };
    let imported = make(&Request { domain: domain.to_owned(), ..request.clone() })?;
    let Some(out) = out else {
        return Ok(imported.text + "\nnothing is written: say where to by --out FOLDER\n");
    };
    let made = fresh(out)?;
    let written = || -> Result<String, CommandError> {
        write_new(&out.join("recording.toml"), &imported.header)?;
        if let Some((name, table)) = &imported.table {
            write_new(&out.join(name), table)?;
        }
        for (from, name) in &imported.copies {
            std::fs::copy(from, out.join(name))
                .map_err(|error| CommandError::Io { path: from.clone(), error })?;
        }
        check(out)
    };
    match written() {
        Ok(checked) => {
            Ok(format!("{}\n{checked}\nnext: missing-physics diagnose {}\n", imported.text, out.display()))
        }
        Err(error) => {
            let names = imported
                .copies
                .iter()
                .map(|(_, name)| name)
                .chain(imported.table.iter().map(|(name, _)| name));
            for name in names.map(String::as_str).chain(["recording.toml"]) {
                // What was not written is not there to be removed.
                let _ = std::fs::remove_file(out.join(name));
            }
            if made {
                let _ = std::fs::remove_dir(out);
            }
            Err(CommandError::Unsound { text: imported.text, why: error.to_string() })
        }
    }
}
