/// The value below which lies a share (0 to below 1) of the values, one of them: of an even number the upper of the middle two for a half.
/// `None` of none. The order of the values changes; nothing is allocated.
pub(crate) fn quantile(values: &mut [f64], share: f64) -> Option<f64> {
    let at = (share * values.len() as f64) as usize;
    (at < values.len()).then(|| *values.select_nth_unstable_by(at, f64::total_cmp).1)
}
