//! What a recording says of its simulator: program, parameters, mechanisms.

use missing_physics::data::Run;
use missing_physics::model::{ParameterRef, Quantity, SpecBuilder, UNBOUNDED};
use std::collections::BTreeSet;
use std::time::Duration;

use super::model::{Begins, Names};
use super::process::Start;
use crate::recording::{Header, ReadError, Section, quoted};

/// The program, where the recording names one, and the step of derivatives.
pub(super) fn program(header: &Header) -> Result<(Option<Start>, f64), ReadError> {
    let section = header.section("simulator")?;
    let command = section.texts("command")?;
    let limit = section.number("timeout_s", 1e-3, 1e5)?.unwrap_or(60.0);
    let processes = section.number("processes", 1.0, 1024.0)?.unwrap_or(1.0);
    let batch = section.number("batch", 1.0, 1024.0)?.unwrap_or(1.0);
    let step = section.number("step", 1e-9, 1.0)?.unwrap_or(1e-3);
    if processes.fract() != 0.0 {
        return Err(section.unfit("processes", processes.to_string(), "a whole number from 1 to 1024"));
    }
    if batch.fract() != 0.0 {
        return Err(section.unfit("batch", batch.to_string(), "a whole number from 1 to 1024"));
    }
    let start = command.map(|command| Start {
        command: command.into_iter().map(str::to_owned).collect(),
        folder: header.source.working_folder().into(),
        limit: Duration::from_secs_f64(limit),
        processes: processes as usize,
        batch: batch as usize,
    });
    Ok((start, step))
}

/// Adds the declared parameters and mechanisms to a specification: what the program knows them by, and those that begin in each run
/// where it says.
pub(super) fn declare<'h>(
    header: &'h Header,
    b: &mut SpecBuilder,
) -> Result<(Names, Vec<ByRun<'h>>), ReadError> {
    let mut names = Names::new();
    let mut by_run = Vec::new();
    for section in header.root().sections("parameter")? {
        let wanted = match section.list("start", UNBOUNDED[0], UNBOUNDED[1])? {
            Some(list) => Some(Wanted::List(list)),
            None => {
                section.optional_text("start", "").unwrap_or(None).map(|text| Wanted::Text(text.to_owned()))
            }
        };
        let default = match &wanted {
            None => None,
            Some(Wanted::List(list)) => Some(list.iter().sum::<f64>() / list.len() as f64),
            Some(Wanted::Text(_)) => Some(0.0),
        };
        if let Some(wanted) = wanted {
            if !section.flag("per_run")?.unwrap_or(false) {
                return Err(section.unfit(
                    "start",
                    wanted.word(),
                    "a number: one value for all runs (per_run is false)",
                ));
            }
            let begin = default.unwrap_or(0.0);
            let at = parameter(&section, Begin::At(begin), b, &mut names)?;
            by_run.push(ByRun { section, slot: at.slot, wanted });
        } else {
            parameter(&section, Begin::Key("start", None), b, &mut names)?;
        }
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
            .map(|s| parameter(s, Begin::Key("off", Some(0.0)), b, &mut names))
            .collect::<Result<_, _>>()?;
        if nuisance.is_empty() {
            return Err(section.unfit("parameter", "absent", "at least one [[mechanism.parameter]]"));
        }
        b.mechanism(id, &nuisance, texts, &confused);
    }
    Ok((names, by_run))
}

/// A parameter of each run that begins where its run says.
pub(super) struct ByRun<'h> {
    section: Section<'h>,
    slot: usize,
    wanted: Wanted,
}

/// What a recording writes as such a start.
enum Wanted {
    List(Vec<f64>),
    Text(String),
}

impl Wanted {
    fn word(&self) -> String {
        match self {
            Self::List(list) => format!("a list of {}", list.len()),
            Self::Text(text) => quoted(text),
        }
    }
}

impl ByRun<'_> {
    /// Its slot, and where it begins in each of the runs: a number for each of them, or the first reading of the channel with whose name
    /// its own begins.
    pub(super) fn begins(&self, runs: &[Run], channels: &[Quantity]) -> Result<(usize, Begins), ReadError> {
        let begins = match &self.wanted {
            Wanted::List(list) if list.len() == runs.len() => {
                Begins::Given(runs.iter().map(|run| run.label.clone()).zip(list.iter().copied()).collect())
            }
            Wanted::List(_) => {
                let expected = format!("{} numbers, one for each run in the order of the file", runs.len());
                return Err(self.section.unfit("start", self.wanted.word(), expected));
            }
            Wanted::Text(text) if text == "measured" => {
                let name = self.section.text("name", "a name")?;
                let of = (0..channels.len()).filter(|&c| name.starts_with(&channels[c].name));
                match of.max_by_key(|&c| channels[c].name.len()) {
                    Some(channel) => Begins::Measured(channel),
                    None => {
                        let expected = format!(
                            "a parameter whose name begins with a channel's ({}_at_start)",
                            channels.first().map_or("", |c| c.name.as_str())
                        );
                        return Err(self.section.unfit("start", self.wanted.word(), expected));
                    }
                }
            }
            Wanted::Text(_) => {
                let expected = "a number, a list of one for each run, or \"measured\"";
                return Err(self.section.unfit("start", self.wanted.word(), expected));
            }
        };
        Ok((self.slot, begins))
    }
}

/// Where a parameter begins (or is off).
#[derive(Clone, Copy)]
enum Begin<'a> {
    /// At the value of a key, or a default.
    Key(&'a str, Option<f64>),
    /// Somewhere within its bounds, near this value.
    At(f64),
}

/// One parameter.
fn parameter(
    section: &Section<'_>,
    begin: Begin<'_>,
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
    let begin = match begin {
        Begin::At(value) => value.clamp(lower, upper),
        Begin::Key(key, default) => {
            let given = section.number(key, lower, upper)?;
            match given.or(default.filter(|d| (lower..=upper).contains(d))) {
                Some(value) => value,
                None => section.required(key, lower, upper)?,
            }
        }
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
