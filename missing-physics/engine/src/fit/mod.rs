//! Maximum-likelihood fits: bounded Gauss-Newton with every run's nuisance parameters eliminated run by run.

pub(crate) mod gauss_newton;
pub(crate) mod step;

pub use crate::model::finite_differences;
