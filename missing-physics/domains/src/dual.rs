//! Derivatives of a prediction that is written in dual numbers, several parameters at a time.

use missing_physics::data::Run;
use missing_physics::model::{Model, PredictError};
use num_dual::{Derivative, DualNum, DualSVec64};

/// A model whose prediction is written in any number.
pub(super) trait DualModel: Model {
    /// Whether the shared parameter at a slot can change this run at all; where it cannot, its derivative is zero without a prediction.
    fn acts_on(&self, _run: &Run, _shared_slot: usize) -> bool {
        true
    }

    /// Predicts as [`Model::predict`] does; `moving` are the slots that carry a derivative.
    fn predict_dual<T: DualNum<Primitive = f64, Real = f64> + Copy>(
        &self,
        run: &Run,
        shared: &[T],
        nuisance: &[T],
        moving: Moving<'_>,
        out: &mut [T],
    ) -> Result<(), String>;
}

/// Slots of the parameters that carry a derivative.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Moving<'a> {
    pub(super) shared: &'a [usize],
    pub(super) nuisance: &'a [usize],
}

/// What [`Model::jacobian`] is asked for.
pub(super) struct JacobianRequest<'a> {
    pub(super) run: &'a Run,
    pub(super) shared: &'a [f64],
    pub(super) nuisance: &'a [f64],
    pub(super) shared_free: &'a [usize],
    pub(super) nuisance_free: &'a [usize],
}

/// A free parameter: its column, whether it is shared, and its slot.
type Free = (usize, bool, usize);

impl JacobianRequest<'_> {
    /// Fills `out` with the prediction of a model, and `jacobian` with its derivatives.
    pub(super) fn fill(
        &self,
        model: &impl DualModel,
        out: &mut [f64],
        jacobian: &mut [f64],
    ) -> Result<(), PredictError> {
        let rows = out.len();
        let nuisance =
            self.nuisance_free.iter().enumerate().map(|(k, &s)| (self.shared_free.len() + k, false, s));
        let all = self.shared_free.iter().enumerate().map(|(k, &s)| (k, true, s)).chain(nuisance);
        let (acting, idle): (Vec<Free>, Vec<Free>) =
            all.partition(|&(_, is_shared, slot)| !is_shared || model.acts_on(self.run, slot));
        idle.iter().for_each(|(column, ..)| jacobian[column * rows..][..rows].fill(0.0));
        if acting.is_empty() {
            return model.predict(self.run, self.shared, self.nuisance, out);
        }
        // Numbers no longer than needed: most time goes into their derivatives.
        for chunk in acting.chunks(8) {
            match chunk.len() {
                0..=2 => self.columns::<2>(model, chunk, out, jacobian),
                3..=4 => self.columns::<4>(model, chunk, out, jacobian),
                5..=6 => self.columns::<6>(model, chunk, out, jacobian),
                _ => self.columns::<8>(model, chunk, out, jacobian),
            }
            .map_err(|reason| PredictError { run: self.run.label.clone(), reason })?;
        }
        Ok(())
    }

    /// The columns of at most `N` parameters.
    fn columns<const N: usize>(
        &self,
        model: &impl DualModel,
        free: &[Free],
        out: &mut [f64],
        jacobian: &mut [f64],
    ) -> Result<(), String> {
        let rows = out.len();
        let mut shared: Vec<DualSVec64<N>> = self.shared.iter().map(|v| (*v).into()).collect();
        let mut nuisance: Vec<DualSVec64<N>> = self.nuisance.iter().map(|v| (*v).into()).collect();
        for (i, &(_, is_shared, slot)) in free.iter().enumerate() {
            let target = if is_shared { &mut shared[slot] } else { &mut nuisance[slot] };
            let mut unit = nalgebra::SVector::<f64, N>::zeros();
            unit[i] = 1.0;
            target.eps = Derivative::some(unit);
        }
        let slots =
            |shared: bool| -> Vec<usize> { free.iter().filter(|f| f.1 == shared).map(|f| f.2).collect() };
        let moving = Moving { shared: &slots(true), nuisance: &slots(false) };
        let mut values = vec![DualSVec64::<N>::from(0.0); rows];
        model.predict_dual(self.run, &shared, &nuisance, moving, &mut values)?;
        for (row, value) in values.iter().enumerate() {
            out[row] = value.re;
            for (i, (column, ..)) in free.iter().enumerate() {
                jacobian[column * rows + row] = value.eps.0.map_or(0.0, |e| e[i]);
            }
        }
        Ok(())
    }
}
