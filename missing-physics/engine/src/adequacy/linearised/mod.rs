//! The linearised model around a fit: everything that an adequacy test needs of the data, as sums over rows.
//!
//! Around the fitted parameters the prediction is a plane. For each run, channel and noise shape the whitened columns of
//! that plane, and of the directions in which it might be wrong, leave a small Gram matrix; a data vector leaves its
//! products with them. A refit of the model, of any alternative and of the noise is then algebra on a few small matrices,
//! which is what makes a bootstrap of the *whole* fit affordable.

mod block;
mod build;
pub(crate) mod curves;
mod gram;
mod outliers;
mod plane;
mod pooled;
mod read;
mod shapes;
mod solve;

pub(crate) use curves::DEGREE;
pub(crate) use outliers::{JUMP, longest_lapse};
pub(crate) use plane::{Linearised, Reading, ScoredNoise};
