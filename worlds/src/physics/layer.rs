//! A sphere pressed into a soft layer that is bonded to a rigid ground: the mixed problem as a Fredholm equation of the second
//! kind (after Lebedev and Ufliand, 1958), solved at Gauss's nodes.
//!
//! The ground makes the surface's response to a pressure of wave number k smaller by L(kH). With the pressure's transform written
//! as the cosine transform of phi over the contact, `phi(t) + int_0^a phi(s) K(t, s) ds = (E*/pi) (delta - t^2/R)`,
//! `K = (2/pi) int_0^inf (L(kH) - 1) cos(ks) cos(kt) dk`, phi(a) = 0 where the contact ends, and F = 2 pi int_0^a phi dt.

use std::f64::consts::PI;

use super::quadrature::gauss;

const NODES: usize = 14;

/// How many times stiffer the ground makes a layer than a half-space, over `sqrt(R delta)/H`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Layer {
    /// Pairs of `sqrt(R delta)/H` and force over Hertz's force, rising.
    table: Vec<[f64; 2]>,
}

impl Layer {
    /// Tabulates the factor for a Poisson's ratio, up to a contact whose radius is 1.6 of the thickness.
    pub(crate) fn new(poisson_ratio: f64) -> Self {
        let first = [0.0, 1.0];
        let solved = (1..=64).map(|i| solve(f64::from(i) / 40.0, poisson_ratio));
        Self { table: std::iter::once(first).chain(solved).collect() }
    }

    /// The factor; beyond the table its last value.
    pub(crate) fn factor(&self, ratio: f64) -> f64 {
        let above = self.table.partition_point(|[r, _]| *r < ratio).clamp(1, self.table.len() - 1);
        let from = above.saturating_sub(2).min(self.table.len() - 4);
        let points = &self.table[from..from + 4];
        let ratio = ratio.min(self.table[self.table.len() - 1][0]);
        // Lagrange's cubic through the four nearest.
        points
            .iter()
            .enumerate()
            .map(|(i, [x, y])| {
                let others = points.iter().enumerate().filter(|(j, _)| *j != i);
                y * others.map(|(_, [other, _])| (ratio - other) / (x - other)).product::<f64>()
            })
            .sum()
    }
}

/// `sqrt(R delta)/H` and the force over Hertz's for a contact of a radius over H; lengths in H, E*/pi = R = 1.
fn solve(contact: f64, poisson_ratio: f64) -> [f64; 2] {
    let nodes: Vec<[f64; 2]> =
        gauss(NODES).iter().map(|[x, w]| [0.5 * contact * (x + 1.0), 0.5 * contact * w]).collect();
    let waves: Vec<[f64; 3]> = gauss(60)
        .iter()
        .map(|[x, w]| {
            let q = 15.0 * (x + 1.0);
            [q, 15.0 * w, less(q, 3.0 - 4.0 * poisson_ratio)]
        })
        .collect();
    let kernel = |t: f64, s: f64| -> f64 {
        2.0 / PI * waves.iter().map(|[q, w, l]| w * l * (q * s).cos() * (q * t).cos()).sum::<f64>()
    };
    // Two right sides: that of the depth (1), and that of the sphere (t^2).
    let mut rows: Vec<Vec<f64>> = (0..NODES)
        .map(|i| {
            let t = nodes[i][0];
            let left = (0..NODES).map(|j| nodes[j][1] * kernel(t, nodes[j][0]) + f64::from(u8::from(i == j)));
            left.chain([1.0, t * t]).collect()
        })
        .collect();
    eliminate(&mut rows);
    let [flat, round]: [Vec<f64>; 2] = [0, 1].map(|k| rows.iter().map(|r| r[NODES + k]).collect());
    let at_edge = |right: f64, phi: &[f64]| {
        right - (0..NODES).map(|j| nodes[j][1] * kernel(contact, nodes[j][0]) * phi[j]).sum::<f64>()
    };
    let depth = at_edge(contact * contact, &round) / at_edge(1.0, &flat);
    let sum: f64 = (0..NODES).map(|j| nodes[j][1] * (depth * flat[j] - round[j])).sum();
    // Hertz in the same units: 2 pi int_0^a (delta - t^2) dt with a^2 = delta.
    [depth.sqrt(), sum / (2.0 / 3.0 * depth.powf(1.5))]
}

/// L - 1 for a layer that is bonded (kappa = 3 - 4 nu).
fn less(q: f64, kappa: f64) -> f64 {
    // Over exp(2q), lest it overflow.
    let (once, twice) = ((-2.0 * q).exp(), (-4.0 * q).exp());
    let below = kappa * (1.0 + twice) + (1.0 + kappa * kappa + 4.0 * q * q) * once;
    (kappa * (1.0 - twice) - 4.0 * q * once) / below - 1.0
}

/// Gauss's elimination with pivots; the right sides become the solutions.
fn eliminate(rows: &mut [Vec<f64>]) {
    let n = rows.len();
    for k in 0..n {
        let best = (k..n).max_by(|&a, &b| rows[a][k].abs().total_cmp(&rows[b][k].abs())).unwrap_or(k);
        rows.swap(k, best);
        let pivot = rows[k][k];
        rows[k].iter_mut().for_each(|x| *x /= pivot);
        let source = rows[k].clone();
        for (_, row) in rows.iter_mut().enumerate().filter(|(i, _)| *i != k) {
            let share = row[k];
            row.iter_mut().zip(&source).for_each(|(x, s)| *x -= share * s);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::bisection::bisect;
    use super::*;

    /// Dimitriadis et al. (2002, doi:10.1016/S0006-3495(02)75620-8): 1 + 1.133 x + 1.283 x^2 + 0.769 x^3 + 0.0975 x^4 for thin
    /// contacts on an incompressible layer; it falls 3 % short at 0.3 and 8 % at 0.5.
    #[test]
    fn small_contacts_follow_the_known_series_and_wide_ones_exceed_it() {
        let layer = Layer::new(0.5);
        let series = |x: f64| 1.0 + 1.133 * x + 1.283 * x * x + 0.769 * x.powi(3) + 0.0975 * x.powi(4);
        for x in [0.02, 0.05, 0.1] {
            approx::assert_relative_eq!(layer.factor(x), series(x), max_relative = 5e-3);
        }
        approx::assert_abs_diff_eq!(1.0 - series(0.3) / layer.factor(0.3), 0.03, epsilon = 0.01);
        approx::assert_abs_diff_eq!(1.0 - series(0.5) / layer.factor(0.5), 0.08, epsilon = 0.015);
    }

    /// The series' first coefficient is -(2/pi) times the integral of L - 1; 1.133 is a polynomial in nu fitted to it, and 0.5 %
    /// high.
    #[test]
    fn the_first_coefficient_is_that_of_the_literature() {
        let sum: f64 = gauss(200).iter().map(|[x, w]| 15.0 * w * less(15.0 * (x + 1.0), 1.0)).sum();
        approx::assert_relative_eq!(-sum * 2.0 / PI, 1.133, max_relative = 7e-3);
    }

    #[test]
    fn the_table_has_converged_and_rises() {
        let layer = Layer::new(0.45);
        for x in [0.013, 0.21, 0.52, 1.1] {
            let direct = {
                let [low, _] = bisect([1e-3, 1.6], 40, |contact| solve(contact, 0.45)[0] < x);
                solve(low, 0.45)[1]
            };
            approx::assert_relative_eq!(layer.factor(x), direct, max_relative = 2e-5);
        }
        assert!(layer.table.windows(2).all(|p| p[1][0] > p[0][0] && p[1][1] > p[0][1]));
    }
}
