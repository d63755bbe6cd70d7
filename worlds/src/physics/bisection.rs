//! Bisection.

/// An interval halved so often about the place where a condition that holds at its beginning ceases to hold.
pub(crate) fn bisect(ends: [f64; 2], halvings: usize, mut holds: impl FnMut(f64) -> bool) -> [f64; 2] {
    let [mut low, mut high] = ends;
    for _ in 0..halvings {
        let middle = 0.5 * (low + high);
        if holds(middle) { low = middle } else { high = middle }
    }
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::bisect;

    #[test]
    fn the_root_of_two_lies_between_the_ends() {
        let [low, high] = bisect([0.0, 2.0], 40, |x| x * x < 2.0);
        assert!(low * low < 2.0 && high * high >= 2.0 && high - low < 1e-11);
    }
}
