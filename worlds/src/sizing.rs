//! How strong a hidden effect is: what no baseline can take away, in sigmas.

/// Directions in which readings can move without anybody being surprised, orthonormal.
#[derive(Debug, Clone, Default)]
pub(crate) struct Basis(Vec<Vec<f64>>);

impl Basis {
    /// Adds a direction; one that says nothing new is left out.
    pub(crate) fn add(&mut self, direction: &[f64]) {
        let before = norm(direction);
        // Twice, because the first round leaves rounding errors of the large parts in the small rest.
        let rest = self.rest(&self.rest(direction));
        let size = norm(&rest);
        if size > 1e-7 * before && size > 0.0 {
            self.0.push(rest.iter().map(|x| x / size).collect());
        }
    }

    /// With a direction more.
    fn with(&self, direction: &[f64]) -> Self {
        let mut more = self.clone();
        more.add(direction);
        more
    }

    /// What is left of a change.
    fn rest(&self, change: &[f64]) -> Vec<f64> {
        let mut rest = change.to_vec();
        for unit in &self.0 {
            let along: f64 = unit.iter().zip(&rest).map(|(u, r)| u * r).sum();
            rest.iter_mut().zip(unit).for_each(|(r, u)| *r -= along * u);
        }
        rest
    }

    /// Size of what is left of a change: the root of its sum of squares.
    pub(crate) fn left(&self, change: &[f64]) -> f64 {
        norm(&self.rest(change))
    }

    /// The bases with any two of the directions added, one of which could explain a change that is on nobody's list.
    pub(crate) fn with_pairs(&self, directions: &[Vec<f64>]) -> Vec<Self> {
        let mut pairs = Vec::new();
        for (i, first) in directions.iter().enumerate() {
            let one = self.with(first);
            pairs.extend(directions[i + 1..].iter().map(|second| one.with(second)));
        }
        pairs
    }
}

/// The change from one row of readings to another.
pub(crate) fn change(from: &[f64], to: &[f64]) -> Vec<f64> {
    from.iter().zip(to).map(|(a, b)| b - a).collect()
}

/// The size between two (above zero) at which an effect has the wanted strength, which rises with it; or the nearer end.
pub(crate) fn sized(wanted: f64, [low, high]: [f64; 2], strength: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (low.ln(), high.ln());
    for _ in 0..12 {
        let middle = 0.5 * (low + high);
        if strength(middle.exp()) < wanted { low = middle } else { high = middle }
    }
    (0.5 * (low + high)).exp()
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|v| v * v).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A parabola over a line: what a straight-line fit leaves is known.
    #[test]
    fn a_line_takes_what_a_line_can() {
        let n = 1001;
        let x: Vec<f64> = (0..n).map(|i| 2.0 * f64::from(i) / f64::from(n - 1) - 1.0).collect();
        let mut basis = Basis::default();
        basis.add(&vec![1.0; x.len()]);
        basis.add(&x);
        basis.add(&x.iter().map(|v| 3.0 - 2.0 * v).collect::<Vec<_>>());
        assert_eq!(basis.0.len(), 2);
        let parabola: Vec<f64> = x.iter().map(|v| 5.0 * v * v + v - 2.0).collect();
        // The mean square of 5 (x^2 - 1/3) over [-1, 1] is 25 * 4/45.
        let expected = (f64::from(n) * 25.0 * 4.0 / 45.0).sqrt();
        approx::assert_relative_eq!(basis.left(&parabola), expected, max_relative = 2e-3);
        let square: Vec<f64> = x.iter().map(|v| v * v).collect();
        let pairs = basis.with_pairs(&[square, x.iter().map(|v| v.powi(3)).collect()]);
        assert!(pairs.len() == 1 && pairs[0].left(&parabola) < 1e-9);
    }

    #[test]
    fn sizes_meet_the_wanted_strength_or_the_nearer_bound() {
        approx::assert_relative_eq!(sized(9.0, [1e-3, 1e3], |s| s * s), 3.0, max_relative = 0.01);
        approx::assert_relative_eq!(sized(1e9, [1e-3, 10.0], |s| s), 10.0, max_relative = 0.01);
    }
}
