//! `domains` and `check`: what the tool knows, and what it reads.

use std::fmt::Write as _;
use std::path::Path;

use missing_physics::model::Scope;

use super::CommandError;
use missing_physics_domains as domains;

/// Describes every domain: baseline, files, mechanisms with equation and source.
pub fn domains() -> String {
    let mut text = String::new();
    for domain in domains::all() {
        let spec = domain.spec();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{}: {}\n", domain.id(), domain.summary());
        let _ = writeln!(text, "  baseline  {}\n\n  reads", spec.baseline);
        for (what, how) in domain.reads() {
            let _ = writeln!(text, "    {what}\n        {how}");
        }
        let _ = writeln!(text, "\n  mechanisms");
        for mechanism in &spec.mechanisms {
            let names: Vec<&str> = mechanism
                .parameters
                .iter()
                .map(|&p| spec.parameters[p].name.as_str())
                .chain(mechanism.derived.iter().map(|d| d.name.as_str()))
                .collect();
            let _ = writeln!(text, "    {} ({})", mechanism.id, names.join(", "));
            let _ = writeln!(text, "        {}", mechanism.explanation);
            let _ = writeln!(text, "        {}", mechanism.equation);
            let _ = writeln!(text, "        source: {}", mechanism.reference);
            let _ = writeln!(text, "        easily confused with: {}", mechanism.confused_with.join(", "));
        }
        let _ = writeln!(text, "\n  candidate terms of an unknown law");
        for term in &spec.terms {
            let parameter = &spec.parameters[term.parameter];
            let _ =
                writeln!(text, "    {} += c {}, c in {}", term.adds_to.name, term.formula, parameter.unit);
        }
    }
    text
}

/// Reads and validates a recording, and says what is in it.
///
/// # Errors
/// [`CommandError::Read`].
pub fn check(folder: &Path) -> Result<String, CommandError> {
    let (domain, loaded) = domains::load(folder)?;
    let recording = &loaded.recording;
    let rows: usize = recording.runs.iter().map(missing_physics::data::Run::len).sum();
    let names: Vec<&str> = recording.channels.iter().map(|c| c.name.as_str()).collect();
    let spec = loaded.model.spec();
    let mut text = String::new();
    let _ = writeln!(text, "{}: a sound recording of the domain {}", folder.display(), domain.id());
    let _ = writeln!(text, "  {} runs, {rows} rows; measured: {}", recording.runs.len(), names.join(", "));
    for run in &recording.runs {
        let from = run.inputs[0].first().copied().unwrap_or(0.0);
        let to = run.inputs[0].last().copied().unwrap_or(0.0);
        let _ = writeln!(text, "    run {}: {} rows, {from} to {to} s", run.label, run.len());
    }
    let calibrated: Vec<&str> = recording
        .channels
        .iter()
        .zip(&recording.calibration)
        .filter(|(_, s)| s.is_some())
        .map(|(c, _)| c.name.as_str())
        .collect();
    let calibrated =
        if calibrated.is_empty() { "none, it will be estimated".into() } else { calibrated.join(", ") };
    let _ = writeln!(text, "  calibrated noise: {calibrated}");
    let ids: Vec<&str> = spec.mechanisms.iter().map(|m| m.id.as_str()).collect();
    let _ = writeln!(text, "  mechanisms that can show: {}", ids.join(", "));
    let _ = writeln!(text, "  unknowns of the baseline: {} in each run", spec.count(Scope::PerRun));
    Ok(text)
}
