//! CSV tables with named columns, read strictly.

use super::error::ReadError;
use super::words::{one_line, quoted, unit_of};

/// Numbers beyond this are mistakes of unit or format.
const LARGEST_NUMBER: f64 = 1e12;

/// A column that a table may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Column<'a> {
    /// Name, with its unit as a suffix.
    pub name: &'a str,
    /// What it holds, for a person (`height in metres`).
    pub what: &'a str,
    /// Whether it holds labels rather than numbers.
    pub label: bool,
}

/// What a column of numbers holds.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnContents {
    /// Its name.
    pub name: String,
    /// The unit that its name ends in, or nothing.
    pub unit: &'static str,
    /// The smallest and the largest of its numbers.
    pub range: [f64; 2],
}

/// A column's cells.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Labels.
    Labels(Vec<String>),
    /// Finite numbers; NaN for an empty cell, where they may be empty.
    Numbers(Vec<f64>),
}

/// A table as it comes from a source.
pub(super) enum Sheet {
    /// The text of a CSV file.
    Text(String),
    /// Columns that were never text.
    Columns(std::sync::Arc<[(String, Values)]>),
}

/// A table as it was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Table<'a> {
    /// The file, as errors name it.
    pub file: String,
    /// Names in the order of the file.
    pub names: Vec<&'a str>,
    /// Cells by column, in the same order.
    pub columns: Vec<Values>,
    /// The line on which each row stands, from 1.
    pub lines: Vec<u64>,
}

impl Values {
    /// Number of cells.
    fn len(&self) -> usize {
        match self {
            Self::Labels(labels) => labels.len(),
            Self::Numbers(numbers) => numbers.len(),
        }
    }
}

