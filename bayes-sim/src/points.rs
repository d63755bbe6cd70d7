//! A table of points: rows of equal length, one after another.

use serde::{Deserialize, Serialize};

use crate::error::Error;

/// `len` points of `dim` numbers each, row after row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Points {
    dim: usize,
    values: Vec<f64>,
}

impl Points {
    /// An empty table of points of `dim` numbers.
    pub fn new(dim: usize) -> Self {
        Self { dim, values: Vec::new() }
    }

    /// A table from numbers that lie row after row.
    ///
    /// # Errors
    /// [`Error::Length`] if the numbers do not fill whole rows; [`Error::Setting`] for `dim` 0.
    pub fn from_values(dim: usize, values: Vec<f64>) -> Result<Self, Error> {
        if dim == 0 {
            return Err(Error::Setting { name: "dim", value: 0.0, rule: "at least 1" });
        }
        if !values.len().is_multiple_of(dim) {
            let expected = values.len().div_ceil(dim) * dim;
            return Err(Error::Length { what: "table", expected, got: values.len() });
        }
        Ok(Self { dim, values })
    }

    /// A table from rows.
    ///
    /// # Errors
    /// [`Error::Length`] for a row that is not `dim` long.
    pub fn from_rows<'a>(dim: usize, rows: impl IntoIterator<Item = &'a [f64]>) -> Result<Self, Error> {
        let mut points = Self::new(dim);
        for row in rows {
            points.push(row)?;
        }
        Ok(points)
    }

    /// Adds a row.
    ///
    /// # Errors
    /// [`Error::Length`] if it is not [`Points::dim`] long.
    pub fn push(&mut self, row: &[f64]) -> Result<(), Error> {
        if row.len() != self.dim {
            return Err(Error::Length { what: "row", expected: self.dim, got: row.len() });
        }
        self.values.extend_from_slice(row);
        Ok(())
    }

    /// Numbers a point has.
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// How many points.
    pub fn len(&self) -> usize {
        self.values.len() / self.dim.max(1)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Point `i`, from 0; empty beyond the end.
    pub fn row(&self, i: usize) -> &[f64] {
        self.values.get(i * self.dim..(i + 1) * self.dim).unwrap_or(&[])
    }

    /// All points in order.
    pub fn rows(&self) -> std::slice::ChunksExact<'_, f64> {
        self.values.chunks_exact(self.dim.max(1))
    }

    /// All numbers, row after row.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// One column.
    pub fn column(&self, j: usize) -> Vec<f64> {
        self.rows().filter_map(|r| r.get(j).copied()).collect()
    }

    /// The rows of these numbers, in this order; those beyond the end are left out.
    pub fn select(&self, indices: &[usize]) -> Self {
        let mut out = Self::new(self.dim);
        for &i in indices {
            out.values.extend_from_slice(self.row(i));
        }
        out
    }

    pub(crate) fn check_finite(&self, what: &'static str) -> Result<(), Error> {
        match self.values.iter().position(|v| !v.is_finite()) {
            None => Ok(()),
            Some(i) => {
                Err(Error::NotFinite { what, row: i / self.dim, column: i % self.dim, value: self.values[i] })
            }
        }
    }
}

/// Refuses a row that is not `expected` long.
pub(crate) fn check_length(what: &'static str, row: &[f64], expected: usize) -> Result<(), Error> {
    if row.len() == expected { Ok(()) } else { Err(Error::Length { what, expected, got: row.len() }) }
}

/// Refuses a row that is not `expected` long, or holds NaN or infinity.
pub(crate) fn check_row(what: &'static str, row: &[f64], expected: usize) -> Result<(), Error> {
    check_length(what, row, expected)?;
    match row.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(column) => Err(Error::NotFinite { what, row: 0, column, value: row[column] }),
    }
}
