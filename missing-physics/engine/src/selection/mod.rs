//! Which mechanisms have to be on: sets of mechanisms fitted, weighed, and judged on data that their fit has not seen.

pub(crate) mod compare;
pub(crate) mod nuisance_prior;
pub(crate) mod ranking;
