//! The simulation behind a diagnosis, and what a rig could do next.

use crate::data::Run;
use crate::model::error::PredictError;
use crate::model::extensions::Extensions;
use crate::model::spec::{Scope, Spec};

/// A full model: a simulation with every effect in it.
///
/// Parameters come in two slices: `shared` (those with [`Scope::Shared`], in the order of [`Spec::parameters`]) and
/// `nuisance` (those with [`Scope::PerRun`], in that order too). A prediction fills `out` channel by channel:
/// `out[c * run.len() + i]` is channel `c` at row `i`.
///
/// These methods serve every simulation; what only some of them know is in [`Extensions`].
pub trait Model: Sync {
    /// Parameters, mechanisms and candidate terms; the same at every call.
    fn spec(&self) -> &Spec;

    /// Predicts all channels of a run.
    ///
    /// # Errors
    /// [`PredictError`] where the simulation has no answer at these parameters.
    fn predict(
        &self,
        run: &Run,
        shared: &[f64],
        nuisance: &[f64],
        out: &mut [f64],
    ) -> Result<(), PredictError>;

    /// Fills in good starting values of the run's nuisance parameters; `nuisance` holds each parameter's `start`.
    fn nuisance_start(&self, _run: &Run, _nuisance: &mut [f64]) {}

    /// What the model knows beyond its predictions; nothing by default.
    fn extensions(&self) -> Extensions<'_> {
        Extensions::default()
    }

    /// Step of the differences that stand for derivatives, in scales of a parameter: well above the simulation's own rounding.
    fn relative_step(&self) -> f64 {
        1e-5
    }

    /// The derivatives of [`Model::predict`] with respect to the shared parameters at the slots `shared_free` and
    /// the nuisance parameters at the slots `nuisance_free`, one column after the other, each as long as `out`.
    ///
    /// The default takes [`finite_differences`].
    ///
    /// # Errors
    /// As [`Model::predict`].
    #[allow(
        clippy::too_many_arguments,
        reason = "a derivative needs the prediction's arguments, what is free, and room"
    )]
    fn jacobian(
        &self,
        run: &Run,
        shared: &[f64],
        nuisance: &[f64],
        shared_free: &[usize],
        nuisance_free: &[usize],
        out: &mut [f64],
        jacobian: &mut [f64],
    ) -> Result<(), PredictError> {
        finite_differences(self, run, shared, nuisance, shared_free, nuisance_free, out, jacobian)
    }
}

/// Central differences of a prediction at steps of [`Model::relative_step`], one-sided at a bound: the default of
/// [`Model::jacobian`].
///
/// # Errors
/// As [`Model::predict`].
#[allow(clippy::too_many_arguments, reason = "the arguments of Model::jacobian")]
pub fn finite_differences<M: Model + ?Sized>(
    model: &M,
    run: &Run,
    shared: &[f64],
    nuisance: &[f64],
    shared_free: &[usize],
    nuisance_free: &[usize],
    out: &mut [f64],
    jacobian: &mut [f64],
) -> Result<(), PredictError> {
    model.predict(run, shared, nuisance, out)?;
    let rows = out.len().max(1);
    let (mut above, mut below) = (vec![0.0; out.len()], vec![0.0; out.len()]);
    let pairs = difference_points(model, shared, nuisance, shared_free, nuisance_free);
    for (Pair { high, low, step }, column) in pairs.iter().zip(jacobian.chunks_exact_mut(rows)) {
        model.predict(run, &high.0, &high.1, &mut above)?;
        model.predict(run, &low.0, &low.1, &mut below)?;
        for ((d, a), b) in column.iter_mut().zip(&above).zip(&below) {
            *d = (a - b) / step;
        }
    }
    Ok(())
}

/// Two points whose difference stands for a derivative.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// Shared and nuisance parameters with one of them above its value.
    pub high: (Vec<f64>, Vec<f64>),
    /// The same with it below its value.
    pub low: (Vec<f64>, Vec<f64>),
    /// By how much it differs between the two.
    pub step: f64,
}

/// The points at which [`finite_differences`] asks for predictions beside the parameters themselves, one pair a derivative: a simulator
/// that answers many questions at once can be asked for all of them before.
pub fn difference_points<M: Model + ?Sized>(
    model: &M,
    shared: &[f64],
    nuisance: &[f64],
    shared_free: &[usize],
    nuisance_free: &[usize],
) -> Vec<Pair> {
    let parameters = |scope| model.spec().parameters.iter().filter(move |p| p.scope == scope);
    let shared_info: Vec<_> = parameters(Scope::Shared).collect();
    let nuisance_info: Vec<_> = parameters(Scope::PerRun).collect();
    let free = shared_free.iter().map(|&s| (true, s)).chain(nuisance_free.iter().map(|&s| (false, s)));
    let pair = |(is_shared, slot): (bool, usize)| {
        let info = if is_shared { shared_info[slot] } else { nuisance_info[slot] };
        let value = if is_shared { shared[slot] } else { nuisance[slot] };
        let step = model.relative_step() * info.scale.max(1e-3 * value.abs());
        let (high, low) = ((value + step).min(info.upper), (value - step).max(info.lower));
        let at = |x: f64| {
            let (mut shared, mut nuisance) = (shared.to_vec(), nuisance.to_vec());
            *(if is_shared { &mut shared[slot] } else { &mut nuisance[slot] }) = x;
            (shared, nuisance)
        };
        Pair { high: at(high), low: at(low), step: high - low }
    };
    free.map(pair).collect()
}

/// Something that the rig could do next, as the runs that it would record.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// The action's settings, by name with unit (`drop_height_m`).
    pub action: Vec<(String, f64)>,
    /// The action in words (`drop it from 5 m as well`).
    pub words: String,
    /// Runs with their inputs; the measured channels may hold anything.
    pub runs: Vec<Run>,
    /// The nuisance parameters of each run, in the order of the model's nuisance parameters.
    pub nuisance: Vec<Vec<f64>>,
}
