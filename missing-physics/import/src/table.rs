//! What is read from files, before anybody knows what it means.

use std::path::PathBuf;

use crate::names::Name;
use crate::units::{self, Unit};

/// A column's cells.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Text; empty where nothing stands.
    Labels(Vec<String>),
    /// Numbers; NaN where nothing stands.
    Numbers(Vec<f64>),
}

/// A column as it was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its whole name as the file has it.
    pub title: String,
    /// The name taken apart.
    pub(crate) name: Name,
    /// Its cells.
    pub values: Values,
}

/// Columns of equally many rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// The file.
    pub file: PathBuf,
    /// The part of the file (a topic of a bag), where it has parts.
    pub part: Option<String>,
    /// The columns in the order of the file.
    pub columns: Vec<Column>,
    /// The column that holds the time of each row, where the format says so.
    pub time: Option<usize>,
    /// The column that tells runs apart, where the format says so.
    pub run: Option<usize>,
    /// What was left out or guessed while it was read, a sentence each.
    pub remarks: Vec<String>,
}

impl Values {
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Labels(labels) => labels.len(),
            Self::Numbers(numbers) => numbers.len(),
        }
    }

    /// A cell as a person reads it; nothing beyond the last row.
    pub fn show(&self, row: usize) -> String {
        match self {
            Self::Labels(labels) => labels.get(row).cloned().unwrap_or_default(),
            Self::Numbers(numbers) => {
                numbers.get(row).filter(|v| v.is_finite()).map_or_else(|| "-".into(), |v| short(*v))
            }
        }
    }
}

impl Column {
    /// A column whose unit stands in its title, if anywhere.
    pub fn new(title: impl Into<String>, values: Values) -> Self {
        let title = title.into().trim().to_owned();
        Self { name: Name::parse(&title), title, values }
    }

    /// A column whose unit the format knows.
    pub fn with_unit(title: impl Into<String>, unit: &str, values: Values) -> Self {
        let mut column = Self::new(title, values);
        let known = units::readings(unit);
        if !known.is_empty() {
            column.name.unit = Some(unit.to_owned());
            column.name.units = known;
        }
        column
    }

    /// The unit that its title, or the format, says.
    pub fn unit(&self) -> Option<&str> {
        self.name.unit.as_deref()
    }

    pub(crate) fn numbers(&self) -> Option<&[f64]> {
        match &self.values {
            Values::Numbers(numbers) => Some(numbers),
            Values::Labels(_) => None,
        }
    }

    /// The unit in which it measures something of this kind; `Err` where its unit is one of something else.
    pub(crate) fn unit_for(&self, wanted: Option<Unit>) -> Result<Option<Unit>, ()> {
        match wanted {
            _ if self.name.units.is_empty() => Ok(None),
            None => Ok(self.name.units.first().copied()),
            Some(wanted) => {
                let fits = self.name.units.iter().find(|u| u.dimension == wanted.dimension);
                fits.map(|u| Some(*u)).ok_or(())
            }
        }
    }
}

impl Table {
    /// A table of a whole file.
    pub(crate) fn new(file: impl Into<PathBuf>, columns: Vec<Column>) -> Self {
        Self { file: file.into(), part: None, columns, time: None, run: None, remarks: Vec::new() }
    }

    /// The number of its rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |c| c.values.len())
    }
}

/// A number with six digits at most.
pub(crate) fn short(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        "0".into()
    } else if (1e-4..1e7).contains(&size) {
        let digits = (5 - size.log10().floor() as i32).clamp(0, 9) as usize;
        let text = format!("{value:.digits$}");
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    } else {
        format!("{value:.4e}")
    }
}
