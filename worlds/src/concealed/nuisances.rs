//! How strong a hidden effect is: the size of what the baseline's nuisance parameters cannot take away, in sigmas.

use crate::physics::bisection::bisect;

/// The space in which nuisance parameters can move the readings, by an orthonormal space.
#[derive(Debug, Clone, Default)]
pub(crate) struct Nuisances(Vec<Vec<f64>>);

impl Nuisances {
    /// Adds a direction; one that lies within the space is left out.
    pub(crate) fn add(&mut self, direction: &[f64]) {
        let before = norm(direction);
        // Twice, because the first round leaves rounding errors of the large parts in the small rest.
        let rest = self.residual(&self.residual(direction));
        let size = norm(&rest);
        if size > 1e-7 * before && size > 0.0 {
            self.0.push(rest.iter().map(|x| x / size).collect());
        }
    }

    /// This space with one direction more.
    pub(crate) fn with(&self, direction: &[f64]) -> Self {
        let mut more = self.clone();
        more.add(direction);
        more
    }

    /// The part of a change that is orthogonal to the space.
    fn residual(&self, change: &[f64]) -> Vec<f64> {
        let mut rest = change.to_vec();
        for unit in &self.0 {
            let along: f64 = unit.iter().zip(&rest).map(|(u, r)| u * r).sum();
            rest.iter_mut().zip(unit).for_each(|(r, u)| *r -= along * u);
        }
        rest
    }

    /// The root of the sum of squares of the part of a change that is orthogonal to the space.
    pub(crate) fn residual_norm(&self, change: &[f64]) -> f64 {
        norm(&self.residual(change))
    }

    /// The spaces with any two of the directions added: two listed mechanisms that might mimic an unlisted effect.
    pub(crate) fn with_pairs(&self, directions: &[Vec<f64>]) -> Vec<Self> {
        let mut pairs = Vec::new();
        for (i, first) in directions.iter().enumerate() {
            let one = self.with(first);
            pairs.extend(directions[i + 1..].iter().map(|second| one.with(second)));
        }
        pairs
    }
}

/// The difference of two series of readings.
pub(crate) fn difference(from: &[f64], to: &[f64]) -> Vec<f64> {
    from.iter().zip(to).map(|(a, b)| b - a).collect()
}

/// The size between two (above zero) at which an effect has the wanted strength, which rises with its size; or the nearer end.
pub(crate) fn size_of_strength(wanted: f64, [low, high]: [f64; 2], strength: impl Fn(f64) -> f64) -> f64 {
    let [low, high] = bisect([low.ln(), high.ln()], 12, |size| strength(size.exp()) < wanted);
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
        let mut space = Nuisances::default();
        space.add(&vec![1.0; x.len()]);
        space.add(&x);
        space.add(&x.iter().map(|v| 3.0 - 2.0 * v).collect::<Vec<_>>());
        assert_eq!(space.0.len(), 2);
        let parabola: Vec<f64> = x.iter().map(|v| 5.0 * v * v + v - 2.0).collect();
        // The mean square of 5 (x^2 - 1/3) over [-1, 1] is 25 * 4/45.
        let expected = (f64::from(n) * 25.0 * 4.0 / 45.0).sqrt();
        approx::assert_relative_eq!(space.residual_norm(&parabola), expected, max_relative = 2e-3);
        let square: Vec<f64> = x.iter().map(|v| v * v).collect();
        let pairs = space.with_pairs(&[square, x.iter().map(|v| v.powi(3)).collect()]);
        assert!(pairs.len() == 1 && pairs[0].residual_norm(&parabola) < 1e-9);
    }

    #[test]
    fn sizes_meet_the_wanted_strength_or_the_nearer_bound() {
        approx::assert_relative_eq!(size_of_strength(9.0, [1e-3, 1e3], |s| s * s), 3.0, max_relative = 0.01);
        approx::assert_relative_eq!(size_of_strength(1e9, [1e-3, 10.0], |s| s), 10.0, max_relative = 0.01);
    }
}
