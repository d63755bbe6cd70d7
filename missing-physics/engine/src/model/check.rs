//! Whether a specification makes sense.

use crate::model::spec::{Mechanism, Parameter, Scope, Spec};

/// What is wrong with a [`Spec`].
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SpecError {
    /// A mechanism or term names a parameter that the model has not.
    #[error("{place} names parameter {index}, the model has {parameters}")]
    Index {
        /// The mechanism or term that names it.
        place: String,
        /// The index.
        index: usize,
        /// Number of parameters.
        parameters: usize,
    },
    /// Bounds that are crossed, or no numbers.
    #[error(
        "parameter {parameter} has the bounds {lower} and {upper}, expected a lower one that is not above the upper one"
    )]
    Bounds {
        /// Name of the parameter.
        parameter: String,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
    },
    /// A start that is not finite, or outside the bounds.
    #[error("parameter {parameter} starts at {start}, expected a finite number from {lower} to {upper}")]
    Start {
        /// Name of the parameter.
        parameter: String,
        /// Its start.
        start: f64,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
    },
    /// A scale that is not finite, or not above zero.
    #[error("parameter {parameter} has the scale {scale}, expected a finite number above zero")]
    Scale {
        /// Name of the parameter.
        parameter: String,
        /// Its scale.
        scale: f64,
    },
    /// Two mechanisms of one identifier.
    #[error("two mechanisms have the identifier {id}")]
    DuplicateMechanism {
        /// The identifier.
        id: String,
    },
    /// Two parameters of one name in one mechanism.
    #[error("mechanism {mechanism} has two parameters named {parameter}")]
    DuplicateParameter {
        /// Identifier of the mechanism.
        mechanism: String,
        /// The name.
        parameter: String,
    },
    /// The coefficient of a candidate term is freed by a mechanism.
    #[error("the term {formula} has the coefficient {parameter}, which mechanism {mechanism} frees")]
    FreedTerm {
        /// The term.
        formula: String,
        /// Name of its coefficient.
        parameter: String,
        /// Identifier of the mechanism.
        mechanism: String,
    },
    /// A shape or integer parameter that is none of its mechanism's parameters.
    #[error("mechanism {mechanism} does not free parameter {parameter}, which it lists as {role}")]
    NotFreed {
        /// Identifier of the mechanism.
        mechanism: String,
        /// Name of the parameter.
        parameter: String,
        /// `shape` or `integer`.
        role: &'static str,
    },
    /// A parameter of what differs from run to run that all runs share.
    #[error("mechanism {mechanism} differs from run to run, but all runs share its parameter {parameter}")]
    SharedBetweenRuns {
        /// Identifier of the mechanism.
        mechanism: String,
        /// Name of the parameter.
        parameter: String,
    },
    /// A shape or integer parameter whose values cannot all be equally likely.
    #[error(
        "mechanism {mechanism} lists parameter {parameter} as {role}, expected a shared one with finite bounds"
    )]
    Unbounded {
        /// Identifier of the mechanism.
        mechanism: String,
        /// Name of the parameter.
        parameter: String,
        /// `shape` or `integer`.
        role: &'static str,
    },
}

impl Spec {
    /// Checks that indices, numbers and names make sense.
    ///
    /// # Errors
    /// The first [`SpecError`] found.
    pub fn check(&self) -> Result<(), SpecError> {
        self.parameters.iter().try_for_each(Parameter::check)?;
        self.check_indices()?;
        for (at, mechanism) in self.mechanisms.iter().enumerate() {
            if self.mechanisms[..at].iter().any(|other| other.id == mechanism.id) {
                return Err(SpecError::DuplicateMechanism { id: mechanism.id.clone() });
            }
            self.check_names(mechanism)?;
            self.check_between_runs(mechanism)?;
            self.check_role(mechanism, &mechanism.shape_parameters, "shape")?;
            self.check_role(mechanism, &mechanism.integer_parameters, "integer")?;
        }
        self.check_terms()
    }

