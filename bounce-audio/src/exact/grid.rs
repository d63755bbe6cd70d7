//! A posterior on lattices that are zoomed to where it has its mass.

use super::ExactModel;
use crate::features::Features;

/// Points along e and along log10 kappa.
const POINTS: [usize; 2] = [40, 40];
/// Rounds of zooming at most.
const ROUNDS: usize = 8;
/// Points further below the peak than this, in nats, are left out of the next round.
const DEEP: f64 = 16.0;
/// A box that shrinks by less than this factor in both directions is good.
const STILL: f64 = 0.7;
/// Speeds of release that are looked at, in their sigma: beyond, chance is 1e-17.
const FASTEST: f64 = 9.0;
/// Halvings of an interval.
const HALVINGS: usize = 60;

/// A box of (e, log10 kappa).
type Bounds = [[f64; 2]; 2];

/// The posterior over (e, log10 kappa), flat prior: on one lattice, or on two where two restitutions explain the drops.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactPosterior {
    panels: Vec<Panel>,
    /// Log of the likelihood's integral over the box.
    ln_integral: f64,
}

/// A lattice over one range of e.
#[derive(Debug, Clone, PartialEq)]
struct Panel {
    bounds: Bounds,
    /// Log likelihood of each point, e by e; later the probability of its cell.
    cells: Vec<f64>,
}

/// The exact posterior of drops of one ball in a box of (e, log10 kappa); `None` where no ball in the box can have made them.
pub fn exact_posterior(model: &ExactModel, drops: &[Features], bounds: Bounds) -> Option<ExactPosterior> {
    let mut ranges = vec![bounds[0]];
    for x in drops {
        let possible = model.restitutions(x);
        let both = |r: &[f64; 2]| {
            let r = *r;
            possible.into_iter().map(move |p| [r[0].max(p[0]), r[1].min(p[1])])
        };
        ranges = ranges.iter().flat_map(both).filter(|r| r[0] < r[1]).collect();
    }
    let mut panels: Vec<Panel> =
        ranges.into_iter().map(|e| Panel::zoomed(model, drops, [e, bounds[1]])).collect();
    let top = panels.iter().flat_map(|p| &p.cells).copied().fold(f64::NEG_INFINITY, f64::max);
    if !top.is_finite() {
        return None;
    }
    let mut total = 0.0;
    for panel in &mut panels {
        let area = panel.step(0) * panel.step(1);
        panel.cells.iter_mut().for_each(|c| *c = area * (*c - top).exp());
        total += panel.cells.iter().sum::<f64>();
    }
    panels.iter_mut().flat_map(|p| &mut p.cells).for_each(|c| *c /= total);
    Some(ExactPosterior { panels, ln_integral: top + total.ln() })
}

impl ExactModel {
    /// The restitutions with which a release of a likely speed explains the features: none, one or two intervals.
    ///
    /// With `E = e^2`, `a = (t2/t1)^2` and `D = (d2/(d1 t2/t1))^2` the speed at the first impact obeys
    /// `E^2 (E - a)(D - E) = (g d1 (D - a) / (2 s^2))^2`, whose left side has one peak between a and D: slower impacts than the peak
    /// allows are impossible, faster ones are at two places.
    fn restitutions(&self, x: &Features) -> [[f64; 2]; 2] {
        const NONE: [f64; 2] = [1.0, 0.0];
        let r2 = x.time_ratio * x.time_ratio;
        let d = (x.d2_m / x.d1_m).powi(2) / r2;
        let (low, high) = (r2.min(d), r2.max(d));
        if !(low > 0.0 && low < high && high.is_finite()) {
            return [NONE; 2];
        }
        let left = |e2: f64| e2 * e2 * (e2 - r2) * (d - e2);
        let right = |s2: f64| (0.5 * self.gravity_m_s2 * x.d1_m * (d - r2) / s2).powi(2);
        let sum = 3.0 * (low + high);
        let peak = (sum + (sum * sum - 32.0 * low * high).max(0.0).sqrt()) / 8.0;
        // From no speed at release to the fastest.
        let slow = right(self.energy_m2_s2);
        let fast = right(self.energy_m2_s2 + (FASTEST * self.sigma_m_s).powi(2));
        let solve = |level: f64, edge: f64| {
            let (mut outer, mut inner) = (edge, peak);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (outer + inner);
                if left(middle) < level { outer = middle } else { inner = middle }
            }
            (0.5 * (outer + inner)).sqrt()
        };
        let top = left(peak);
        if fast > top {
            return [NONE; 2];
        }
        if slow > top {
            return [[solve(fast, low), solve(fast, high)], NONE];
        }
        [[solve(fast, low), solve(slow, low)], [solve(slow, high), solve(fast, high)]]
    }
}

