//! One quantity's posterior density, as straight lines between points.

/// Steps of the search for a density's level.
const HALVINGS: usize = 60;

/// The posterior of one quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Marginal {
    /// Points, rising, of the quantity or of its logarithm.
    x: Vec<f64>,
    /// Density at the points, its integral one.
    density: Vec<f64>,
    logarithm: bool,
}

impl Marginal {
    /// From a density at rising points, of the quantity itself or of its logarithm.
    pub(super) fn new(x: Vec<f64>, mut density: Vec<f64>, logarithm: bool) -> Self {
        let whole: f64 = (1..x.len()).map(|k| 0.5 * (x[k] - x[k - 1]) * (density[k] + density[k - 1])).sum();
        density.iter_mut().for_each(|d| *d /= whole);
        Self { x, density, logarithm }
    }

    fn outward(&self, x: f64) -> f64 {
        if self.logarithm { x.exp() } else { x }
    }

    /// The points, in the quantity's unit, with the density there: of the quantity, or of its logarithm where it has one.
    pub fn points(&self) -> impl Iterator<Item = [f64; 2]> {
        self.x.iter().zip(&self.density).map(|(x, d)| [self.outward(*x), *d])
    }

    /// The median, in the quantity's unit.
    pub fn median(&self) -> f64 {
        self.quantile(0.5)
    }

    /// The value that a share (0 to 1) of the posterior lies below.
    pub fn quantile(&self, share: f64) -> f64 {
        let mut below = 0.0;
        for k in 1..self.x.len() {
            let (width, a, b) = (self.x[k] - self.x[k - 1], self.density[k - 1], self.density[k]);
            let piece = 0.5 * width * (a + b);
            if below + piece >= share && piece > 0.0 {
                // a u + (b - a) u^2 / 2 = what is missing over the width.
                let missing = (share - below).max(0.0) / width;
                let u = 2.0 * missing / (a + (a * a + 2.0 * (b - a) * missing).max(0.0).sqrt());
                return self.outward(self.x[k - 1] + width * u.clamp(0.0, 1.0));
            }
            below += piece;
        }
        self.outward(self.x.last().copied().unwrap_or_default())
    }

    /// The share of the posterior between two values.
    pub fn between(&self, low: f64, high: f64) -> f64 {
        let inward = |v: f64| if self.logarithm { v.ln() } else { v };
        let (low, high) = (inward(low), inward(high));
        let mut sum = 0.0;
        for k in 1..self.x.len() {
            let (from, to) = (self.x[k - 1].max(low), self.x[k].min(high));
            if to > from {
                let at = |x: f64| {
                    let u = (x - self.x[k - 1]) / (self.x[k] - self.x[k - 1]);
                    self.density[k - 1] + u * (self.density[k] - self.density[k - 1])
                };
                sum += 0.5 * (to - from) * (at(from) + at(to));
            }
        }
        sum
    }

    /// The shortest set of intervals that hold a share (0 to 1) of the posterior, rising: one for each mode, where there are several (shortest
    /// in the logarithm of densities and viscosities).
    pub fn highest_density(&self, share: f64) -> Vec<[f64; 2]> {
        let (mut low, mut high) = (0.0, self.density.iter().copied().fold(0.0, f64::max));
        for _ in 0..HALVINGS {
            let level = 0.5 * (low + high);
            if self.above(level).1 > share { low = level } else { high = level }
        }
        self.above(low).0.into_iter().map(|i| i.map(|x| self.outward(x))).collect()
    }

    /// The posterior's share where the density is no larger than at a value: a p-value of that value.
    pub(super) fn rarer_than(&self, value: f64) -> f64 {
        let k = self.x.partition_point(|x| *x <= value);
        if k == 0 || k == self.x.len() {
            return 0.0;
        }
        let u = (value - self.x[k - 1]) / (self.x[k] - self.x[k - 1]);
        let level = self.density[k - 1] + u * (self.density[k] - self.density[k - 1]);
        (1.0 - self.above(level).1).clamp(0.0, 1.0)
    }

    /// Where the density is above a level, and how much of the posterior that holds.
    fn above(&self, level: f64) -> (Vec<[f64; 2]>, f64) {
        let (mut pieces, mut mass): (Vec<[f64; 2]>, f64) = (Vec::new(), 0.0);
        for k in 1..self.x.len() {
            let (a, b) = (self.density[k - 1], self.density[k]);
            let (left, right) = (self.x[k - 1], self.x[k]);
            let crossing = left + (right - left) * ((level - a) / (b - a)).clamp(0.0, 1.0);
            let (from, to) = match (a > level, b > level) {
                (true, true) => (left, right),
                (true, false) => (left, crossing),
                (false, true) => (crossing, right),
                (false, false) => continue,
            };
            mass +=
                0.5 * (to - from) * (if a > level { a } else { level } + if b > level { b } else { level });
            match pieces.last_mut() {
                Some(last) if last[1] >= from => last[1] = to,
                _ => pieces.push([from, to]),
            }
        }
        (pieces, mass)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_humps() -> Marginal {
        let x: Vec<f64> = (0..=4000).map(|k| 1e-3 * f64::from(k)).collect();
        let hump = |x: f64, at: f64| (-0.5 * ((x - at) / 0.1).powi(2)).exp();
        let density = x.iter().map(|x| hump(*x, 1.0) + hump(*x, 3.0)).collect();
        Marginal::new(x, density, false)
    }

    /// Two humps have two intervals, each as wide as a normal law's of their share; a quarter lies below the first's middle.
    #[test]
    fn every_mode_has_its_interval() {
        let marginal = two_humps();
        let pieces = marginal.highest_density(0.95);
        assert_eq!(pieces.len(), 2);
        for (piece, middle) in pieces.iter().zip([1.0, 3.0]) {
            approx::assert_abs_diff_eq!(piece[0], middle - 0.196, epsilon = 1e-3);
            approx::assert_abs_diff_eq!(piece[1], middle + 0.196, epsilon = 1e-3);
        }
        approx::assert_abs_diff_eq!(marginal.quantile(0.25), 1.0, epsilon = 1e-3);
        approx::assert_abs_diff_eq!(marginal.between(0.0, 2.0), 0.5, epsilon = 1e-6);
        approx::assert_abs_diff_eq!(marginal.rarer_than(1.196), 0.05, epsilon = 1e-3);
        assert!(marginal.rarer_than(2.0) < 1e-6 && marginal.rarer_than(9.0) == 0.0);
    }
}
