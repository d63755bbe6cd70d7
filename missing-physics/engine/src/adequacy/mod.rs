//! Whether a model is adequate, and which rows no model would explain.

pub(crate) mod linearised;
pub(crate) mod null;
mod omnibus;
pub(crate) mod outliers;
mod spectrum;
mod tail;
pub(crate) mod test;
