//! `diagnose`: a recording in, a report out.

use std::path::{Path, PathBuf};

use missing_physics::engine::{Options, diagnose as run};
use missing_physics::observer::Observer;

use super::error::{CommandError, write_whole};
use super::provenance::provenance;
use missing_physics_domains as domains;
use missing_physics_domains::repair::{Repair, RepairError};
use missing_physics_report::{self as report, ReportContext};

/// What `diagnose` is asked for.
#[derive(Debug, Clone, Default)]
pub struct DiagnoseArguments {
    /// The recording's folder.
    pub folder: PathBuf,
    /// Where the JSON goes.
    pub json: Option<PathBuf>,
    /// Where the page goes.
    pub html: Option<PathBuf>,
    /// Where the picture goes.
    pub svg: Option<PathBuf>,
    /// Where the repaired model goes.
    pub model: Option<PathBuf>,
    /// Seed and false-alarm rate.
    pub options: Options,
    /// Number of threads; 0 for all cores.
    pub threads: usize,
}

/// Diagnoses a recording, writes the files asked for and returns the text.
///
/// # Errors
/// [`CommandError`]; nothing is written then.
pub fn diagnose(arguments: &DiagnoseArguments, observer: &dyn Observer) -> Result<String, CommandError> {
    for path in arguments.json.iter().chain(&arguments.html).chain(&arguments.svg).chain(&arguments.model) {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if !folder.is_dir() {
            return Err(CommandError::NoFolder { folder: folder.into() });
        }
        if path.is_dir() {
            return Err(CommandError::NotAFile { path: path.into() });
        }
    }
    let threads = arguments.threads;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| CommandError::Threads { threads, error })?;
    let (domain, loaded) = pool.install(|| domains::load(&arguments.folder))?;
    if arguments.model.is_some() && !domain.predicts() {
        return Err(RepairError::NoChannels { domain: domain.id() }.into());
    }
    let mut diagnosis = pool.install(|| {
        run(&*loaded.model, &loaded.recording, &loaded.experiments, &arguments.options, observer)
    })?;
    diagnosis.undetermined.extend(loaded.undetermined);
    let context = ReportContext {
        domain: domain.id().to_owned(),
        recording: arguments.folder.display().to_string(),
        title: arguments
            .folder
            .file_name()
            .map_or_else(|| "recording".into(), |n| n.to_string_lossy().into_owned()),
        citations: vec![domains::THESIS.into()],
        additions: loaded.additions,
        provenance: provenance(&arguments.folder, &arguments.options),
    };
    if let Some(path) = &arguments.json {
        write_whole(path, report::json(&diagnosis, &context))?;
    }
    if let Some(path) = &arguments.html {
        write_whole(path, report::html(&diagnosis, &context))?;
    }
    if let Some(path) = &arguments.svg {
        write_whole(path, report::picture(&diagnosis))?;
    }
    if let Some(path) = &arguments.model {
        write_whole(path, Repair::new(domain, &diagnosis).to_json())?;
    }
    Ok(report::text(&diagnosis, &context))
}
