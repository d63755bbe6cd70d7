//! Order statistics.

use statrs::statistics::{Data, OrderStatistics as _};

/// The median; `None` of nothing. The values are put in another order.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
    (!values.is_empty()).then(|| Data::new(values).median())
}
