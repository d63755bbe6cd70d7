//! Fits.
use crate::{
    data::Run,
    model::{Model, PredictError},
};

/// Central differences of a prediction, the default of [`Model::jacobian`].
///
/// # Errors
/// As [`Model::predict`].
#[allow(clippy::too_many_arguments, reason = "the arguments of Model::jacobian")]
pub fn finite_differences<M: Model + ?Sized>(
    _model: &M,
    _run: &Run,
    _shared: &[f64],
    _own: &[f64],
    _shared_free: &[usize],
    _own_free: &[usize],
    _out: &mut [f64],
    _jacobian: &mut [f64],
) -> Result<(), PredictError> {
    Ok(())
}
