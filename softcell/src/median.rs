//! The median.

use std::cmp::Ordering;

/// The upper median of values, which are put in another order; none of nothing.
pub(crate) fn median<T: Copy>(values: &mut [T], order: impl FnMut(&T, &T) -> Ordering) -> Option<T> {
    let middle = values.len() / 2;
    if values.is_empty() { None } else { Some(*values.select_nth_unstable_by(middle, order).1) }
}
