//! `recording.toml`, read with a memory of which keys were asked for.

use std::cell::RefCell;
use std::collections::BTreeSet;

use toml::{Table, Value};

use super::error::ReadError;
use super::files::{HEADER, within};
use super::source::{NamedFile, Source};
use super::table::{self, Column, ColumnContents};
use super::words::{one_line, quoted};

/// What a comment begins with behind a value that is a template's, not a measured one.
pub const PLACEHOLDER: &str = "placeholder";

/// A parsed `recording.toml`.
#[derive(Debug)]
pub struct Header {
    /// Where the recording's files are.
    pub source: Source,
    /// The file, as errors name it.
    pub file: String,
    /// Whether a cell of a number may be empty: a row that was not measured.
    gaps: bool,
    root: Table,
    asked: RefCell<BTreeSet<String>>,
    /// Keys whose values are a template's.
    placeholders: Vec<String>,
    /// What the table holds, once it was read.
    columns: RefCell<Vec<ColumnContents>>,
}

/// One section of a header (the root, or `[rig]`).
#[derive(Debug, Clone)]
pub struct Section<'a> {
    header: &'a Header,
    table: Option<&'a Table>,
    path: String,
}

impl Header {
    /// Reads a recording's header and checks `format`.
    ///
    /// # Errors
    /// [`ReadError`] where the file is missing, is not TOML, or is of another format.
    pub fn read(source: &Source) -> Result<Self, ReadError> {
        Self::read_with(source, false)
    }

    /// Reads the header of a recording in whose tables cells may be empty, where nothing was measured.
    ///
    /// # Errors
    /// As [`Header::read`].
    pub fn read_with_gaps(source: &Source) -> Result<Self, ReadError> {
        Self::read_with(source, true)
    }

    fn read_with(source: &Source, gaps: bool) -> Result<Self, ReadError> {
        Self::parse(source.clone(), &source.text(HEADER)?, gaps)
    }

    /// Parses the text of a source's header.
    ///
    /// # Errors
    /// As [`Header::read`].
    pub(crate) fn parse(source: Source, text: &str, gaps: bool) -> Result<Self, ReadError> {
        let file = source.shown(HEADER);
        let root: Table = text.parse().map_err(|e: toml::de::Error| {
            let at = e.span().map_or(0, |s| s.start.min(text.len()));
            let row = text.as_bytes()[..at].iter().filter(|b| **b == b'\n').count() + 1;
            ReadError::Toml { file: file.clone(), row, why: one_line(e.message()) }
        })?;
        let placeholders = placeholders(text);
        let (asked, columns) = (RefCell::default(), RefCell::default());
        let header = Self { source, file, gaps, root, asked, placeholders, columns };
        match header.root().value("format") {
            Some(Value::Integer(1)) => Ok(header),
            Some(other) => Err(header.wrong("format", other, "1")),
            None => Err(header.missing("format", "1")),
        }
    }

