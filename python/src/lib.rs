//! What the Python package `missing_physics` calls. The package adds names, defaults and what is pleasant; here is what it rests on.

mod answer;
mod array;
mod contact;
mod errors;
mod function;
mod grains;
mod hearing;
mod liquid;
mod posteriors;
mod predict;
mod proof;
mod source;
mod watch;

use pyo3::prelude::*;

/// The module `missing_physics._engine`.
#[pymodule]
mod _engine {
    #[pymodule_export]
    use crate::answer::diagnose;
    #[pymodule_export]
    use crate::contact::fit_contact;
    #[pymodule_export]
    use crate::function::Simulator;
    #[pymodule_export]
    use crate::grains::{grain_series, grain_statistics, infer_grains, pour_grains};
    #[pymodule_export]
    use crate::hearing::hear_impacts;
    #[pymodule_export]
    use crate::liquid::{liquid_pour, liquid_volume, liquid_wrench};
    #[pymodule_export]
    use crate::posteriors::{Density, Prior};
    #[pymodule_export]
    use crate::predict::{domains, predict, unit_of, version};
    #[pymodule_export]
    use crate::proof::Proof;
    #[pymodule_export]
    use crate::source::Source;
}
