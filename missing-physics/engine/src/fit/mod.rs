//! Maximum-likelihood fits: bounded Gauss-Newton with every run's nuisance parameters eliminated run by run.

pub(crate) mod alternate;
pub(crate) mod bordered;
pub(crate) mod chord;
pub(crate) mod columns;
pub(crate) mod gauss_newton;
mod least_squares;
pub(crate) mod optimum;
pub(crate) mod prediction;
pub(crate) mod step;

pub use crate::model::finite_differences;
pub use least_squares::{LeastSquares, least_squares, reweighted_least_squares};
