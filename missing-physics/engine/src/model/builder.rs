//! Builds up a specification: parameters are named by what the builder returns for them, not by counted indices.

use crate::model::check::SpecError;
use crate::model::spec::{Mechanism, Parameter, Scope, Spec, Term};
use crate::quantity::Quantity;

/// A parameter of a specification in the making.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ParameterRef {
    /// Index into [`Spec::parameters`].
    pub index: usize,
    /// Position among the parameters of its scope: where a prediction finds its value.
    pub slot: usize,
}

/// Bounds of a parameter that has none.
pub const UNBOUNDED: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// A specification in the making.
///
/// ```
/// use missing_physics::model::{SpecBuilder, SpecError, UNBOUNDED};
///
/// let mut b = SpecBuilder::new("free fall");
/// let k = b.shared("k_per_m", "1/m", 0.0, [0.0, f64::INFINITY], 0.02);
/// b.nuisance("z0_m", "m", UNBOUNDED, 1.0);
/// b.mechanism("quadratic-drag", &[k], ["air drag, quadratic", "The air slows the ball.", "a = -k |v| v", ""], &[]);
/// let spec = b.build()?;
/// assert_eq!(spec.mechanisms[0].parameters, [k.index]);
/// # Ok::<(), SpecError>(())
/// ```
#[derive(Debug, Default)]
pub struct SpecBuilder {
    spec: Spec,
}

impl SpecBuilder {
    /// A specification without parameters; `baseline` says in one sentence what the baseline is.
    pub fn new(baseline: impl Into<String>) -> Self {
        Self { spec: Spec { baseline: baseline.into(), ..Spec::default() } }
    }

    /// Says in one sentence what the baseline is.
    pub fn baseline(&mut self, baseline: impl Into<String>) {
        self.spec.baseline = baseline.into();
    }

    /// A parameter of all runs, off (or starting) at `start`, within bounds (lower, upper).
    pub fn shared(
        &mut self,
        name: &str,
        unit: &str,
        start: f64,
        bounds: [f64; 2],
        scale: f64,
    ) -> ParameterRef {
        self.parameter(name, unit, Scope::Shared, start, bounds, scale)
    }

    /// A parameter with a value for each run, starting at zero.
    pub fn nuisance(&mut self, name: &str, unit: &str, bounds: [f64; 2], scale: f64) -> ParameterRef {
        self.nuisance_from(name, unit, 0.0, bounds, scale)
    }

    /// A parameter with a value for each run, off (or starting) at `start`.
    pub fn nuisance_from(
        &mut self,
        name: &str,
        unit: &str,
        start: f64,
        bounds: [f64; 2],
        scale: f64,
    ) -> ParameterRef {
        self.parameter(name, unit, Scope::PerRun, start, bounds, scale)
    }

    fn parameter(
        &mut self,
        name: &str,
        unit: &str,
        scope: Scope,
        start: f64,
        [lower, upper]: [f64; 2],
        scale: f64,
    ) -> ParameterRef {
        let at = ParameterRef { index: self.spec.parameters.len(), slot: self.spec.count(scope) };
        let (name, unit) = (name.into(), unit.into());
        self.spec.parameters.push(Parameter { name, unit, scope, start, lower, upper, scale });
        at
    }

    /// A mechanism that frees `parameters`; `text` is its name, one sentence, its equation and its source.
    pub fn mechanism(
        &mut self,
        id: &str,
        parameters: &[ParameterRef],
        text: [&str; 4],
        confused_with: &[&str],
    ) -> &mut Mechanism {
        let at = self.spec.mechanisms.len();
        self.spec.mechanisms.push(Mechanism {
            id: id.into(),
            name: text[0].into(),
            explanation: text[1].into(),
            equation: text[2].into(),
            reference: text[3].into(),
            confused_with: confused_with.iter().map(|s| (*s).to_owned()).collect(),
            parameters: parameters.iter().map(|p| p.index).collect(),
            ..Mechanism::default()
        });
        &mut self.spec.mechanisms[at]
    }

    /// What may differ from run to run ([`Mechanism::between_runs`]) by parameters of each run, with the texts of [`Self::mechanism`].
    pub fn between_runs(
        &mut self,
        id: &str,
        parameters: &[ParameterRef],
        text: [&str; 4],
        confused_with: &[&str],
    ) {
        self.mechanism(id, parameters, text, confused_with).between_runs = true;
    }

    /// The mechanism of an identifier, to be added to.
    pub fn mechanism_mut(&mut self, id: &str) -> Option<&mut Mechanism> {
        self.spec.mechanisms.iter_mut().find(|m| m.id == id)
    }

    /// A candidate term of an unknown law, with `coefficient`.
    pub fn term(
        &mut self,
        coefficient: ParameterRef,
        formula: impl Into<String>,
        adds_to: Quantity,
        variables: Vec<String>,
    ) {
        let formula = formula.into();
        self.spec.terms.push(Term { parameter: coefficient.index, formula, adds_to, variables });
    }

    /// What has been built so far, unchecked.
    pub fn so_far(&self) -> &Spec {
        &self.spec
    }

    /// The specification, checked.
    ///
    /// # Errors
    /// The first [`SpecError`] found.
    pub fn build(self) -> Result<Spec, SpecError> {
        self.spec.check()?;
        Ok(self.spec)
    }

    /// The specification unchecked, for a model that cannot fail when it is made: a diagnosis checks every specification first.
    pub fn build_unchecked(self) -> Spec {
        self.spec
    }
}