impl<'a> Table<'a> {
    /// Reads a table whose columns are all among `known`; with `gaps` a cell of a number may be empty.
    ///
    /// # Errors
    /// [`ReadError`]: the first thing that is wrong, from the top.
    pub(super) fn read(
        file: String,
        sheet: Sheet,
        known: &[Column<'a>],
        gaps: bool,
    ) -> Result<Self, ReadError> {
        match sheet {
            Sheet::Text(text) => Self::read_text(file, &text, known, gaps),
            Sheet::Columns(columns) => Self::read_columns(file, &columns, known, gaps),
        }
    }

    /// A table of columns that were never text: rows are counted from 1, and NaN is an empty cell.
    fn read_columns(
        file: String,
        columns: &[(String, Values)],
        known: &[Column<'a>],
        gaps: bool,
    ) -> Result<Self, ReadError> {
        let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
        let chosen = choose(&file, names.into_iter(), known)?;
        let rows = columns.first().map_or(0, |(_, values)| values.len());
        for ((_, values), column) in columns.iter().zip(&chosen) {
            let wrong = |row: usize, got: String, expected: String| {
                let (file, column) = (file.clone(), column.name.to_owned());
                Err(ReadError::Cell { file, row: row as u64 + 1, column, got, expected })
            };
            if values.len() != rows {
                let (got, expected) = (format!("{} cells in all", values.len()), rows.to_string());
                return wrong(values.len().min(rows), got, expected);
            }
            match values {
                Values::Labels(_) if !column.label => {
                    return wrong(0, "a label".into(), format!("a number: {}", column.what));
                }
                Values::Numbers(_) if column.label => {
                    return wrong(0, "a number".into(), "a label".into());
                }
                Values::Labels(labels) => {
                    if let Some(row) = labels.iter().position(String::is_empty) {
                        return wrong(row, "an empty cell".into(), "a label".into());
                    }
                }
                Values::Numbers(numbers) => {
                    let sound = |v: &f64| v.abs() <= LARGEST_NUMBER || (gaps && v.is_nan());
                    if let Some(row) = numbers.iter().position(|v| !sound(v)) {
                        let v = numbers[row];
                        let bound = format!("{} of at most 1e12", column.what);
                        let expected =
                            if v.is_finite() { bound } else { format!("a number: {}", column.what) };
                        return wrong(row, quoted(&v.to_string()), expected);
                    }
                }
            }
        }
        let (names, lines) = (chosen.iter().map(|c| c.name).collect(), (1..=rows as u64).collect());
        let columns = columns.iter().map(|(_, values)| values.clone()).collect();
        Ok(Self { file, names, columns, lines })
    }

    fn read_text(file: String, text: &str, known: &[Column<'a>], gaps: bool) -> Result<Self, ReadError> {
        let mut reader =
            csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(text.as_bytes());
        let mut record = csv::StringRecord::new();
        let read = |reader: &mut csv::Reader<&[u8]>, record: &mut csv::StringRecord| {
            reader
                .read_record(record)
                .map_err(|e| ReadError::Open { file: file.clone(), why: one_line(&e.to_string()) })
        };
        let row = format!("a first row with column names, such as {}", list(known));
        if !read(&mut reader, &mut record)? {
            return Err(ReadError::TooFewRows { file, what: "the file".into(), got: 0, expected: row });
        }
        let chosen = choose(&file, record.iter(), known)?;
        let mut columns: Vec<Values> = chosen
            .iter()
            .map(|c| if c.label { Values::Labels(Vec::new()) } else { Values::Numbers(Vec::new()) })
            .collect();
        let mut lines = Vec::new();
        while read(&mut reader, &mut record)? {
            let line = record.position().map_or(0, csv::Position::line);
            if record.len() != chosen.len() {
                return Err(ReadError::Ragged { file, row: line, got: record.len(), expected: chosen.len() });
            }
            for ((cell, column), values) in record.iter().zip(&chosen).zip(&mut columns) {
                let cell = cell.trim();
                let wrong = |expected: &str| ReadError::Cell {
                    file: file.clone(),
                    row: line,
                    column: column.name.into(),
                    got: if cell.is_empty() { "an empty cell".into() } else { quoted(cell) },
                    expected: expected.into(),
                };
                match values {
                    Values::Labels(_) if cell.is_empty() => return Err(wrong("a label")),
                    Values::Labels(labels) => labels.push(cell.to_owned()),
                    Values::Numbers(numbers) if gaps && cell.is_empty() => numbers.push(f64::NAN),
                    Values::Numbers(numbers) => match cell.parse::<f64>() {
                        Ok(v) if v.is_finite() && v.abs() <= LARGEST_NUMBER => numbers.push(v),
                        Ok(v) if v.is_finite() => {
                            return Err(wrong(&format!("{} of at most 1e12", column.what)));
                        }
                        _ => return Err(wrong(&format!("a number: {}", column.what))),
                    },
                }
            }
            lines.push(line);
        }
        Ok(Self { file, names: chosen.iter().map(|c| c.name).collect(), columns, lines })
    }

    /// A column of numbers, if the table has it.
    pub fn numbers(&self, name: &str) -> Option<&[f64]> {
        let at = self.names.iter().position(|n| *n == name)?;
        match &self.columns[at] {
            Values::Numbers(numbers) => Some(numbers),
            Values::Labels(_) => None,
        }
    }

    /// What the columns of numbers hold.
    pub(super) fn contents(&self) -> Vec<ColumnContents> {
        let column = |(name, values): (&&str, &Values)| match values {
            Values::Numbers(numbers) if !numbers.is_empty() => {
                let low = numbers.iter().copied().fold(f64::INFINITY, f64::min);
                let high = numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                Some(ColumnContents { name: (*name).to_owned(), unit: unit_of(name), range: [low, high] })
            }
            _ => None,
        };
        self.names.iter().zip(&self.columns).filter_map(column).collect()
    }

    /// A column of labels.
    ///
    /// # Errors
    /// [`ReadError::MissingColumn`].
    pub fn labels(&self, name: &str, expected: &str) -> Result<&[String], ReadError> {
        let at = self.names.iter().position(|n| *n == name);
        match at.map(|at| &self.columns[at]) {
            Some(Values::Labels(labels)) => Ok(labels),
            _ => Err(self.missing(name, expected)),
        }
    }

    /// The error for a column that should be there.
    pub fn missing(&self, name: &str, expected: &str) -> ReadError {
        ReadError::MissingColumn { file: self.file.clone(), column: name.into(), expected: expected.into() }
    }

    /// The error for a number in a row (counted from 0 in the columns) that cannot stand there.
    pub fn cell(&self, row: usize, column: &str, got: f64, expected: impl Into<String>) -> ReadError {
        ReadError::Cell {
            file: self.file.clone(),
            row: self.lines[row],
            column: column.into(),
            got: format!("{got}"),
            expected: expected.into(),
        }
    }

    /// The rows of each run, in the order in which the runs begin.
    pub fn by_run(labels: &[String]) -> Vec<(String, Vec<usize>)> {
        let mut places = std::collections::HashMap::new();
        let mut runs: Vec<(String, Vec<usize>)> = Vec::new();
        for (row, label) in labels.iter().enumerate() {
            let at = *places.entry(label.as_str()).or_insert_with(|| {
                runs.push((label.clone(), Vec::new()));
                runs.len() - 1
            });
            runs[at].1.push(row);
        }
        runs
    }
}

/// The known columns that a table's names stand for.
fn choose<'a, 'n>(
    file: &str,
    names: impl Iterator<Item = &'n str>,
    known: &[Column<'a>],
) -> Result<Vec<Column<'a>>, ReadError> {
    let mut chosen: Vec<Column<'a>> = Vec::new();
    for name in names {
        let (file, name) = (file.to_owned(), name.trim());
        let Some(column) = known.iter().find(|c| c.name == name) else {
            return Err(ReadError::UnknownColumn {
                file,
                column: quoted(name),
                expected: meant(name, known),
            });
        };
        if chosen.iter().any(|c| c.name == name) {
            return Err(ReadError::DuplicateColumn { file, column: name.into() });
        }
        chosen.push(*column);
    }
    Ok(chosen)
}

fn list(known: &[Column<'_>]) -> String {
    known.iter().map(|c| c.name).collect::<Vec<_>>().join(", ")
}

/// The column that was meant, where only the unit differs; else all known ones.
fn meant(name: &str, known: &[Column<'_>]) -> String {
    let stem = |n: &str| n.split('_').next().unwrap_or_default().to_ascii_lowercase();
    let close = known.iter().find(|c| !c.label && stem(c.name) == stem(name) && name.len() <= 40);
    match close {
        Some(column) => format!("{} ({})", column.name, column.what),
        None => format!("one of: {}", list(known)),
    }
}
