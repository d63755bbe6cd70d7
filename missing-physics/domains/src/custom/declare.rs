//! What a recording says of its simulator: program, parameters, mechanisms.

use missing_physics::model::{ParameterRef, SpecBuilder, UNBOUNDED};
use std::collections::BTreeSet;
use std::time::Duration;

use super::model::Names;
use super::process::Start;
use crate::recording::{Header, ReadError, Section, quoted};

/// The program, where the recording names one, and the step of derivatives.
pub(super) fn program(header: &Header) -> Result<(Option<Start>, f64), ReadError> {
    let section = header.section("simulator")?;
    let command = section.texts("command")?;
    let limit = section.number("timeout_s", 1e-3, 1e5)?.unwrap_or(60.0);
    let processes = section.number("processes", 1.0, 1024.0)?.unwrap_or(1.0);
    let step = section.number("step", 1e-9, 1.0)?.unwrap_or(1e-3);
    if processes.fract() != 0.0 {
        return Err(section.unfit("processes", processes.to_string(), "a whole number from 1 to 1024"));
    }
    let start = command.map(|command| Start {
        command: command.into_iter().map(str::to_owned).collect(),
        folder: header.source.working_folder().into(),
        limit: Duration::from_secs_f64(limit),
        processes: processes as usize,
    });
    Ok((start, step))
}

/// Adds the declared parameters and mechanisms to a specification.
pub(super) fn declare(header: &Header, b: &mut SpecBuilder) -> Result<Names, ReadError> {
    let mut names = Names::new();
    for section in header.root().sections("parameter")? {
        parameter(&section, "start", None, b, &mut names)?;
    }
    let mut ids = BTreeSet::new();
    for section in header.root().sections("mechanism")? {
        let expected = "an identifier in lower case with hyphens, unlike the others'";
        let id = section.text("id", expected)?;
        let sound = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        if id.is_empty() || !id.chars().all(sound) || !ids.insert(id.to_owned()) {
            return Err(section.unfit("id", quoted(id), expected));
        }
        let text = |key: &str| section.optional_text(key, "a text").map(|t| t.unwrap_or_default());
        let name = section.optional_text("name", "a text")?.unwrap_or(id);
        let texts = [name, text("explanation")?, text("equation")?, text("reference")?];
        let confused = section.texts("confused_with")?.unwrap_or_default();
        let nuisance: Vec<ParameterRef> = section
            .sections("parameter")?
            .iter()
            .map(|s| parameter(s, "off", Some(0.0), b, &mut names))
            .collect::<Result<_, _>>()?;
        if nuisance.is_empty() {
            return Err(section.unfit("parameter", "absent", "at least one [[mechanism.parameter]]"));
        }
        b.mechanism(id, &nuisance, texts, &confused);
    }
    Ok(names)
}

/// One parameter, which begins (or is off) at the value of the key `start`.
fn parameter(
    section: &Section<'_>,
    start: &str,
    default: Option<f64>,
    b: &mut SpecBuilder,
    names: &mut Names,
) -> Result<ParameterRef, ReadError> {
    let expected = "a name, unlike the other parameters'";
    let name = section.text("name", expected)?;
    if name.is_empty() || names.iter().any(|(n, _, _)| n == name) {
        return Err(section.unfit("name", quoted(name), expected));
    }
    let unit = section.optional_text("unit", "a unit, such as \"1/s\"")?.unwrap_or_default();
    let [lowest, highest] = UNBOUNDED;
    let lower = section.number("lower", lowest, highest)?.unwrap_or(lowest);
    let upper = section.number("upper", highest.min(lower), highest)?.unwrap_or(highest);
    if !(upper > lower) {
        return Err(section.unfit("upper", upper.to_string(), format!("a number above lower ({lower})")));
    }
    let given = section.number(start, lower, upper)?;
    let begin = match given.or(default.filter(|d| (lower..=upper).contains(d))) {
        Some(value) => value,
        None => section.required(start, lower, upper)?,
    };
    let scale = section.required("scale", f64::MIN_POSITIVE, f64::MAX)?;
    let at = if section.flag("per_run")?.unwrap_or(false) {
        b.nuisance_from(name, unit, begin, [lower, upper], scale)
    } else {
        b.shared(name, unit, begin, [lower, upper], scale)
    };
    let scope = b.so_far().parameters[at.index].scope;
    names.push((name.to_owned(), scope, at.slot));
    Ok(at)
}