    /// The table that a key outside any section names.
    ///
    /// # Errors
    /// [`ReadError`]: no such key, no such file, or the first thing that is wrong in it.
    pub fn table<'c>(&self, key: &str, known: &[Column<'c>]) -> Result<table::Table<'c>, ReadError> {
        let name = self.root().text(key, "the name of a CSV file")?;
        self.read_table(key, name, known, self.gaps)
    }

    /// As [`Header::table`], for a table in which a cell of a number may be empty in any recording.
    ///
    /// # Errors
    /// As [`Header::table`].
    pub fn sparse_table<'c>(&self, key: &str, known: &[Column<'c>]) -> Result<super::Table<'c>, ReadError> {
        let name = self.root().text(key, "the name of a CSV file")?;
        self.read_table(key, name, known, true)
    }

    fn read_table<'c>(
        &self,
        key: &str,
        name: &str,
        known: &[Column<'c>],
        gaps: bool,
    ) -> Result<table::Table<'c>, ReadError> {
        let table = self.named_table(key, name, known, gaps)?;
        if key == "data" {
            *self.columns.borrow_mut() = table.contents();
        }
        Ok(table)
    }

    /// The table of a name that a key holds.
    ///
    /// # Errors
    /// As [`Header::table`].
    pub fn named_table<'c>(
        &self,
        key: &str,
        name: &str,
        known: &[Column<'c>],
        gaps: bool,
    ) -> Result<super::Table<'c>, ReadError> {
        within(&self.file, key, name)?;
        table::Table::read(self.source.shown(name), self.source.sheet(name)?, known, gaps)
    }

    /// The file of a name that a key holds, or a cell of the table `asked_by`.
    ///
    /// # Errors
    /// [`ReadError::Value`] where it is not in the recording's folder; [`ReadError::Open`], [`ReadError::TooLarge`].
    pub fn named_file(&self, asked_by: &str, key: &str, name: &str) -> Result<NamedFile, ReadError> {
        self.source.named(asked_by, key, name)
    }

    /// What the columns of numbers of the recording's table hold, once it was read.
    pub(crate) fn columns(&self) -> Vec<ColumnContents> {
        self.columns.borrow().clone()
    }

    /// What is to be said of values that are a template's, not this rig's.
    pub(crate) fn placeholders(&self) -> Option<String> {
        let keys = self.placeholders.join(", ");
        let say = || format!("recording.toml holds a template's values for {keys}: write your rig's there");
        (!keys.is_empty()).then(say)
    }

    /// Whether cells of what is to be predicted may be empty.
    pub fn gaps(&self) -> bool {
        self.gaps
    }

    /// The keys outside any section.
    pub fn root(&self) -> Section<'_> {
        Section { header: self, table: Some(&self.root), path: String::new() }
    }

    /// A section; empty where the file has none.
    ///
    /// # Errors
    /// [`ReadError::Value`] where the key holds something else.
    pub fn section(&self, name: &str) -> Result<Section<'_>, ReadError> {
        match self.root().value(name) {
            None => Ok(Section { header: self, table: None, path: format!("{name}.") }),
            Some(Value::Table(table)) => {
                Ok(Section { header: self, table: Some(table), path: format!("{name}.") })
            }
            Some(other) => Err(self.wrong(name, other, "a section")),
        }
    }

    /// Complains of the first key that nobody has asked for.
    ///
    /// # Errors
    /// [`ReadError::UnknownKey`].
    pub fn finish(&self) -> Result<(), ReadError> {
        let asked = self.asked.borrow();
        let mut unknown = None;
        visit(&self.root, "", &mut |key| {
            if !asked.contains(&key) && unknown.is_none() {
                unknown = Some(key);
            }
        });
        match unknown {
            None => Ok(()),
            Some(key) => {
                let expected: Vec<&str> = asked.iter().map(String::as_str).collect();
                Err(ReadError::UnknownKey {
                    file: self.file.clone(),
                    key: one_line(&key),
                    expected: expected.join(", "),
                })
            }
        }
    }

    fn wrong(&self, key: &str, got: &Value, expected: &str) -> ReadError {
        let got = match got {
            Value::String(s) => quoted(s),
            Value::Table(_) => "a section".into(),
            Value::Array(_) => "a list".into(),
            other => one_line(&other.to_string()),
        };
        ReadError::Value { file: self.file.clone(), key: key.into(), got, expected: expected.into() }
    }

    fn missing(&self, key: &str, expected: &str) -> ReadError {
        ReadError::MissingKey { file: self.file.clone(), key: key.into(), expected: expected.into() }
    }
}

/// Keys behind whose values a comment begins with [`PLACEHOLDER`].
fn placeholders(text: &str) -> Vec<String> {
    let marked = |line: &str| {
        let (before, comment) = line.rsplit_once("# ")?;
        let (key, _) = before.split_once('=')?;
        let marked = comment.starts_with(PLACEHOLDER) && !key.trim_start().starts_with('#');
        marked.then(|| one_line(key.trim()))
    };
    text.lines().filter_map(marked).collect()
}

