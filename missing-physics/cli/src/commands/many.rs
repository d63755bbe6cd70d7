//! `diagnose` of several recordings: a report of each, and a page over all of them.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use missing_physics::observer::Observer;
use missing_physics_report::{Entry, index};

use super::diagnose::{DiagnoseArguments, one};
use super::error::CommandError;
use super::output::{Said, places};

/// Whether outputs are folders, with a file for each recording: where there are several recordings, or where the page's place is
/// written as a folder.
pub fn into_folders(folders: &[PathBuf], html: Option<&Path>) -> bool {
    let folder = |path: &Path| path.as_os_str().to_string_lossy().ends_with(std::path::is_separator);
    folders.len() > 1 || html.is_some_and(folder)
}

/// Diagnoses recordings one after the other; what the arguments name as outputs are folders, made where they are not there, with a file of
/// the recording's name for each, and `index.html` over the pages. A recording without a diagnosis is said in the text and on that
/// page, and in [`Said::failure`].
///
/// # Errors
/// [`CommandError`] where the folders cannot be made.
pub fn diagnose_many(
    folders: &[PathBuf],
    common: &DiagnoseArguments,
    observer: &dyn Observer,
) -> Result<Said, CommandError> {
    for out in [&common.json, &common.html, &common.svg, &common.model, &common.next].into_iter().flatten() {
        if out == Path::new("-") || out.exists() && !out.is_dir() {
            return Err(CommandError::NotAFolder { path: out.clone() });
        }
        std::fs::create_dir_all(out).map_err(|error| CommandError::Io { path: out.clone(), error })?;
    }
    let over_all = common.html.as_ref().map(|out| out.join("index.html"));
    let over_all = places(&over_all.as_deref().into_iter().collect::<Vec<_>>(), &[])?;
    let (mut said, mut entries, mut failed) = (Said::default(), Vec::new(), 0);
    for (folder, name) in folders.iter().zip(names(folders)) {
        let file =
            |out: &Option<PathBuf>, ending| out.as_ref().map(|out| out.join(format!("{name}.{ending}")));
        let arguments = DiagnoseArguments {
            folder: folder.clone(),
            json: file(&common.json, "json"),
            html: file(&common.html, "html"),
            svg: file(&common.svg, "svg"),
            model: file(&common.model, "model.json"),
            next: file(&common.next, "next.csv"),
            ..common.clone()
        };
        // Writing to a string cannot fail.
        let _ = writeln!(said.text, "== {}\n", folder.display());
        match one(&arguments, observer) {
            Ok(done) => {
                entries.push(Entry::new(&done.diagnosis, &done.context, &format!("{name}.html")));
                said.join(done.said);
                said.text.push('\n');
            }
            Err(error) => {
                failed += 1;
                let _ = writeln!(said.text, "{error}\n");
                entries.push(Entry::failed(&name, &error.to_string()));
            }
        }
    }
    if let Some(place) = over_all.first() {
        said.write(place, index(&entries));
    }
    if failed > 0 {
        said.failure = Some(format!("{failed} of {} recordings have no diagnosis", folders.len()));
    }
    Ok(said)
}

/// A name for each recording: its folder's, with a number where that is taken.
fn names(folders: &[PathBuf]) -> Vec<String> {
    // The page over all of them has a name of its own.
    let mut taken = vec!["index".to_owned()];
    for folder in folders {
        let whole = folder.canonicalize().unwrap_or_else(|_| folder.clone());
        let name = whole.file_name().map_or_else(|| "recording".into(), |n| n.to_string_lossy().into_owned());
        let numbered = (2..).map(|k| format!("{name}-{k}"));
        let free = std::iter::once(name.clone()).chain(numbered).find(|n| !taken.contains(n));
        taken.extend(free);
    }
    taken.split_off(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_recording_has_a_name_of_its_own() {
        let folders = ["a/c01", "b/c01", "c/index", "d/c01-2"].map(PathBuf::from);
        assert_eq!(names(&folders), ["c01", "c01-2", "index-2", "c01-2-2"]);
    }
}
