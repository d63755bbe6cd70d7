//! What the engine asks of a simulation: its parameters, its mechanisms and its prediction of a run.

use crate::data::Run;

/// A named number with a unit: a measured channel or a known input.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Quantity {
    /// Name with its unit as a suffix, as in the recording (`z_m`).
    pub name: String,
    /// The unit alone (`m`); empty for a pure number.
    pub unit: String,
}

impl Quantity {
    /// A quantity of the given name and unit.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into() }
    }
}

/// Whether a parameter has one value for the whole recording or one for each run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// One value over all runs.
    Shared,
    /// One value for each run (a nuisance such as the state at the start).
    PerRun,
}

/// One parameter of the full model.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name with its unit as a suffix (`k_per_m`), unique in its mechanism.
    pub name: String,
    /// The unit alone (`1/m`).
    pub unit: String,
    /// Shared by all runs, or one for each run.
    pub scope: Scope,
    /// The value from which a fit starts; for a mechanism's parameter the value at which it is off.
    pub start: f64,
    /// Smallest value allowed (may be `-inf`).
    pub lower: f64,
    /// Largest value allowed (may be `inf`).
    pub upper: f64,
    /// A typical size of its departures from `start`; finite and above zero.
    pub scale: f64,
}

/// A function of the shared parameters.
pub type OfParameters = std::sync::Arc<dyn Fn(&[f64]) -> f64 + Send + Sync>;

/// A quantity that is computed from a mechanism's parameters and reported beside them, or in place of the parameter of its name where it
/// has another value.
#[derive(Clone)]
pub struct Derived {
    /// Name with its unit as a suffix.
    pub name: String,
    /// The unit alone.
    pub unit: String,
    /// The value from the shared parameters, in the order of [`Spec::parameters`] restricted to [`Scope::Shared`].
    pub value: OfParameters,
}

impl std::fmt::Debug for Derived {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Derived").field("name", &self.name).finish_non_exhaustive()
    }
}

/// A function of the shared parameters and of one run's nuisance parameters.
pub type OfRun = std::sync::Arc<dyn Fn(&[f64], &[f64]) -> f64 + Send + Sync>;

/// What is reported of a quantity that each run has of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Over {
    /// The mean over the runs.
    #[default]
    Mean,
    /// The value of the run in which its modulus is largest.
    Largest,
}

/// A quantity that is computed run by run.
#[derive(Clone)]
pub struct DerivedPerRun {
    /// Name with its unit as a suffix.
    pub name: String,
    /// The unit alone.
    pub unit: String,
    /// What is reported of it.
    pub over: Over,
    /// The value from the shared parameters and the run's nuisance ones, each in the order of [`Spec::parameters`].
    pub value: OfRun,
}

impl std::fmt::Debug for DerivedPerRun {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("DerivedPerRun").field("name", &self.name).finish_non_exhaustive()
    }
}

/// A named group of the full model's parameters; off where each has its `start` value.
#[derive(Debug, Clone, Default)]
pub struct Mechanism {
    /// Identifier in lower case with hyphens (`quadratic-drag`).
    pub id: String,
    /// Name for a person (`air drag, quadratic`).
    pub name: String,
    /// One sentence: what it is.
    pub explanation: String,
    /// Its equation, in plain text.
    pub equation: String,
    /// Where the equation is from (author, year, DOI).
    pub reference: String,
    /// Identifiers that it is easily confused with, for the reader; the engine measures confusion itself.
    pub confused_with: Vec<String>,
    /// Indices into [`Spec::parameters`] of the parameters that it frees.
    pub parameters: Vec<usize>,
    /// Those of [`Self::parameters`] that say what the effect looks like and not how strong it is (the frequency of an
    /// oscillation whose amplitude is free): at the off value of the others they make no difference. Their `start` is a
    /// typical value, and all values within their bounds are thought equally likely (on a log scale where both bounds are
    /// above zero).
    pub shape_parameters: Vec<usize>,
    /// Those of [`Self::parameters`] that are whole numbers (the row at which something jumps): no fit moves them,
    /// [`Model::starts`] proposes their values, and all whole values within their bounds are thought equally likely.
    pub integer_parameters: Vec<usize>,
    /// Parameters freed with it because it acts only through them (wind acts through drag), not reported as its own.
    pub companions: Vec<usize>,
    /// Identifiers of mechanisms that make the companions unnecessary.
    pub companions_unless: Vec<String>,
    /// Quantities computed from its parameters, reported beside them.
    pub derived: Vec<Derived>,
    /// Quantities computed from each run's nuisance parameters, reported as they say ([`Over`]).
    pub derived_per_run: Vec<DerivedPerRun>,
}

/// A candidate term of an unknown law: a parameter of the model that no mechanism frees.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Term {
    /// Index into [`Spec::parameters`] of its coefficient.
    pub parameter: usize,
    /// The term as it stands in the equation, without the coefficient (`|v|^2 v`).
    pub formula: String,
    /// The quantity that it adds to (`acceleration`), with its unit.
    pub adds_to: Quantity,
    /// The names of the variables in it.
    pub variables: Vec<String>,
}

