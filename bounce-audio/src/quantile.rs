//! Quantiles, `None` of nothing.

use statrs::statistics::{Data, OrderStatistics as _};

/// The quantile of a share in [0, 1] of some values, which are put in another order; nothing is allocated.
pub(crate) fn quantile(values: &mut [f64], share: f64) -> Option<f64> {
    (!values.is_empty()).then(|| Data::new(values).quantile(share))
}
