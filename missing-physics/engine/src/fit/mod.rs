//! Maximum-likelihood fits: bounded Gauss-Newton with every run's nuisance parameters eliminated run by run.

pub(crate) mod alternate;
pub(crate) mod bordered;
pub(crate) mod columns;
pub(crate) mod gauss_newton;
pub(crate) mod optimum;
pub(crate) mod prediction;
mod step;

pub use crate::model::finite_differences;
