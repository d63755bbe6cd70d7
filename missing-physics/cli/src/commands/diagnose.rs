//! `diagnose`: a recording in, a report out.

use std::path::PathBuf;

use missing_physics::diagnosis::Diagnosis;
use missing_physics::engine::Options;
use missing_physics::observer::{Observer, Progress};

use super::error::CommandError;
use super::memory;
use super::output::{Said, places};
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
    /// The most memory that it may take, bytes; what is free without.
    pub memory: Option<u64>,
    /// Whom to tell what is known before the work and, where [`DiagnoseArguments::verbose`] is set, what was tried.
    pub say: Option<fn(&str)>,
    /// Whether all is told.
    pub verbose: bool,
}

/// Diagnoses a recording, and returns the text with the files that are to be written after it.
///
/// # Errors
/// [`CommandError`]; outputs that cannot be written are refused before the work begins.
pub fn diagnose(arguments: &DiagnoseArguments, observer: &dyn Observer) -> Result<Said, CommandError> {
    one(arguments, observer).map(|done| done.said)
}

/// A diagnosis, and what is said of it.
pub(super) struct Done {
    pub(super) said: Said,
    pub(super) diagnosis: Diagnosis,
    pub(super) context: ReportContext,
}

/// As [`diagnose`].
pub(super) fn one(arguments: &DiagnoseArguments, observer: &dyn Observer) -> Result<Done, CommandError> {
    let asked = [&arguments.json, &arguments.html, &arguments.svg, &arguments.model];
    let outputs: Vec<&std::path::Path> = asked.iter().filter_map(|path| path.as_deref()).collect();
    let mut places = places(&outputs, &domains::recording::files_of(&arguments.folder))?.into_iter();
    let [json, html, svg, model] = asked.map(|path| path.as_ref().and_then(|_| places.next()));
    let threads = arguments.threads;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| CommandError::Threads { threads, error })?;
    let (domain, loaded) = pool.install(|| domains::load_watched(&arguments.folder, observer))?;
    if arguments.model.is_some() && !domain.predicts() {
        return Err(RepairError::NoChannels { domain: domain.id() }.into());
    }
    let tell = |line: String| {
        if let Some(say) = arguments.say {
            say(&format!("{}: {line}", arguments.folder.display()));
        }
    };
    let needed = memory::needed(&*loaded.model, &loaded.recording);
    let said = memory::checked(needed, arguments.memory)?;
    said.or_else(|| arguments.verbose.then(|| memory::said(needed))).into_iter().for_each(tell);
    let diagnosis = pool.install(|| loaded.diagnose(&arguments.options, observer))?;
    if arguments.verbose {
        report::tried(&diagnosis).into_iter().for_each(tell);
    }
    // Pictures may take simulations of their own.
    let drawing = Progress { stage: "drawing", done: 0.0 };
    let figures = if html.is_some() && observer.progress(drawing) {
        pool.install(|| loaded.figures(&diagnosis))
    } else {
        Vec::new()
    };
    let context = ReportContext {
        domain: domain.id().to_owned(),
        recording: arguments.folder.display().to_string(),
        title: arguments
            .folder
            .file_name()
            .map_or_else(|| "recording".into(), |n| n.to_string_lossy().into_owned()),
        citations: vec![domains::THESIS.into()],
        words: domain.words(),
        additions: loaded.additions,
        figures,
        provenance: provenance(&arguments.folder, &arguments.options),
    };
    let mut said = Said::from(report::text(&diagnosis, &context));
    if let Some(place) = &json {
        said.write(place, report::json(&diagnosis, &context));
    }
    if let Some(place) = &html {
        said.write(place, report::html(&diagnosis, &context));
    }
    if let Some(place) = &svg {
        said.write(place, report::picture(&diagnosis, &context));
    }
    if let Some(place) = &model {
        said.write(place, Repair::new(domain, &diagnosis).to_json());
    }
    Ok(Done { said, diagnosis, context })
}
