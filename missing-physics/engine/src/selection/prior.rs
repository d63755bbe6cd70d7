//! What mechanisms and their strengths are thought of before any data.

/// Log prior odds of each further mechanism.
pub(crate) const LOG_PRIOR_ODDS: f64 = -1.5;
/// Further log prior odds of what differs from run to run: whoever recorded the runs took them for alike.
pub(crate) const LOG_PRIOR_BETWEEN: f64 = -3.0;
/// A mechanism's strength is thought equally likely on a log scale over this many e-folds.
pub(crate) const LOG_RANGE: f64 = 9.21;
