#![doc = include_str!("../README.md")]
mod choose;
mod clock;
mod error;
pub mod file;
mod header;
mod names;
mod picture;
mod rows;
mod say;
mod settle;
mod table;
pub mod units;
mod wanted;

use std::path::PathBuf;

pub use error::ImportError;
use missing_physics_domains::recording::unit_of;
pub use table::{Column, Table, Values};

use choose::Choice;
use header::Setting;
use rows::Cut;
use say::Story;
use wanted::{Target, Wanted};

/// What is to be imported, and how.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// Files, or the folder of a bag or data set; several files are runs of one recording.
    pub files: Vec<PathBuf>,
    /// The domain of the recording.
    pub domain: String,
    /// Columns as somebody settled them: `z_m=Höhe (mm)`, `z_m=-Höhe (mm) + 1.2`, `x_m=` to leave one out.
    pub maps: Vec<String>,
    /// Values of keys of `recording.toml`: `liquid_mass_kg=282 g`, `noise.z_m=0.002`.
    pub settings: Vec<String>,
    /// The column that tells runs apart.
    pub run: Option<String>,
    /// A pause longer than this (s) begins a new run.
    pub gap_s: Option<f64>,
    /// So many rows are a run.
    pub every: Option<usize>,
    /// Rows a second, where no column tells the time.
    pub rate_hz: Option<f64>,
    /// The folder of a recording whose `recording.toml` is taken over.
    pub like: Option<PathBuf>,
    /// The contents of a `recording.toml` that is taken over, instead of one in a folder.
    pub header: Option<String>,
}

/// A recording as it is to be written, and what is to be said of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// Contents of `recording.toml`.
    pub header: String,
    /// Name and contents of the table, where the recording has one.
    pub table: Option<(String, String)>,
    /// Files that are copied beside it, with the names that they get.
    pub copies: Vec<(PathBuf, String)>,
    /// What was found, taken, left out and not known, for a person.
    pub text: String,
    /// Of that, what is not known or was taken for granted, a sentence each.
    pub notes: Vec<String>,
    /// What each column of the recording comes from.
    pub mapped: Vec<Mapped>,
    /// Keys of `recording.toml` whose values are the template's.
    pub unknown: Vec<String>,
}

/// A column of the recording and what it comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mapped {
    /// Its name in the recording (`z_m`).
    pub target: String,
    /// The title of the file's column; `None` for one number in all rows.
    pub title: Option<String>,
    /// How it is worked out (`0.001 × "Höhe (mm)"`).
    pub formula: String,
}

impl Mapped {
    fn of(choice: &Choice) -> Self {
        let title = match &choice.from {
            choose::From::Column { title, .. } => Some(title.clone()),
            choose::From::Constant => None,
        };
        Self { target: choice.target.clone(), title, formula: choice.formula() }
    }
}

/// What a domain wants of tables, and what of them would be taken for it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Proposal {
    /// Names of the columns that the domain, or the header that is taken over, knows; `run` is the first.
    pub wanted: Vec<String>,
    /// What was asked for, and what is proposed beside it.
    pub mapped: Vec<Mapped>,
}

/// What would be taken for what in tables that were read already ([`file::read_bytes`]), however much is missing yet.
///
/// # Errors
/// [`ImportError`]: no such domain, or an option that makes no sense.
pub fn propose(request: &Request, tables: &[Table]) -> Result<Proposal, ImportError> {
    let wanted = wanted(request)?;
    let names = wanted.targets.iter().map(|target| target.name.clone());
    let mapped = choices(request, &wanted, tables)?.iter().map(Mapped::of).collect();
    Ok(Proposal { wanted: std::iter::once("run".to_owned()).chain(names).collect(), mapped })
}

/// What the files hold, for a person: columns with units and first values.
///
/// # Errors
/// [`ImportError`].
pub fn survey(files: &[PathBuf]) -> Result<String, ImportError> {
    Ok(say::columns(&read(files)?, &[]))
}

