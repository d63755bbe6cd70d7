//! An empirical law without its coefficients, as it is kept.

use serde::{Deserialize, Serialize};

use crate::model::{Spec, Term};

/// An empirical law that is added to what a simulation predicts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub enum AddedLaw {
    /// Candidate terms of the model.
    Terms {
        /// Names of their coefficients among the model's parameters.
        coefficients: Vec<String>,
    },
    /// Another power of a variable: the channel times (variable / largest)^exponent.
    Power {
        /// Name of the channel.
        channel: String,
        /// Name of the variable.
        variable: String,
        /// The variable's largest value where the law was found.
        largest: f64,
    },
    /// A curved scale: a polynomial c1 x + c2 x^2 + c3 x^3 added to a channel, x = (its simulated value) / largest.
    Reading {
        /// Name of the channel.
        channel: String,
        /// The simulated value's largest size where the law was found.
        largest: f64,
    },
    /// A polynomial c1 x + c2 x^2 + ... added to a channel, x = (variable - centre) / half_width.
    Smooth {
        /// Name of the channel.
        channel: String,
        /// Name of the variable.
        variable: String,
        /// The middle of the variable's range where the law was found.
        centre: f64,
        /// Half the width of that range.
        half_width: f64,
    },
    /// An oscillation of one frequency on every channel, its amplitudes and phases of each run.
    Periodic,
}

impl AddedLaw {
    pub(crate) fn of_terms(spec: &Spec, terms: &[&Term]) -> Self {
        Self::Terms {
            coefficients: terms.iter().map(|t| spec.parameters[t.parameter].name.clone()).collect(),
        }
    }
}
