//! `diagnose`: a recording in, a report out.

use std::path::PathBuf;

use missing_physics::diagnosis::{Diagnosis, NextExperiment};
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
    /// Where the rows of the next experiment go.
    pub next: Option<PathBuf>,
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
    let asked = [&arguments.json, &arguments.html, &arguments.svg, &arguments.model, &arguments.next];
    let outputs: Vec<&std::path::Path> = asked.iter().filter_map(|path| path.as_deref()).collect();
    let mut places = places(&outputs, &domains::recording::files_of(&arguments.folder))?.into_iter();
    let [json, html, svg, model, next] = asked.map(|path| path.as_ref().and_then(|_| places.next()));
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
    if let Some(place) = &next {
        match &diagnosis.next_experiment {
            Some(experiment) => said.write(place, rows(experiment)),
            None => tell("no experiment is proposed: its file was not written".into()),
        }
    }
    Ok(Done { said, diagnosis, context })
}

/// The rows of an experiment as CSV: run, when to measure, what to command.
fn rows(experiment: &NextExperiment) -> String {
    let names = experiment.inputs.iter().flatten().map(|(name, _)| name.as_str());
    let mut columns: Vec<&str> = Vec::new();
    names.for_each(|name| {
        if !columns.contains(&name) {
            columns.push(name)
        }
    });
    let mut csv = format!("run,{}\n", columns.join(","));
    for (run, inputs) in experiment.inputs.iter().enumerate() {
        for row in 0..inputs.iter().map(|(_, values)| values.len()).max().unwrap_or(0) {
            let cell = |name: &&str| {
                let values = inputs.iter().find(|(n, _)| n == name).map(|(_, values)| values);
                values.and_then(|v| v.get(row)).map_or_else(String::new, f64::to_string)
            };
            let cells: Vec<String> = columns.iter().map(cell).collect();
            csv.push_str(&format!("{},{}\n", run + 1, cells.join(",")));
        }
    }
    csv
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_experiment_is_written_row_by_row() {
        let run =
            |u: [f64; 2]| vec![("t_s".to_owned(), vec![0.0, 0.5]), ("command_v".to_owned(), u.to_vec())];
        let experiment = NextExperiment {
            action: Vec::new(),
            words: String::new(),
            inputs: vec![run([0.0, 1.5]), run([-2.0, 1e-7])],
            separates: Vec::new(),
            expected_log_bayes_factor: 6.0,
        };
        let expected = "run,t_s,command_v\n1,0,0\n1,0.5,1.5\n2,0,-2\n2,0.5,0.0000001\n";
        assert_eq!(rows(&experiment), expected);
    }
}
