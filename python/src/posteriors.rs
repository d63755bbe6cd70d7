//! Posteriors that are learned from simulations.

use bayes_sim::autoregressive::{Autoregressive, AutoregressiveSettings};
use bayes_sim::error::Error;
use bayes_sim::mdn::{Mdn, MdnSettings};
use bayes_sim::mdrff::{Mdrff, MdrffSettings};
use bayes_sim::points::Points;
use bayes_sim::posterior::ConditionalDensity;
use bayes_sim::prior::Prior as Box_;
use bayes_sim::save::Saved as _;
use bayes_sim::simulations::Simulations;
use numpy::PyArray2;
use pyo3::prelude::*;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use std::path::PathBuf;

use crate::array::{column, rows};
use crate::errors::Failed;

fn failed(error: Error) -> PyErr {
    Failed::new("PosteriorError", error.to_string()).into()
}

fn points(values: &Bound<'_, PyAny>, name: &str) -> PyResult<Points> {
    let rows = rows(values, name)?;
    let dim = rows.first().map_or(0, Vec::len);
    Points::from_values(dim, rows.concat()).map_err(failed)
}

fn array<'py>(py: Python<'py>, points: &Points) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let rows: Vec<Vec<f64>> = points.rows().map(<[f64]>::to_vec).collect();
    Ok(PyArray2::from_vec2(py, &rows)?)
}

/// A prior that is flat in a box.
#[pyclass(frozen, module = "missing_physics._engine")]
pub(crate) struct Prior(Box_);

#[pymethods]
impl Prior {
    #[new]
    fn new(low: Vec<f64>, high: Vec<f64>) -> PyResult<Self> {
        if low.len() != high.len() {
            let (low, high) = (low.len(), high.len());
            return Err(
                Failed::new("PosteriorError", format!("{low} lower bounds, {high} upper ones")).into()
            );
        }
        let bounds: Vec<[f64; 2]> = low.into_iter().zip(high).map(|(low, high)| [low, high]).collect();
        Box_::uniform(&bounds).map(Self).map_err(failed)
    }

    /// Draws, one row each.
    fn sample<'py>(&self, py: Python<'py>, count: usize, seed: u64) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let rows: Vec<Vec<f64>> = (0..count).map(|_| self.0.sample(&mut rng)).collect();
        Ok(PyArray2::from_vec2(py, &rows)?)
    }

    /// The logarithm of the density of each row.
    fn log_prob(&self, theta: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
        points(theta, "theta")?.rows().map(|t| self.0.ln_density(t).map_err(failed)).collect()
    }
}

#[derive(Debug)]
enum Kind {
    Mdn(Mdn),
    Mdrff(Mdrff),
    Autoregressive(Autoregressive),
}

/// A density of parameters given an observation.
#[pyclass(frozen, module = "missing_physics._engine")]
pub(crate) struct Density(Kind);

impl Density {
    fn get(&self) -> &dyn ConditionalDensity {
        match &self.0 {
            Kind::Mdn(density) => density,
            Kind::Mdrff(density) => density,
            Kind::Autoregressive(density) => density,
        }
    }
}

#[pymethods]
impl Density {
    /// Learns it from simulations: `kind` is `mdn`, `mdrff` or `autoregressive`; `epochs` 0 for the usual most.
    #[staticmethod]
    fn train(
        py: Python<'_>,
        prior: &Prior,
        theta: &Bound<'_, PyAny>,
        x: &Bound<'_, PyAny>,
        kind: &str,
        epochs: usize,
        seed: u64,
    ) -> PyResult<Self> {
        let simulations = Simulations::new(points(theta, "theta")?, points(x, "x")?).map_err(failed)?;
        let (prior, kind) = (&prior.0, kind.to_owned());
        let most = |usual: usize| if epochs == 0 { usual } else { epochs };
        let learned = py.detach(|| match kind.as_str() {
            "mdn" => {
                let mut settings = MdnSettings::default();
                settings.training.max_epochs = most(settings.training.max_epochs);
                Mdn::train(prior, &simulations, &settings, seed).map(Kind::Mdn).map_err(|e| e.to_string())
            }
            "mdrff" => {
                let mut settings = MdrffSettings::default();
                settings.training.max_epochs = most(settings.training.max_epochs);
                Mdrff::train(prior, &simulations, &settings, seed).map(Kind::Mdrff).map_err(|e| e.to_string())
            }
            "autoregressive" => {
                let mut settings = AutoregressiveSettings::default();
                settings.training.max_epochs = most(settings.training.max_epochs);
                let learned = Autoregressive::train(prior, &simulations, &settings, seed);
                learned.map(Kind::Autoregressive).map_err(|e| e.to_string())
            }
            other => Err(format!("no density {other:?}, expected \"mdn\", \"mdrff\" or \"autoregressive\"")),
        });
        learned.map(Self).map_err(|why| Failed::new("PosteriorError", why).into())
    }

    /// Draws given an observation, one row each.
    fn sample<'py>(
        &self,
        py: Python<'py>,
        x: &Bound<'py, PyAny>,
        count: usize,
        seed: u64,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let x = column(x, "x")?;
        let drawn = py.detach(|| self.get().sample(&x, count, &mut ChaCha8Rng::seed_from_u64(seed)));
        array(py, &drawn.map_err(failed)?)
    }

    /// The logarithm of the density of each row, given an observation; minus infinity outside the prior.
    fn log_prob(&self, py: Python<'_>, theta: &Bound<'_, PyAny>, x: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
        let (theta, x) = (points(theta, "theta")?, column(x, "x")?);
        py.detach(|| self.get().ln_densities(&theta, &x)).map_err(failed)
    }

    /// Writes it to a file.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        let saved = match &self.0 {
            Kind::Mdn(density) => density.save(&path),
            Kind::Mdrff(density) => density.save(&path),
            Kind::Autoregressive(density) => density.save(&path),
        };
        saved.map_err(failed)
    }

    /// Reads it from a file.
    #[staticmethod]
    fn load(path: PathBuf, kind: &str) -> PyResult<Self> {
        let loaded = match kind {
            "mdn" => Mdn::load(&path).map(Kind::Mdn),
            "mdrff" => Mdrff::load(&path).map(Kind::Mdrff),
            _ => Autoregressive::load(&path).map(Kind::Autoregressive),
        };
        loaded.map(Self).map_err(failed)
    }
}
