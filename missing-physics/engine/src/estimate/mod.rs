//! Values and intervals of parameters.

pub(crate) mod estimates;
