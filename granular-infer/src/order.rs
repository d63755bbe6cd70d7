//! Order statistics.

/// The quantile of a share `q` in [0, 1], interpolated linearly between the values about rank `q (n - 1)` (numpy's default); NaN of
/// nothing. The values are put in another order.
pub(crate) fn quantile(values: &mut [f64], q: f64) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    let rank = q * (values.len() - 1) as f64;
    let low = (rank as usize).min(values.len() - 1);
    let (_, &mut at, above) = values.select_nth_unstable_by(low, f64::total_cmp);
    let next = above.iter().copied().fold(f64::INFINITY, f64::min);
    let share = rank - low as f64;
    if share > 0.0 { at + share * (next - at) } else { at }
}
