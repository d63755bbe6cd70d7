//! Builds up the specification of a domain's model.

use missing_physics::model::{Mechanism, Parameter, Scope, Spec};

/// A parameter of a specification: where it stands among all, and among those of its scope.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct At {
    pub(super) index: usize,
    pub(super) slot: usize,
}

/// Bounds of a parameter that has none.
pub(super) const ANY: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// A specification in the making.
#[derive(Debug, Default)]
pub(super) struct Builder {
    pub(super) spec: Spec,
}

impl Builder {
    /// A parameter of all runs, off (or starting) at `start`.
    pub(super) fn shared(&mut self, name: &str, unit: &str, start: f64, bounds: [f64; 2], scale: f64) -> At {
        self.parameter(name, unit, Scope::Shared, start, bounds, scale)
    }

    /// A parameter that each run has for itself.
    pub(super) fn nuisance(&mut self, name: &str, unit: &str, bounds: [f64; 2], scale: f64) -> At {
        self.nuisance_from(name, unit, 0.0, bounds, scale)
    }

    /// A parameter that each run has for itself, off (or starting) at `start`.
    pub(super) fn nuisance_from(
        &mut self,
        name: &str,
        unit: &str,
        start: f64,
        bounds: [f64; 2],
        scale: f64,
    ) -> At {
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
    ) -> At {
        let at = At { index: self.spec.parameters.len(), slot: self.spec.count(scope) };
        let (name, unit) = (name.into(), unit.into());
        self.spec.parameters.push(Parameter { name, unit, scope, start, lower, upper, scale });
        at
    }

    /// A mechanism that frees `parameters`; `text` is its name, one sentence, its equation and its source.
    pub(super) fn mechanism(
        &mut self,
        id: &str,
        parameters: &[At],
        text: [&str; 4],
        confused: &[&str],
    ) -> &mut Mechanism {
        let at = self.spec.mechanisms.len();
        self.spec.mechanisms.push(Mechanism {
            id: id.into(),
            name: text[0].into(),
            explanation: text[1].into(),
            equation: text[2].into(),
            reference: text[3].into(),
            confused_with: confused.iter().map(|s| (*s).to_owned()).collect(),
            parameters: parameters.iter().map(|p| p.index).collect(),
            ..Mechanism::default()
        });
        &mut self.spec.mechanisms[at]
    }
}
