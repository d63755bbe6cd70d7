//! Which mechanisms have to be on: sets of mechanisms fitted, weighed, and judged on data that their fit has not seen.

pub(crate) mod candidate;
pub(crate) mod confusion;
pub(crate) mod evidence;
pub(crate) mod held_out;
pub(crate) mod main_cause;
mod nuisance_prior;
mod parts;
mod prior;
pub(crate) mod ranking;
pub(crate) mod screening;
pub(crate) mod search;
pub(crate) mod several_places;
pub(crate) mod share;