    /// Every index is one of a parameter.
    fn check_indices(&self) -> Result<(), SpecError> {
        let parameters = self.parameters.len();
        let known = |indices: &[usize], place: &dyn Fn() -> String| {
            let outside = indices.iter().copied().find(|&index| index >= parameters);
            outside.map_or(Ok(()), |index| Err(SpecError::Index { place: place(), index, parameters }))
        };
        for m in &self.mechanisms {
            for list in [&m.parameters, &m.companions, &m.shape_parameters, &m.integer_parameters] {
                known(list, &|| format!("mechanism {}", m.id))?;
            }
        }
        self.terms.iter().try_for_each(|t| known(&[t.parameter], &|| format!("the term {}", t.formula)))
    }

    /// No two parameters of a mechanism have one name, nor is one listed twice.
    fn check_names(&self, mechanism: &Mechanism) -> Result<(), SpecError> {
        let name = |&p: &usize| self.parameters[p].name.as_str();
        let names: Vec<&str> = mechanism.parameters.iter().map(name).collect();
        match (1..names.len()).find(|&at| names[..at].contains(&names[at])) {
            Some(at) => Err(SpecError::DuplicateParameter {
                mechanism: mechanism.id.clone(),
                parameter: names[at].to_owned(),
            }),
            None => Ok(()),
        }
    }

    /// What differs from run to run has parameters of each run alone.
    fn check_between_runs(&self, mechanism: &Mechanism) -> Result<(), SpecError> {
        let shared = |p: &&usize| self.parameters[**p].scope == Scope::Shared;
        let mut parameters = mechanism.parameters.iter().chain(&mechanism.companions);
        match parameters.find(shared).filter(|_| mechanism.between_runs) {
            Some(&p) => Err(SpecError::SharedBetweenRuns {
                mechanism: mechanism.id.clone(),
                parameter: self.parameters[p].name.clone(),
            }),
            None => Ok(()),
        }
    }

    /// Shape and integer parameters are the mechanism's, shared, and bounded.
    fn check_role(
        &self,
        mechanism: &Mechanism,
        listed: &[usize],
        role: &'static str,
    ) -> Result<(), SpecError> {
        for &p in listed {
            let info = &self.parameters[p];
            let (mechanism_id, parameter) = (mechanism.id.clone(), info.name.clone());
            if !mechanism.parameters.contains(&p) {
                return Err(SpecError::NotFreed { mechanism: mechanism_id, parameter, role });
            }
            if info.scope != Scope::Shared || !(info.upper - info.lower).is_finite() {
                return Err(SpecError::Unbounded { mechanism: mechanism_id, parameter, role });
            }
        }
        Ok(())
    }

    /// No mechanism frees the coefficient of a term.
    fn check_terms(&self) -> Result<(), SpecError> {
        for term in &self.terms {
            let frees =
                |m: &&Mechanism| m.parameters.iter().chain(&m.companions).any(|&p| p == term.parameter);
            if let Some(mechanism) = self.mechanisms.iter().find(frees) {
                return Err(SpecError::FreedTerm {
                    formula: term.formula.clone(),
                    parameter: self.parameters[term.parameter].name.clone(),
                    mechanism: mechanism.id.clone(),
                });
            }
        }
        Ok(())
    }
}

impl Parameter {
    /// Bounds that are not crossed, a start between them, a scale above zero.
    fn check(&self) -> Result<(), SpecError> {
        let Self { start, lower, upper, scale, .. } = *self;
        let parameter = || self.name.clone();
        if !(lower <= upper && lower < f64::INFINITY && upper > f64::NEG_INFINITY) {
            return Err(SpecError::Bounds { parameter: parameter(), lower, upper });
        }
        if !(start.is_finite() && (lower..=upper).contains(&start)) {
            return Err(SpecError::Start { parameter: parameter(), start, lower, upper });
        }
        if !(scale.is_finite() && scale > 0.0) {
            return Err(SpecError::Scale { parameter: parameter(), scale });
        }
        Ok(())
    }
}
