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
}

/// A space to which any two of some directions may be added: two listed mechanisms that might mimic an unlisted effect.
pub(crate) struct Pairs {
    space: Nuisances,
    /// What the space leaves of the directions, each of length one.
    rests: Vec<Vec<f64>>,
    /// Their products.
    products: Vec<Vec<f64>>,
}

impl Pairs {
    pub(crate) fn new(space: Nuisances, directions: &[Vec<f64>]) -> Self {
        let rests: Vec<Vec<f64>> =
            directions.iter().flat_map(|d| space.with(d).0.split_off(space.0.len())).collect();
        let products = rests.iter().map(|a| rests.iter().map(|b| dot(a, b)).collect()).collect();
        Self { space, rests, products }
    }

    /// The root of the sum of squares of what the space and the best pair leave of a change.
    pub(crate) fn residual_norm(&self, change: &[f64]) -> f64 {
        let rest = self.space.residual(change);
        let whole = dot(&rest, &rest);
        let along: Vec<f64> = self.rests.iter().map(|r| dot(r, &rest)).collect();
        let mut most: f64 = along.iter().map(|a| a * a).fold(0.0, f64::max);
        for (i, a) in along.iter().enumerate() {
            for (j, b) in along.iter().enumerate().skip(i + 1) {
                let c = self.products[i][j];
                let apart = 1.0 - c * c;
                // Two that are all but one.
                if apart > 1e-10 {
                    most = most.max((a * a + b * b - 2.0 * a * b * c) / apart);
                }
            }
        }
        (whole - most).max(0.0).sqrt()
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
    dot(x, x).sqrt()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
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
        let cube: Vec<f64> = x.iter().map(|v| v.powi(3)).collect();
        let fourth: Vec<f64> = x.iter().map(|v| v.powi(4)).collect();
        let pairs = Pairs::new(space.clone(), &[square.clone(), cube.clone(), x.clone()]);
        assert!(pairs.residual_norm(&parabola) < 1e-5);
        // The pair that takes most, as the space of all three pairs says.
        let bent: Vec<f64> = x.iter().map(|v| v.powi(5) + 0.1 * v.exp()).collect();
        let plainly = |a, b| space.with(a).with(b).residual_norm(&bent);
        let least = plainly(&square, &cube).min(plainly(&square, &fourth)).min(plainly(&cube, &fourth));
        let pairs = Pairs::new(space.clone(), &[square, cube, fourth]);
        approx::assert_relative_eq!(pairs.residual_norm(&bent), least, max_relative = 1e-9);
    }

    #[test]
    fn sizes_meet_the_wanted_strength_or_the_nearer_bound() {
        approx::assert_relative_eq!(size_of_strength(9.0, [1e-3, 1e3], |s| s * s), 3.0, max_relative = 0.01);
        approx::assert_relative_eq!(size_of_strength(1e9, [1e-3, 10.0], |s| s), 10.0, max_relative = 0.01);
    }
}