impl Panel {
    fn zoomed(model: &ExactModel, drops: &[Features], bounds: Bounds) -> Self {
        let mut panel = Self { bounds, cells: vec![0.0; POINTS[0] * POINTS[1]] };
        for _ in 0..ROUNDS {
            for n in 0..panel.cells.len() {
                let [e, log10_kappa] = panel.at(n);
                panel.cells[n] = drops.iter().map(|x| model.ln_likelihood(x, e, log10_kappa)).sum();
            }
            let next = panel.mass_bounds();
            let still =
                (0..2).all(|k| next[k][1] - next[k][0] > STILL * (panel.bounds[k][1] - panel.bounds[k][0]));
            if still {
                break;
            }
            panel.bounds = next;
        }
        panel
    }

    fn step(&self, k: usize) -> f64 {
        (self.bounds[k][1] - self.bounds[k][0]) / POINTS[k] as f64
    }

    /// Middle of a cell.
    fn at(&self, n: usize) -> [f64; 2] {
        [(0, n / POINTS[1]), (1, n % POINTS[1])]
            .map(|(k, i)| self.bounds[k][0] + self.step(k) * (i as f64 + 0.5))
    }

    /// The box around all points near the top, one cell wider on all sides and within the former one.
    fn mass_bounds(&self) -> Bounds {
        let top = self.cells.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if !top.is_finite() {
            return self.bounds;
        }
        let (mut low, mut high) = (POINTS, [0, 0]);
        for (n, _) in self.cells.iter().enumerate().filter(|(_, c)| **c >= top - DEEP) {
            for (k, i) in [(0, n / POINTS[1]), (1, n % POINTS[1])] {
                (low[k], high[k]) = (low[k].min(i), high[k].max(i));
            }
        }
        [0, 1].map(|k| {
            let edge =
                |i: f64| (self.bounds[k][0] + self.step(k) * i).clamp(self.bounds[k][0], self.bounds[k][1]);
            [edge(low[k] as f64 - 1.0), edge(high[k] as f64 + 2.0)]
        })
    }
}

impl ExactPosterior {
    fn mean_of(&self, f: impl Fn([f64; 2]) -> f64) -> f64 {
        let of = |p: &Panel| p.cells.iter().enumerate().map(|(n, c)| c * f(p.at(n))).sum::<f64>();
        self.panels.iter().map(of).sum()
    }

    /// Means of e and log10 kappa.
    pub fn mean(&self) -> [f64; 2] {
        [0, 1].map(|k| self.mean_of(|t| t[k]))
    }

    /// Standard deviations of e and log10 kappa.
    pub fn sigma(&self) -> [f64; 2] {
        let mean = self.mean();
        [0, 1].map(|k| self.mean_of(|t| (t[k] - mean[k]).powi(2)).sqrt())
    }

    /// Probability that a parameter (0: e, 1: log10 kappa) is below a value.
    pub fn below(&self, parameter: usize, value: f64) -> f64 {
        let k = parameter.min(1);
        let of = |p: &Panel| {
            let share = |n: usize| ((value - p.at(n)[k]) / p.step(k) + 0.5).clamp(0.0, 1.0);
            p.cells.iter().enumerate().map(|(n, c)| c * share(n)).sum::<f64>()
        };
        self.panels.iter().map(of).sum()
    }

    /// Log density at (e, log10 kappa), from the likelihood there and the lattices' integral.
    pub fn ln_density(&self, model: &ExactModel, drops: &[Features], theta: [f64; 2]) -> f64 {
        drops.iter().map(|x| model.ln_likelihood(x, theta[0], theta[1])).sum::<f64>() - self.ln_integral
    }

    /// The peak of a parameter's marginal, to a cell of the lattice that holds it.
    pub fn peak(&self, parameter: usize) -> f64 {
        let k = parameter.min(1);
        let mut best = (f64::NEG_INFINITY, f64::NAN);
        for panel in &self.panels {
            for i in 0..POINTS[k] {
                let of = |j: usize| if k == 0 { i * POINTS[1] + j } else { j * POINTS[1] + i };
                let height = (0..POINTS[1 - k]).map(|j| panel.cells[of(j)]).sum::<f64>() / panel.step(k);
                if height > best.0 {
                    best = (height, panel.at(of(0))[k]);
                }
            }
        }
        best.1
    }
}
