//! Grains that are poured, and what a picture of them tells.

use bayes_sim::points::Points;
use granular_infer::posterior::GrainPosterior;
use granular_infer::scene::{Grain, SERIES_M, Scene};
use granular_infer::summary::{COUNT, NAMES};
use granular_infer::view::View;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

use crate::array::{array, column};
use crate::errors::refused;

/// Places of the grains after a pour (grains, 3), m, and the 16 statistics of a depth picture of them.
type Poured<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>);

/// Pours once: sliding friction, rolling friction and restitution of the grains, the outlet's height above the cloth (m).
#[pyfunction]
pub(crate) fn pour_grains<'py>(
    py: Python<'py>,
    grain: [f64; 3],
    height_m: f64,
    seed: u64,
) -> PyResult<Poured<'py>> {
    let grain = Grain { sliding_friction: grain[0], rolling_friction: grain[1], restitution: grain[2] };
    let (scene, view) = (Scene::default(), View::default());
    let (places, statistics) = py
        .detach(|| {
            let grains = scene.grains(&grain, height_m, seed).map_err(|error| error.to_string())?;
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let statistics =
                view.features(&grains, &scene.rig, &mut rng).map_err(|error| error.to_string())?;
            let places: Vec<Vec<f64>> = grains.positions_m.iter().map(|p| vec![p[0], p[1], p[2]]).collect();
            Ok::<_, String>((places, statistics))
        })
        .map_err(refused)?;
    Ok((PyArray2::from_vec2(py, &places)?, array(py, &statistics)))
}

/// Draws of a posterior (draws, 3), its mean, and how many pictures in one are as unlike the others.
type Inferred<'py> = (Bound<'py, PyArray2<f64>>, [f64; 3], f64);

/// What statistics of one picture, or of one from each of [`SERIES_M`] one after the other, tell of the grains, by the posteriors that are shipped: on
/// the scene's velvet, or of a series on any cloth.
#[pyfunction]
pub(crate) fn infer_grains<'py>(
    py: Python<'py>,
    statistics: &Bound<'py, PyAny>,
    any_cloth: bool,
    count: usize,
    seed: u64,
) -> PyResult<Inferred<'py>> {
    let values = column(statistics, "statistics")?;
    let (pictures, rest) = values.as_chunks::<COUNT>();
    let learned = match (pictures.len(), rest) {
        (1, []) if any_cloth => {
            let three = SERIES_M.len();
            return Err(refused(format!("any_cloth is learned from {three} heaps; of one it is not known")));
        }
        (1, []) => GrainPosterior::shipped(),
        (n, []) if n == SERIES_M.len() && any_cloth => GrainPosterior::shipped_cloths(),
        (n, []) if n == SERIES_M.len() => GrainPosterior::shipped_series(),
        _ => {
            let (got, three) = (values.len(), SERIES_M.len());
            return Err(refused(format!("{got} statistics, expected {COUNT}, or {three} times {COUNT}")));
        }
    };
    let inferred = learned.map_err(refused)?.infer_series(pictures).map_err(refused)?;
    let drawn: Points =
        inferred.posterior.sample(count, &mut ChaCha8Rng::seed_from_u64(seed)).map_err(refused)?;
    let draws: Vec<Vec<f64>> = drawn.rows().map(<[f64]>::to_vec).collect();
    Ok((
        PyArray2::from_vec2(py, &draws)?,
        inferred.estimate().map_err(refused)?.theta(),
        inferred.resemblance.p_value,
    ))
}

/// Heights from which the grains of a series are poured, m.
#[pyfunction]
pub(crate) fn grain_series() -> [f64; SERIES_M.len()] {
    SERIES_M
}

/// Names of the statistics, in their order.
#[pyfunction]
pub(crate) fn grain_statistics() -> Vec<&'static str> {
    NAMES.to_vec()
}