/// Visits the full name of every key that holds no section.
fn visit(table: &Table, path: &str, seen: &mut impl FnMut(String)) {
    for (key, value) in table {
        match value {
            Value::Table(inner) if !inner.is_empty() => visit(inner, &format!("{path}{key}."), seen),
            Value::Table(_) => {}
            Value::Array(list) if !list.is_empty() && list.iter().all(Value::is_table) => {
                for (k, inner) in list.iter().filter_map(Value::as_table).enumerate() {
                    visit(inner, &format!("{path}{key}[{k}]."), seen);
                }
            }
            _ => seen(format!("{path}{key}")),
        }
    }
}

impl<'a> Section<'a> {
    fn value(&self, key: &str) -> Option<&'a Value> {
        self.header.asked.borrow_mut().insert(format!("{}{key}", self.path));
        self.table.and_then(|t| t.get(key))
    }

    /// A section within the section (empty where it is absent).
    ///
    /// # Errors
    /// [`ReadError::Value`] where the key holds something else.
    pub fn section(&self, name: &str) -> Result<Section<'a>, ReadError> {
        let path = format!("{}{name}.", self.path);
        match self.table.and_then(|t| t.get(name)) {
            None => Ok(Section { header: self.header, table: None, path }),
            Some(Value::Table(table)) => Ok(Section { header: self.header, table: Some(table), path }),
            Some(other) => Err(self.header.wrong(&format!("{}{name}", self.path), other, "a section")),
        }
    }

    /// The sections of a list of them (`[[key]]`), in the order of the file; none where it is absent.
    ///
    /// # Errors
    /// [`ReadError::Value`] where the key holds something else.
    pub fn sections(&self, key: &str) -> Result<Vec<Section<'a>>, ReadError> {
        let name = format!("{}{key}", self.path);
        let Some(value) = self.table.and_then(|t| t.get(key)) else { return Ok(Vec::new()) };
        let tables: Option<Vec<&'a Table>> =
            value.as_array().map(|list| list.iter().map(Value::as_table).collect()).unwrap_or_default();
        let Some(tables) = tables else { return Err(self.header.wrong(&name, value, "sections in [[ ]]")) };
        let one =
            |(k, table)| Section { header: self.header, table: Some(table), path: format!("{name}[{k}].") };
        Ok(tables.into_iter().enumerate().map(one).collect())
    }

    /// True or false, if it is there.
    ///
    /// # Errors
    /// [`ReadError::Value`].
    pub fn flag(&self, key: &str) -> Result<Option<bool>, ReadError> {
        match self.value(key) {
            None => Ok(None),
            Some(Value::Boolean(flag)) => Ok(Some(*flag)),
            Some(other) => Err(self.header.wrong(&format!("{}{key}", self.path), other, "true or false")),
        }
    }

    /// A number within `[lower, upper]` that has to be there.
    ///
    /// # Errors
    /// [`ReadError::MissingKey`], [`ReadError::Value`].
    pub fn required(&self, key: &str, lower: f64, upper: f64) -> Result<f64, ReadError> {
        let missing = || {
            self.header.missing(&format!("{}{key}", self.path), &format!("a number from {lower} to {upper}"))
        };
        self.number(key, lower, upper)?.ok_or_else(missing)
    }

    /// Complains of a key's value.
    pub fn unfit(&self, key: &str, got: impl Into<String>, expected: impl Into<String>) -> ReadError {
        ReadError::Value {
            file: self.header.file.clone(),
            key: format!("{}{key}", self.path),
            got: got.into(),
            expected: expected.into(),
        }
    }

    /// The names of the keys in the section.
    pub fn keys(&self) -> Vec<String> {
        self.table.map(|t| t.keys().cloned().collect()).unwrap_or_default()
    }

    /// A number within `[lower, upper]`, if it is there.
    ///
    /// # Errors
    /// [`ReadError::Value`].
    pub fn number(&self, key: &str, lower: f64, upper: f64) -> Result<Option<f64>, ReadError> {
        let Some(value) = self.value(key) else { return Ok(None) };
        let number = match value {
            Value::Float(v) => Some(*v),
            Value::Integer(v) => Some(*v as f64),
            _ => None,
        };
        match number {
            Some(v) if v >= lower && v <= upper => Ok(Some(v)),
            _ => {
                let expected = format!("a number from {lower} to {upper}");
                Err(self.header.wrong(&format!("{}{key}", self.path), value, &expected))
            }
        }
    }

    /// A number or a text that has to be there.
    ///
    /// # Errors
    /// [`ReadError::MissingKey`], [`ReadError::Value`].
    pub fn number_or_text(&self, key: &str, expected: &str) -> Result<Result<f64, &'a str>, ReadError> {
        match self.value(key) {
            Some(Value::String(text)) => Ok(Err(text)),
            Some(Value::Float(v)) if v.is_finite() => Ok(Ok(*v)),
            Some(Value::Integer(v)) => Ok(Ok(*v as f64)),
            Some(other) => Err(self.header.wrong(&format!("{}{key}", self.path), other, expected)),
            None => Err(self.header.missing(&format!("{}{key}", self.path), expected)),
        }
    }

    /// A list of numbers within `[lower, upper]`, if the key holds a list.
    ///
    /// # Errors
    /// [`ReadError::Value`].
    pub fn list(&self, key: &str, lower: f64, upper: f64) -> Result<Option<Vec<f64>>, ReadError> {
        let Some(list) = self.value(key).and_then(Value::as_array) else { return Ok(None) };
        let number = |v: &Value| v.as_float().or_else(|| v.as_integer().map(|i| i as f64));
        let numbers: Option<Vec<f64>> = list.iter().map(number).collect();
        match numbers.filter(|n| !n.is_empty() && n.iter().all(|v| *v >= lower && *v <= upper)) {
            Some(numbers) => Ok(Some(numbers)),
            None => {
                let expected = format!("numbers from {lower} to {upper}");
                Err(self.unfit(key, "another list", expected))
            }
        }
    }

    /// A list of texts, if it is there; at least one.
    ///
    /// # Errors
    /// [`ReadError::Value`].
    pub fn texts(&self, key: &str) -> Result<Option<Vec<&'a str>>, ReadError> {
        let Some(value) = self.value(key) else { return Ok(None) };
        let texts: Option<Vec<&str>> =
            value.as_array().map(|list| list.iter().map(Value::as_str).collect()).unwrap_or_default();
        match texts.filter(|t| !t.is_empty()) {
            Some(texts) => Ok(Some(texts)),
            None => Err(self.header.wrong(&format!("{}{key}", self.path), value, "a list of texts")),
        }
    }

    /// A list of points in space (m), if it is there.
    ///
    /// # Errors
    /// [`ReadError::Value`].
    pub fn points(&self, key: &str) -> Result<Option<Vec<[f64; 3]>>, ReadError> {
        let Some(value) = self.value(key) else { return Ok(None) };
        let number = |v: &Value| v.as_float().or_else(|| v.as_integer().map(|i| i as f64));
        let point = |v: &Value| -> Option<[f64; 3]> {
            let list: Option<Vec<f64>> = v.as_array()?.iter().map(number).collect();
            let point: [f64; 3] = list?.try_into().ok()?;
            point.iter().all(|x| x.abs() <= 1e3).then_some(point)
        };
        let points: Option<Vec<[f64; 3]>> =
            value.as_array().map(|list| list.iter().map(point).collect()).unwrap_or_default();
        match points.filter(|p| !p.is_empty()) {
            Some(points) => Ok(Some(points)),
            None => {
                let expected = "a list of points [x, y, z] in metres";
                Err(self.header.wrong(&format!("{}{key}", self.path), value, expected))
            }
        }
    }

    /// A text, if it is there.
    ///
    /// # Errors
    /// [`ReadError::Value`].
    pub fn optional_text(&self, key: &str, expected: &str) -> Result<Option<&'a str>, ReadError> {
        match self.value(key) {
            None => Ok(None),
            Some(_) => self.text(key, expected).map(Some),
        }
    }

    /// A text.
    ///
    /// # Errors
    /// [`ReadError::MissingKey`], [`ReadError::Value`].
    pub fn text(&self, key: &str, expected: &str) -> Result<&'a str, ReadError> {
        let name = format!("{}{key}", self.path);
        match self.value(key) {
            Some(Value::String(text)) => Ok(text),
            Some(other) => Err(self.header.wrong(&name, other, expected)),
            None => Err(self.header.missing(&name, expected)),
        }
    }
}
