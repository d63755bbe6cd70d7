//! What the engine knows of a model before it is run: parameters, mechanisms, candidate terms.

use crate::quantity::Quantity;

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
    /// Which summary of the runs' values is reported.
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
    /// [`MultimodalModel::starts`](crate::model::MultimodalModel::starts) proposes their values, and all whole values within their bounds are thought equally likely.
    pub integer_parameters: Vec<usize>,
    /// Those of [`Self::parameters`] that may have no effect while others of them have (either bound of a saturation).
    pub may_be_open: Vec<usize>,
    /// Parameters freed with it because it acts only through them (wind acts through drag), not reported as its own.
    pub companions: Vec<usize>,
    /// Identifiers of mechanisms that make the companions unnecessary.
    pub companions_unless: Vec<String>,
    /// Quantities computed from its parameters, reported beside them.
    pub derived: Vec<Derived>,
    /// Quantities computed from each run's nuisance parameters, reported as they say ([`Over`]).
    pub derived_per_run: Vec<DerivedPerRun>,
    /// Whether nobody has asked for it, since it may act in any rig (a sensor's gain): it is tried only where nothing else explains the
    /// data, and named only where the data are clear enough to tell it from causes of which nobody has thought.
    pub unasked: bool,
    /// Whether it is no physics that the baseline lacks, but what may differ from run to run without anyone wanting it (how much liquid is
    /// left in a container): it has parameters of [`Scope::PerRun`] alone, whose values scatter around their start. It competes with the
    /// mechanisms that have names; where it is needed, the answer says that runs differ, as what is left over.
    pub between_runs: bool,
}

impl Mechanism {
    /// What it is, wherever it acts: its identifier without the place (`coulomb-friction` of `coulomb-friction@hinge`).
    pub(crate) fn kind(&self) -> &str {
        self.id.split_once('@').map_or(&self.id, |(kind, _)| kind)
    }
}

/// Runs from which on what differs between them ([`Mechanism::between_runs`]) is looked for: fewer say nothing of it.
pub const FEWEST_RUNS_THAT_DIFFER: usize = 3;

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
    /// The mechanisms that somebody has asked for, by their indices.
    pub(crate) fn asked(&self) -> Vec<usize> {
        self.named().into_iter().filter(|&m| !self.mechanisms[m].unasked).collect()
    }

    /// The mechanisms that an answer may name, by their indices.
    pub(crate) fn named(&self) -> Vec<usize> {
        (0..self.mechanisms.len()).filter(|&m| !self.mechanisms[m].between_runs).collect()
    }

    /// What may differ from run to run, by its index.
    pub(crate) fn between_runs(&self) -> Vec<usize> {
        (0..self.mechanisms.len()).filter(|&m| self.mechanisms[m].between_runs).collect()
    }
}

impl Spec {
    /// Number of parameters with the given scope.
    pub fn count(&self, scope: Scope) -> usize {
        self.parameters.iter().filter(|p| p.scope == scope).count()
    }

    /// Where each parameter with the given scope starts, in order.
    pub fn starts(&self, scope: Scope) -> Vec<f64> {
        self.parameters.iter().filter(|p| p.scope == scope).map(|p| p.start).collect()
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
