//! What some models know beyond their predictions: each kind of knowledge is a trait, and a model says which it has.

use crate::data::Run;
use crate::model::error::PredictError;
use crate::quantity::Quantity;

/// The knowledge that a model has beyond its predictions ([`Model::extensions`](super::Model::extensions)); none by default.
///
/// A model lists what it implements: `Extensions { errors: Some(self), ..Extensions::default() }`.
#[derive(Clone, Copy, Default)]
pub struct Extensions<'a> {
    /// What is known of the errors of measurement.
    pub errors: Option<&'a dyn ErrorModel>,
    /// Where a likelihood with several modes is to be looked at.
    pub modes: Option<&'a dyn MultimodalModel>,
    /// What parameters may not be together.
    pub limits: Option<&'a dyn JointLimits>,
    /// What a cause does that acts at some rows only.
    pub local_causes: Option<&'a dyn LocalCauses>,
    /// A program that makes the predictions.
    pub program: Option<&'a dyn ExternalProgram>,
    /// Which runs are windows of longer ones.
    pub windows: Option<&'a dyn WindowedModel>,
}

impl std::fmt::Debug for Extensions<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Extensions")
            .field("errors", &self.errors.is_some())
            .field("modes", &self.modes.is_some())
            .field("limits", &self.limits.is_some())
            .field("local_causes", &self.local_causes.is_some())
            .field("program", &self.program.is_some())
            .field("windows", &self.windows.is_some())
            .finish()
    }
}

/// A model whose runs are windows of longer ones, in order: an answer speaks of the runs as they were recorded.
pub trait WindowedModel: Sync {
    /// The label of the run that a window is of; nothing where it is none.
    fn whole(&self, window: &Run) -> Option<&str>;
}

/// What a model knows of its errors of measurement. Without it they are independent of the prediction, normal, and correlated over
/// any length.
pub trait ErrorModel: Sync {
    /// The longest correlation that noise may have along a run, in steps between its rows: what is slower is physics. Zero
    /// where noise is white by construction; no limit by default.
    fn longest_correlation(&self) -> f64 {
        f64::INFINITY
    }

    /// How errors accumulate along a run, beside those of each reading: what a unit of each of the random steps adds to the channel's
    /// readings, `[row][step]` (a restitution that scatters from impact to impact moves all later ones). None by default.
    fn accumulated(&self, _run: &Run, _channel: usize) -> Option<Vec<Vec<f64>>> {
        None
    }

    /// What scatters in those steps, in words ("the logarithm of the restitution").
    fn step(&self) -> &str {
        "the step"
    }

    /// The largest standard deviation that such a step may have; what is larger is physics. No limit by default.
    fn largest_step(&self) -> f64 {
        f64::INFINITY
    }

    /// Whether a residual may depend on the prediction itself (the default); false where predictions are made with measured inputs,
    /// and share their noise with the residual.
    fn prediction_is_clean(&self) -> bool {
        true
    }

    /// Errors of a run under the null hypothesis, in sigmas of each channel, `[world][copy][channel][row]`, of a model that knows
    /// them not to be normal: as many worlds for every run, which share what is not known of the noise, and independent copies in
    /// each, of which a recording of one run needs as many as make a thousand with all its worlds. None by default.
    fn null_samples(&self, _run: &Run) -> &[Vec<Vec<Vec<f64>>>] {
        &[]
    }
}

/// A model whose likelihood has several modes, or jumps.
pub trait MultimodalModel: Sync {
    /// Where to begin fitting a mechanism (index into [`Spec::mechanisms`](super::Spec::mechanisms)), judged from what a fit without
    /// it leaves: `residual[run][channel][row]`, measured less predicted, NaN where nothing was measured.
    ///
    /// Each start is a list of shared parameters (index into [`Spec::parameters`](super::Spec::parameters)) with their values; an
    /// index that is no shared parameter's is ignored. No start: a fit begins where the parameters do.
    fn starts(&self, mechanism: usize, runs: &[Run], residual: &[Vec<Vec<f64>>]) -> Vec<Vec<(usize, f64)>>;

    /// Values, rising, at which predictions jump as the shared parameter at a slot grows; between two of them next to nothing depends
    /// on it. None (the default) where predictions are smooth.
    fn jumps(&self, _shared_slot: usize) -> &[f64] {
        &[]
    }
}

