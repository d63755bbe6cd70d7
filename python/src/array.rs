//! Columns of numbers from and to Python.

use numpy::{PyArray1, PyArray2, PyArrayMethods as _, PyUntypedArrayMethods as _};
use pyo3::intern;
use pyo3::prelude::*;

use crate::errors::Failed;

/// A column of numbers: an array of `float64` as it is, anything else as `numpy.asarray` makes it one; `name` is said in errors.
pub(crate) fn column(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<f64>> {
    if let Ok(array) = value.cast::<PyArray1<f64>>() {
        return Ok(array.readonly().as_array().to_vec());
    }
    let array = as_float(value)?;
    match array.cast::<PyArray1<f64>>() {
        Ok(array) => Ok(array.readonly().as_array().to_vec()),
        Err(_) => Err(dimensions(&array, name, 1)),
    }
}

/// Rows of numbers, one column in each: an array of two dimensions.
pub(crate) fn rows(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<Vec<f64>>> {
    let array = as_float(value)?;
    let Ok(array) = array.cast::<PyArray2<f64>>() else { return Err(dimensions(&array, name, 2)) };
    Ok(array.readonly().as_array().outer_iter().map(|row| row.to_vec()).collect())
}

/// A column as an array of Python's.
pub(crate) fn array<'py>(py: Python<'py>, values: &[f64]) -> Bound<'py, PyArray1<f64>> {
    PyArray1::from_slice(py, values)
}

fn as_float<'py>(value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let py = value.py();
    let numpy = py.import(intern!(py, "numpy"))?;
    numpy.call_method1(intern!(py, "asarray"), (value, intern!(py, "float64")))
}

fn dimensions(array: &Bound<'_, PyAny>, name: &str, expected: usize) -> PyErr {
    let got = array.cast::<numpy::PyUntypedArray>().map_or(0, |array| array.ndim());
    Failed::new("ArrayError", format!("{name} has {got} dimensions, expected {expected}")).into()
}
