//! Whether a model is adequate, and which rows no model would explain.

pub(crate) mod linearised;
pub(crate) mod outliers;
pub(crate) mod test;
