//! Where the baseline misses the data.

mod bins;
mod departure;
mod least_squares;
pub(crate) mod locations;
mod scan;