/// Makes a recording of files; nothing is written.
///
/// # Errors
/// [`ImportError`]: a file that cannot be read, an option that makes no sense, or a column that is missing.
pub fn import(request: &Request) -> Result<Imported, ImportError> {
    import_with(request, || read(&request.files))
}

/// As [`import`], of tables that were read already ([`file::read_bytes`]); `files` of the request only names where they come from.
///
/// # Errors
/// As [`import`].
pub fn import_tables(request: &Request, tables: Vec<Table>) -> Result<Imported, ImportError> {
    import_with(request, || Ok(tables))
}

fn import_with(
    request: &Request,
    tables: impl FnOnce() -> Result<Vec<Table>, ImportError>,
) -> Result<Imported, ImportError> {
    let wanted = wanted(request)?;
    let settings: Vec<Setting> =
        request.settings.iter().map(|s| Setting::parse(s)).collect::<Result<_, _>>()?;
    if let (Some(_), Some(setting)) = (&wanted.like, request.settings.first()) {
        return Err(ImportError::option(
            format!("--set {setting}"),
            "the header comes from --like: write it there",
        ));
    }
    let cut = cut(request)?;
    let sound = |file: &PathBuf| matches!(file::ending(file).as_str(), "wav" | "wave");
    if request.domain == "bounce" && !request.files.is_empty() && request.files.iter().all(sound) {
        return Ok(of_sound(request, &wanted, &settings, &tables()?));
    }
    let tables = tables()?;
    let choices = choices(request, &wanted, &tables)?;
    let mut names: Vec<&str> = choices.iter().map(|c| c.target.as_str()).collect();
    names.extend(request.rate_hz.map(|_| "t_s"));
    settle::required(&request.domain, &wanted, &names, &tables)?;
    let fewest = settle::fewest(&request.domain);
    let mut rows = rows::gather(&tables, &choices, cut, &request.domain, fewest)?;
    settle::count(&request.domain, &mut rows);
    let copies = settle::pictures(&mut rows)?;
    settle::segments(&mut rows);
    let names: Vec<&str> = rows.columns.iter().map(|(name, _)| name.as_str()).collect();
    settle::required(&request.domain, &wanted, &names, &tables)?;
    let files: Vec<String> = request.files.iter().map(|f| f.display().to_string()).collect();
    let origin = header::origin(&files, &choices);
    let (header, unknown, data) = match &wanted.like {
        Some(like) => (like.text.clone(), Vec::new(), like.data.clone()),
        None if wanted.domain.id() == "custom" => {
            let (inputs, channels) = settle::custom(&names)?;
            let unit = |name: &str| unit_of(name).to_owned();
            (header::custom(&origin, &inputs, &channels, unit), Vec::new(), "data.csv".into())
        }
        None => {
            let (text, unknown) = header::header(wanted.domain, &origin, &names, &settings);
            (text, unknown, wanted.domain.template().data.0.to_owned())
        }
    };
    let story =
        Story { tables: &tables, choices: &choices, rows: &rows, unknown: &unknown, domain: wanted.domain };
    let (text, notes) = (story.tell(), story.notes());
    let mapped = choices.iter().map(Mapped::of).collect();
    Ok(Imported { text, notes, header, table: Some((data, rows.to_csv())), copies, mapped, unknown })
}

fn wanted(request: &Request) -> Result<Wanted, ImportError> {
    Wanted::of(&request.domain, request.header.as_deref(), request.like.as_deref())
}

fn read(files: &[PathBuf]) -> Result<Vec<Table>, ImportError> {
    let tables: Vec<Vec<Table>> = files.iter().map(|f| file::read(f)).collect::<Result<_, _>>()?;
    Ok(tables.concat())
}

fn cut(request: &Request) -> Result<Cut, ImportError> {
    let positive = |name: &str, value: Option<f64>| match value {
        Some(v) if !(v > 0.0 && v < 1e12) => {
            Err(ImportError::option(format!("{name} {v}"), "expected a number above 0"))
        }
        value => Ok(value),
    };
    let gap_s = positive("--gap", request.gap_s)?;
    let rate_hz = positive("--rate", request.rate_hz)?;
    if request.every == Some(0) {
        return Err(ImportError::option("--every 0", "expected the number of rows of a run"));
    }
    Ok(Cut { gap_s, every: request.every, rate_hz })
}