/// A model that knows combinations of parameters that make no sense.
pub trait JointLimits: Sync {
    /// Why a mechanism (index into [`Spec::mechanisms`](super::Spec::mechanisms)) is no explanation at these shared parameters, in a
    /// few words; `None` where it makes sense. Bounds say what each parameter may be; this says what they may not be together.
    fn implausible(&self, mechanism: usize, shared: &[f64]) -> Option<String>;
}

/// One unknown more that may act at some rows only: a force on the equations of motion, the restitution of an impact, a stiffness.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalUnknown {
    /// What it is, for a person, with its article (`a force`).
    pub name: String,
    /// Its components, with their unit; one at least, and all are sought together as well.
    pub components: Vec<Quantity>,
    /// Whether it acts at single rows only, each by an amount of its own (an impact that went unheard), and in no interval.
    pub at_single_rows: bool,
    /// The largest size, in units of its components, that an interval may have; infinite where any is plausible.
    pub largest: f64,
}

impl LocalUnknown {
    /// An unknown that may act within an interval.
    pub fn new(name: impl Into<String>, components: Vec<Quantity>) -> Self {
        Self { name: name.into(), components, at_single_rows: false, largest: f64::INFINITY }
    }

    /// The same unknown, which acts at single rows only.
    #[must_use]
    pub fn at_single_rows(self) -> Self {
        Self { at_single_rows: true, ..self }
    }

    /// The same unknown, which is at most so large: beyond, what it does is no longer in proportion to its size, or is no longer it.
    #[must_use]
    pub fn at_most(self, largest: f64) -> Self {
        Self { largest, ..self }
    }
}

/// A model that knows what a cause does to its predictions which acts at some rows only. Without it a cause is sought in the readings: an
/// offset of them.
pub trait LocalCauses: Sync {
    /// The unknowns, in the order of [`LocalCauses::response`].
    fn unknowns(&self) -> Vec<LocalUnknown>;

    /// How the predictions of all runs change (each as [`Model::predict`](super::Model::predict) fills it) by a component of an unknown
    /// that is small and has the size `amounts[run][row]` at each row. Where the unknown acts between rows too (a force), the size is
    /// that of the nearest row.
    ///
    /// # Errors
    /// As [`Model::predict`](super::Model::predict).
    fn response(
        &self,
        of: (usize, usize),
        runs: &[Run],
        shared: &[f64],
        nuisance: &[Vec<f64>],
        amounts: &[Vec<f64>],
    ) -> Result<Vec<Vec<f64>>, PredictError>;

    /// [`LocalCauses::response`] to several choices of amounts, `amounts[choice][run][row]`: for models to which much of the work is the
    /// same whatever the amounts. One after the other by default.
    ///
    /// # Errors
    /// As [`Model::predict`](super::Model::predict).
    fn responses(
        &self,
        of: (usize, usize),
        runs: &[Run],
        shared: &[f64],
        nuisance: &[Vec<f64>],
        amounts: &[Vec<Vec<f64>>],
    ) -> Result<Vec<Vec<Vec<f64>>>, PredictError> {
        amounts.iter().map(|amounts| self.response(of, runs, shared, nuisance, amounts)).collect()
    }

    /// Whether what acts in a run shows in that run alone (the default).
    fn runs_are_alone(&self) -> bool {
        true
    }

    /// With what standard error each of the recording's variables was measured, in their order: a row near the edge of an interval may
    /// truly lie on the other side of it. None (the default), or zero, where a variable is exact.
    fn variable_errors(&self) -> Vec<f64> {
        Vec::new()
    }

    /// What the model follows beside the recording's variables (a height, a speed), along which a cause may act as well; none by default.
    fn states(&self) -> Vec<Quantity> {
        Vec::new()
    }

    /// Those of a run, `[state][row]`.
    ///
    /// A state that is a measured channel (the angle of a joint with an encoder) is given as the channel's readings, unchanged to the last bit:
    /// so it is recognised as one, and sizes go along what the baseline expects there rather than along readings that hold the misfit itself.
    ///
    /// # Errors
    /// As [`Model::predict`](super::Model::predict).
    fn state(&self, _run: &Run, _shared: &[f64], _nuisance: &[f64]) -> Result<Vec<Vec<f64>>, PredictError> {
        Ok(Vec::new())
    }
}

/// A model whose predictions come from a program that may end.
pub trait ExternalProgram: Sync {
    /// Why there will be no prediction any more, whatever is asked (the program has ended): the diagnosis then ends with this error,
    /// even where it could do without the predictions that failed.
    fn fatal_error(&self) -> Option<PredictError>;
}