/// Everything that the engine knows of a model before it is run.
#[derive(Debug, Clone, Default)]
pub struct Spec {
    /// What the baseline is, in one sentence.
    pub baseline: String,
    /// All parameters of the full model.
    pub parameters: Vec<Parameter>,
    /// The groups of parameters that may have to be on.
    pub mechanisms: Vec<Mechanism>,
    /// Candidate terms of an unknown law.
    pub terms: Vec<Term>,
}

impl Spec {
    /// Number of parameters with the given scope.
    pub fn count(&self, scope: Scope) -> usize {
        self.parameters.iter().filter(|p| p.scope == scope).count()
    }

    /// Position of each parameter among those of its scope.
    pub fn slots(&self) -> Vec<usize> {
        let (mut shared, mut nuisance) = (0, 0);
        self.parameters
            .iter()
            .map(|p| {
                let counter = if p.scope == Scope::Shared { &mut shared } else { &mut nuisance };
                *counter += 1;
                *counter - 1
            })
            .collect()
    }
}

/// A prediction that could not be made at the given parameters.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("no prediction for run {run}: {reason}")]
pub struct PredictError {
    /// Label of the run.
    pub run: String,
    /// What went wrong, with the values involved.
    pub reason: String,
}

/// A full model: a simulation with every effect in it.
///
/// Parameters come in two slices: `shared` (those with [`Scope::Shared`], in the order of [`Spec::parameters`]) and
/// `nuisance` (those with [`Scope::PerRun`], likewise). A prediction fills `out` channel by channel:
/// `out[c * run.len() + i]` is channel `c` at row `i`.
pub trait Model: Sync {
    /// Parameters, mechanisms and candidate terms.
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

    /// The longest correlation that noise may have along a run, in steps between its rows: what is slower is physics. Zero
    /// where noise is white by construction; no limit by default.
    fn longest_noise(&self) -> f64 {
        f64::INFINITY
    }

    /// What chance alone may do to a run, in sigmas of each channel, `[world][copy][channel][row]`, of a model that knows its errors
    /// not to be normal: as many worlds for every run, which share what is not known of the noise, and independent copies in
    /// each. None by default.
    fn null_samples(&self, _run: &Run) -> &[Vec<Vec<Vec<f64>>>] {
        &[]
    }

    /// Whether a residual may depend on the prediction itself; false where predictions are made with measured inputs, and share
    /// their noise with the residual.
    fn prediction_is_clean(&self) -> bool {
        true
    }

    /// Fills in good starting values of the run's nuisance parameters; `nuisance` holds each parameter's `start`.
    fn start(&self, _run: &Run, _nuisance: &mut [f64]) {}

    /// Where to begin fitting a mechanism (index into [`Spec::mechanisms`]) whose surface has many hills, judged from what a
    /// fit without it leaves: `residual[run][channel][row]`, measured less predicted, NaN where nothing was measured.
    ///
    /// Each start is a list of shared parameters (index into [`Spec::parameters`]) with their values; none by default.
    fn starts(
        &self,
        _mechanism: usize,
        _runs: &[Run],
        _residual: &[Vec<Vec<f64>>],
    ) -> Vec<Vec<(usize, f64)>> {
        Vec::new()
    }

    /// Values, rising, at which predictions jump as the shared parameter at a slot grows; between two of them next to nothing depends
    /// on it. None (the default) where predictions are smooth.
    fn jumps(&self, _shared_slot: usize) -> &[f64] {
        &[]
    }

    /// How the predictions of all runs change (each as [`Model::predict`] fills it) by a unit of a departure that is small and has the
    /// size `amounts[run][row]` in the law of each row: where rows are not alone, an effect in one shows in others. `None` (the
    /// default) where a row that departs is off by itself.
    ///
    /// # Errors
    /// As [`Model::predict`].
    fn perturbation_response(
        &self,
        _runs: &[Run],
        _shared: &[f64],
        _amounts: &[Vec<f64>],
    ) -> Result<Option<Vec<Vec<f64>>>, PredictError> {
        Ok(None)
    }

    /// Why a mechanism (index into [`Spec::mechanisms`]) is no explanation at these shared parameters, in a few words; `None`
    /// where it makes sense. Bounds say what each parameter may be; this says what they may not be together.
    fn implausible(&self, _mechanism: usize, _shared: &[f64]) -> Option<String> {
        None
    }

    /// Why the simulation will give no prediction any more, whatever is asked of it (the program behind it has ended): the
    /// diagnosis then ends with this error, even where it could do without the predictions that failed.
    fn fatal_error(&self) -> Option<PredictError> {
        None
    }

    /// Step of the differences that stand for derivatives, in scales of a parameter: well above the simulation's own rounding.
    fn relative_step(&self) -> f64 {
        1e-5
    }

    /// Whether the shared parameter at a slot can change this run at all; where it cannot, its derivative is zero without a prediction.
    fn acts_on(&self, _run: &Run, _shared_slot: usize) -> bool {
        true
    }

    /// The derivatives of [`Model::predict`] with respect to the shared parameters at the slots `shared_free` and
    /// the nuisance parameters at the slots `nuisance_free`, one column after the other, each as long as `out`.
    ///
    /// The default takes central differences at steps of [`Model::relative_step`], one-sided at a bound.
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
        crate::fit::gauss_newton::finite_differences(
            self,
            run,
            shared,
            nuisance,
            shared_free,
            nuisance_free,
            out,
            jacobian,
        )
    }
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