/// What each column comes from: as asked for first, then as proposed.
fn choices(request: &Request, wanted: &Wanted, tables: &[Table]) -> Result<Vec<Choice>, ImportError> {
    let free = wanted.domain.id() == "custom" && wanted.like.is_none();
    let maps: Vec<String> = request
        .maps
        .iter()
        .cloned()
        .chain(request.run.iter().map(|column| format!("run={column}")))
        .collect();
    let mut settled: Vec<Choice> = Vec::new();
    let mut closed: Vec<String> = Vec::new();
    for option in &maps {
        let (target, choice) = choose::asked(option, tables, &wanted.targets, free)?;
        if closed.contains(&target) {
            return Err(ImportError::option(format!("--map {option}"), format!("{target} is mapped twice")));
        }
        closed.push(target);
        settled.extend(choice);
    }
    let open = |target: &&Target| !closed.contains(&target.name);
    let of = |names: &dyn Fn(&str) -> bool| -> Vec<Target> {
        wanted.targets.iter().filter(|t| names(&t.name)).filter(open).cloned().collect()
    };
    settled.extend(choose::propose(tables, &of(&|name| name != "t_s"), &settled));
    if free {
        settled.extend(settle::simulated(tables, &settled, &closed));
    }
    settle::agree(&request.domain, &mut settled);
    // Time and runs are told by the rows that most columns are in.
    let part = rows::part_of(&settled, tables);
    let mine: Vec<Table> = tables.iter().filter(|t| t.part == part).cloned().collect();
    let mut rest = of(&|name| name == "t_s");
    let per_row = request.every.is_none() && !closed.iter().any(|name| name == "run");
    rest.extend(per_row.then(|| Target::new("run", true)));
    if request.rate_hz.is_some() {
        rest.retain(|t| t.name != "t_s");
    }
    let mut found = choose::propose(&mine, &rest, &settled);
    found.retain(|c| c.target != "run" || settle::tells_runs(c, &mine));
    settled.extend(found);
    let order = |c: &Choice| match c.target.as_str() {
        "run" => 0,
        name => 1 + wanted.targets.iter().position(|t| t.name == name).unwrap_or(usize::MAX - 1),
    };
    settled.sort_by_key(order);
    Ok(settled)
}

/// A recording of sound: the files themselves, one a run.
fn of_sound(request: &Request, wanted: &Wanted, settings: &[Setting], tables: &[Table]) -> Imported {
    let names: Vec<String> = (1..=request.files.len()).map(|k| format!("{k}.wav")).collect();
    let files: Vec<String> = request.files.iter().map(|f| f.display().to_string()).collect();
    let mut origin = header::origin(&files, &[]);
    origin.extend(names.iter().zip(&files).map(|(name, file)| format!("  {name} is {file}")));
    let (text, _) = header::header(wanted.domain, &origin, &[], settings);
    let list: Vec<String> = names.iter().map(|n| format!("\"{n}\"")).collect();
    let audio = format!(
        "\n[audio]\nfiles = [{}]\n# microphones_m = [[0.0, 0.0, 0.0]]   # one [x, y, z] for each channel; without it times only\n# temperature_k = 293.15\n",
        list.join(", ")
    );
    let without_table = |line: &&str| !line.starts_with("data = ");
    let header = text.lines().filter(without_table).collect::<Vec<_>>().join("\n") + "\n" + &audio;
    let copies = request.files.iter().cloned().zip(names).collect();
    let text = say::columns(tables, &[]) + &say::sound(tables);
    let notes = say::SOUND_NOTES.map(str::to_owned).to_vec();
    Imported { header, table: None, copies, text, notes, mapped: Vec::new(), unknown: Vec::new() }
}
