//! Columns of a laboratory's files, and what would be taken for what.

use std::collections::BTreeMap;
use std::path::Path;

use missing_physics_import::{self as import, Imported, Request, Table};
use serde::{Deserialize, Serialize};

use crate::error::{WebError, without_options};
use crate::files::Files;

/// Values that are shown of a column.
const SHOWN: usize = 3;

/// What the page wishes to have made of files.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct Wish {
    /// The domain.
    pub domain: String,
    /// The contents of a `recording.toml` that is taken over.
    pub header: Option<String>,
    /// Columns as they were settled: `z_m=Höhe (mm)`, `x_m=` for none.
    pub maps: Vec<String>,
    /// A pause longer than this (s) begins a new run.
    pub gap_s: Option<f64>,
    /// So many rows are a run.
    pub every: Option<usize>,
    /// Rows a second, where no column tells the time.
    pub rate_hz: Option<f64>,
}

/// What the files hold, and what would be made of them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Proposed {
    /// The tables of the files.
    pub tables: Vec<TableThere>,
    /// The columns that the domain knows, `run` first.
    pub wanted: Vec<String>,
    /// What each would be taken from.
    pub mapped: Vec<Taken>,
    /// The recording that would be made.
    pub made: Option<Made>,
    /// Why none can be made yet.
    pub why: Option<String>,
}

/// A table of a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TableThere {
    /// The file.
    pub file: String,
    /// The number of its rows.
    pub rows: usize,
    /// Its columns.
    pub columns: Vec<ColumnThere>,
    /// What was left out or guessed while it was read.
    pub remarks: Vec<String>,
}

/// A column of a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ColumnThere {
    /// Its whole name.
    pub title: String,
    /// The unit that its name says, where it says one.
    pub unit: Option<String>,
    /// Its first values.
    pub first: Vec<String>,
}

/// A column of the recording and what it is taken from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Taken {
    /// Its name in the recording.
    pub target: String,
    /// The title of the file's column; none for one number in all rows.
    pub title: Option<String>,
    /// How it is worked out.
    pub formula: String,
}

/// A recording as it would be made.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Made {
    /// Contents of `recording.toml`.
    pub header: String,
    /// Name and contents of the table, where there is one.
    pub table: Option<(String, String)>,
    /// Dropped files that are its own under other names: theirs, and the new ones.
    pub copies: BTreeMap<String, String>,
    /// What is not known, or was taken for granted.
    pub notes: Vec<String>,
    /// Keys of `recording.toml` whose values are a template's.
    pub unknown: Vec<String>,
}

impl From<&Table> for TableThere {
    fn from(table: &Table) -> Self {
        let rows = table.rows();
        let column = |column: &import::Column| ColumnThere {
            title: column.title.clone(),
            unit: column.unit().map(str::to_owned),
            first: (0..rows.min(SHOWN)).map(|row| column.values.show(row)).collect(),
        };
        Self {
            file: table.file.display().to_string(),
            rows,
            columns: table.columns.iter().map(column).collect(),
            remarks: table.remarks.clone(),
        }
    }
}

impl From<Imported> for Made {
    fn from(imported: Imported) -> Self {
        let copies = imported.copies.into_iter().map(|(from, name)| (from.display().to_string(), name));
        Self {
            header: imported.header,
            table: imported.table,
            copies: copies.collect(),
            notes: imported.notes.iter().map(|note| without_options(note)).collect(),
            unknown: imported.unknown,
        }
    }
}

/// Says what files hold, what would be taken for what, and the recording that would be made of them.
///
/// # Errors
/// [`WebError::Import`]: a file that cannot be read, or a wish that makes no sense.
pub fn propose(wish: &Wish, files: &Files) -> Result<Proposed, WebError> {
    let mut tables = Vec::new();
    for (name, bytes) in files.iter() {
        tables.extend(import::file::read_bytes(Path::new(name), bytes)?);
    }
    let request = Request {
        files: files.iter().map(|(name, _)| name.into()).collect(),
        domain: wish.domain.clone(),
        header: wish.header.clone(),
        maps: wish.maps.clone(),
        gap_s: wish.gap_s,
        every: wish.every,
        rate_hz: wish.rate_hz,
        ..Request::default()
    };
    let proposal = import::propose(&request, &tables)?;
    let there = tables.iter().map(TableThere::from).collect();
    let taken = |m: import::Mapped| Taken { target: m.target, title: m.title, formula: m.formula };
    let (made, why) = match import::import_tables(&request, tables) {
        Ok(imported) => (Some(imported.into()), None),
        Err(error) => (None, Some(WebError::from(error).to_string())),
    };
    let mapped = proposal.mapped.into_iter().map(taken).collect();
    Ok(Proposed { tables: there, wanted: proposal.wanted, mapped, made, why })
}
