//! Where the baseline misses the data.

pub(crate) mod departure;
pub(crate) mod scan;
