//! A recording in memory, checked and diagnosed.

use missing_physics::engine::Options;
use missing_physics::observer::Observer;
use missing_physics_domains as domains;
use missing_physics_report::{self as report, ReportContext};
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::error::WebError;
use crate::files::Files;

/// A recording that was read and found sound.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Checked {
    /// Its domain.
    pub domain: &'static str,
    /// What is measured.
    pub channels: Vec<Named>,
    /// Its runs.
    pub runs: Vec<RunRows>,
    /// What looks like a mistake, a sentence each.
    pub hints: Vec<String>,
}

/// A column of numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Named {
    /// Its name.
    pub name: String,
    /// Its unit, or nothing.
    pub unit: String,
    /// Its smallest and its largest number.
    pub range: [f64; 2],
}

/// A run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RunRows {
    /// Its label.
    pub label: String,
    /// Its rows.
    pub rows: usize,
}

/// How a diagnosis is asked for.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Asked {
    /// The recording's name.
    pub name: String,
    /// The seed of every random draw.
    pub seed: u64,
    /// The rate of false alarms that is put up with.
    pub alpha: f64,
}

/// What the command would print and write.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Answer {
    /// The report as text.
    pub text: String,
    /// The answer for a program.
    pub json: String,
    /// The report as a page.
    pub html: String,
}

/// Reads and validates a recording; nothing is learned, drawn or simulated for it.
///
/// # Errors
/// [`WebError::Read`].
pub fn check(name: &str, files: &Files) -> Result<Checked, WebError> {
    let (domain, checked) = domains::check_source(&files.source(name))?;
    let channels = checked.columns.into_iter();
    let channels = channels.map(|c| Named { name: c.name, unit: c.unit.to_owned(), range: c.range });
    let runs = checked.contents.runs.into_iter().map(|r| RunRows { label: r.label, rows: r.rows });
    Ok(Checked {
        domain: domain.id(),
        channels: channels.collect(),
        runs: runs.collect(),
        hints: checked.hints,
    })
}

/// Diagnoses a recording as the command does.
///
/// # Errors
/// [`WebError`].
pub fn diagnose(asked: &Asked, files: &Files, observer: &dyn Observer) -> Result<Answer, WebError> {
    let source = files.source(&asked.name);
    let (domain, loaded) = domains::load_source(&source)?;
    let options = Options { seed: asked.seed, ..Options::with_alpha(asked.alpha) };
    let diagnosis = loaded.diagnose(&options, observer)?;
    let figures = loaded.figures(&diagnosis);
    let title = asked.name.rsplit('/').find(|part| !part.is_empty()).unwrap_or("recording");
    let context = ReportContext {
        domain: domain.id().to_owned(),
        recording: asked.name.clone(),
        title: title.to_owned(),
        citations: vec![domains::THESIS.into()],
        words: domain.words(),
        additions: loaded.additions,
        figures,
        provenance: json!({
            "version": env!("CARGO_PKG_VERSION"),
            "seed": options.seed,
            "alpha": options.alpha,
            "sha256": source.sha256(),
        }),
    };
    Ok(Answer {
        text: report::text(&diagnosis, &context),
        json: report::json(&diagnosis, &context),
        html: report::html(&diagnosis, &context),
    })
}
