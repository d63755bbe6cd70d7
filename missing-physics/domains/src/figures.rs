//! What the pictures of domains have in common.

use missing_physics::diagnosis::{Curves, Diagnosis, Verdict};
use missing_physics::model::{Scope, Spec};
use missing_physics_report::Colour;

/// A fit that is drawn: the baseline's or, where something was found, the final model's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fit {
    Before,
    After,
}

impl Fit {
    /// The fits that a diagnosis has to draw.
    pub(crate) fn of(d: &Diagnosis) -> &'static [Self] {
        if is_changed(d) { &[Self::Before, Self::After] } else { &[Self::Before] }
    }

    /// The last of them.
    pub(crate) fn last(d: &Diagnosis) -> Self {
        if is_changed(d) { Self::After } else { Self::Before }
    }

    pub(crate) fn colour(self) -> Colour {
        match self {
            Self::Before => Colour::Before,
            Self::After => Colour::After,
        }
    }

    /// What it is, in a report's words.
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Before => "simulated",
            Self::After => "with what was found",
        }
    }

    /// Its channels in a run.
    pub(crate) fn channels(self, curves: &Curves) -> &[Vec<f64>] {
        match self {
            Self::Before => &curves.before,
            Self::After => &curves.after,
        }
    }

    /// Values of a model's shared parameters, in its order.
    pub(crate) fn shared(self, spec: &Spec, d: &Diagnosis) -> Vec<f64> {
        let shared = || spec.parameters.iter().filter(|p| p.scope == Scope::Shared);
        match self {
            Self::Before => shared()
                .map(|p| {
                    let found = d.baseline_parameters.iter().find(|e| e.name == p.name);
                    found.map_or(p.start, |e| e.value)
                })
                .collect(),
            Self::After => d.repaired.parameters.iter().take(shared().count()).map(|p| p.value).collect(),
        }
    }
}

fn is_changed(d: &Diagnosis) -> bool {
    d.law.is_some() || matches!(d.verdict, Verdict::Explained | Verdict::Partly | Verdict::Ambiguous)
}
