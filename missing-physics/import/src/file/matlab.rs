//! MATLAB's `.mat` up to version 7: numeric arrays.

use std::path::Path;

use matfile::{MatFile, NumericData};

use super::{Array, guarded, tables_of};
use crate::error::ImportError;
use crate::table::Table;

pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Vec<Table>, ImportError> {
    if bytes.windows(4).take(1024).any(|w| w == b"\x89HDF") {
        return Err(ImportError::broken(path, "MATLAB's version 7.3 is HDF5: save it by save(..., '-v7')"));
    }
    let file = guarded(path, || {
        MatFile::parse(bytes)
            .map_err(|e| ImportError::broken(path, format!("no file of MATLAB up to version 7: {e}")))
    })?;
    let arrays: Vec<Array> = file.arrays().iter().filter_map(array).collect();
    if arrays.is_empty() {
        let why = "no numeric array of one or two axes: structures and tables are not read, save their fields as arrays";
        return Err(ImportError::broken(path, why));
    }
    let mut tables = tables_of(path, arrays);
    if let Some(first) = tables.first_mut() {
        first.remarks.push("what is no numeric array (structures, cells, text) is not read".into());
    }
    Ok(tables)
}

/// An array, row after row; a row vector is a column.
fn array(array: &matfile::Array) -> Option<Array> {
    let &[rows, width] = array.size().as_slice() else { return None };
    let values = values(array.data());
    if rows.checked_mul(width)? != values.len() || width > 4096 && rows > 1 {
        return None;
    }
    let (rows, width) = if rows == 1 { (width, 1) } else { (rows, width) };
    // MATLAB writes column after column.
    let turned = (0..rows).flat_map(|row| (0..width).map(move |column| column * rows + row));
    let values = turned.map(|at| values[at]).collect();
    Some(Array { name: array.name().to_owned(), rows, width, values })
}

fn values(data: &NumericData) -> Vec<f64> {
    fn wide<T: Copy + Into<f64>>(values: &[T]) -> Vec<f64> {
        values.iter().map(|v| (*v).into()).collect()
    }
    match data {
        NumericData::Int8 { real, .. } => wide(real),
        NumericData::UInt8 { real, .. } => wide(real),
        NumericData::Int16 { real, .. } => wide(real),
        NumericData::UInt16 { real, .. } => wide(real),
        NumericData::Int32 { real, .. } => wide(real),
        NumericData::UInt32 { real, .. } => wide(real),
        NumericData::Int64 { real, .. } => real.iter().map(|v| *v as f64).collect(),
        NumericData::UInt64 { real, .. } => real.iter().map(|v| *v as f64).collect(),
        NumericData::Single { real, .. } => wide(real),
        NumericData::Double { real, .. } => real.clone(),
    }
}
