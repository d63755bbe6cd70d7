//! The modulus behind curves of force against indentation.

use hertz_contact::fit::{Curve, Fit, Workspace};
use hertz_contact::indenter::Indenter;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::array::column;
use crate::errors::refused;

/// Fits one Young's modulus to curves; `shape` is `sphere` or `cylinder` with its radius in m, or `cone` with its angle in rad.
#[pyfunction]
pub(crate) fn fit_contact<'py>(
    py: Python<'py>,
    curves: Vec<(Bound<'py, PyAny>, Bound<'py, PyAny>)>,
    shape: &str,
    size: f64,
    poisson_ratio: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let indenter = match shape {
        "sphere" => Indenter::Sphere { radius_m: size },
        "cylinder" => Indenter::Cylinder { radius_m: size },
        "cone" => Indenter::Cone { angle_rad: size },
        other => {
            return Err(refused(format!(
                "no indenter {other:?}, expected \"sphere\", \"cylinder\" or \"cone\""
            )));
        }
    };
    let columns = curves
        .iter()
        .map(|(depth, force)| Ok((column(depth, "indentation_m")?, column(force, "force_n")?)))
        .collect::<PyResult<Vec<_>>>()?;
    let curves: Vec<Curve<'_>> = columns
        .iter()
        .map(|(depth, force)| Curve { indentation_m: depth, force_n: force, sigma_n: None })
        .collect();
    let fit = Fit::new(indenter, poisson_ratio);
    let report = py.detach(|| fit.run(&curves, &mut Workspace::new())).map_err(refused)?;
    let said = PyDict::new(py);
    said.set_item("modulus_pa", report.modulus_pa)?;
    said.set_item("modulus_interval_pa", report.modulus_interval_pa)?;
    said.set_item("converged", report.converged)?;
    let curve = |c: &hertz_contact::fit::CurveReport| {
        (
            c.contact_m,
            c.contact_interval_m,
            c.offset_n,
            c.sigma_n,
            c.depth_m,
            c.flags.misfit,
            c.flags.contact_undetermined,
        )
    };
    said.set_item("curves", report.curves.iter().map(curve).collect::<Vec<_>>())?;
    Ok(said)
}
