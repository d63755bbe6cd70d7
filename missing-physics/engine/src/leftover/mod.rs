//! A leftover: a smooth discrepancy between model and data that no mechanism describes, as a part of the model.
//!
//! Each channel may miss the data by a smooth function of one variable that all runs share (Kennedy and O'Hagan 2001,
//! doi:10.1111/1467-9868.00294), a polynomial whose coefficients have a normal prior, beside noise that may be correlated along each run.
//! Sets of mechanisms compete, and parameters have intervals, with that there.

pub(crate) mod fit;
pub(crate) mod process;
