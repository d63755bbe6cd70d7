//! `domains` and `check`: what the tool knows, and what it reads.

use std::fmt::Write as _;
use std::path::Path;

use missing_physics::model::Scope;

use super::error::CommandError;
use missing_physics_domains::{self as domains, Contents};

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
        for mechanism in spec.mechanisms.iter().filter(|m| !m.between_runs) {
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
        let mut between = spec.mechanisms.iter().filter(|m| m.between_runs).peekable();
        if between.peek().is_some() {
            let _ = writeln!(text, "\n  may differ from run to run, which is said as what is left over");
        }
        for mechanism in between {
            let _ = writeln!(text, "    {}: {}", mechanism.name, mechanism.explanation);
        }
        let _ = writeln!(text, "\n  candidate terms of an unknown law");
        for term in &spec.terms {
            let parameter = &spec.parameters[term.parameter];
            let _ =
                writeln!(text, "    {} += c {}, c in {}", term.adds_to.name, term.formula, parameter.unit);
        }
    }
    let _ = writeln!(text, "\n{}", domains::THESIS);
    text
}

/// Reads and validates a recording, and says what is in it; nothing is learned, drawn or simulated for it.
///
/// # Errors
/// [`CommandError::Read`].
pub fn check(folder: &Path) -> Result<String, CommandError> {
    let (domain, checked) = domains::check(folder)?;
    let Contents { channels, calibration, variable, runs, spec } = &checked.contents;
    let rows: usize = runs.iter().map(|r| r.rows).sum();
    let names: Vec<&str> = channels.iter().map(|c| c.name.as_str()).collect();
    let mut text = String::new();
    let _ = writeln!(text, "{}: a sound recording of the domain {}", folder.display(), domain.id());
    let _ = writeln!(text, "  {} runs, {rows} rows; measured: {}", runs.len(), names.join(", "));
    for column in &checked.columns {
        let [low, high] = column.range.map(short);
        let _ =
            writeln!(text, "{}", format!("    {}: {low} to {high} {}", column.name, column.unit).trim_end());
    }
    for run in runs {
        let [from, to] = run.from_to.map(short);
        let line = format!("    run {}: {} rows, {from} to {to} {}", run.label, run.rows, variable.unit);
        let _ = writeln!(text, "{}", line.trim_end());
    }
    let calibrated: Vec<&str> =
        names.iter().zip(calibration).filter(|(_, sigma)| sigma.is_some()).map(|(name, _)| *name).collect();
    let calibrated =
        if calibrated.is_empty() { "none, it will be estimated".into() } else { calibrated.join(", ") };
    let _ = writeln!(text, "  calibrated noise: {calibrated}");
    let named = spec.mechanisms.iter().filter(|m| !m.between_runs);
    let ids: Vec<&str> = named.map(|m| m.id.as_str()).collect();
    let _ = writeln!(text, "  mechanisms that can show: {}", ids.join(", "));
    let _ = writeln!(text, "  unknowns of the baseline: {} in each run", spec.count(Scope::PerRun));
    for hint in &checked.hints {
        let _ = writeln!(text, "  hint: {hint}");
    }
    Ok(text)
}

/// A number in six digits.
fn short(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}
