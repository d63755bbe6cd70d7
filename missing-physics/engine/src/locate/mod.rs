//! Where the cause of a misfit acts.

mod bins;
mod cause;
mod intervals;
mod least_squares;
pub(crate) mod locations;
mod membership;
pub(crate) mod projection;
mod responses;
mod scan;
mod single;
mod unknowns;
