//! Random shooting with refinement: the cross-entropy method ([Matl 2021], section 7.4; Botev et al. 2013,
//! doi:10.1016/B978-0-444-53859-8.00003-5).

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use super::objective::{Planner, Task};
use crate::predictor::PlanError;

/// Settings; the defaults are those of [Matl 2021].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CemSettings {
    /// Plans that are drawn each time: K.
    pub samples: usize,
    /// Of these, the best ones that make the next distribution: N. [Matl 2021] does not give it.
    pub elite: usize,
    /// Times that the distribution is refined: M.
    pub rounds: usize,
    /// Smoothing: beta, in (0, 1].
    pub smoothing: f64,
    /// First sigma of each number of a plan, in the unit square.
    pub sigma: f64,
}

impl Default for CemSettings {
    fn default() -> Self {
        Self { samples: 100, elite: 10, rounds: 3, smoothing: 0.5, sigma: 0.3 }
    }
}

/// The planner with its workspace: planning allocates nothing once the workspace has grown to the plan's length.
#[derive(Debug, Clone)]
pub struct Cem {
    settings: CemSettings,
    /// All plans of a round, one after the other; the cost and the number of each.
    plans: Vec<f64>,
    order: Vec<(f64, usize)>,
    mean: Vec<f64>,
    variance: Vec<f64>,
}

impl Cem {
    /// A planner.
    ///
    /// # Errors
    /// [`PlanError::Setting`].
    pub fn new(settings: CemSettings) -> Result<Self, PlanError> {
        let CemSettings { samples, elite, rounds, smoothing, sigma } = settings;
        let check = PlanError::setting;
        check("samples", samples as f64, (2..=1_000_000).contains(&samples), "2 to 1,000,000")?;
        check("elite", elite as f64, (2..=samples).contains(&elite), "2 to the number of samples")?;
        check("rounds", rounds as f64, (1..=10_000).contains(&rounds), "1 to 10,000")?;
        check("smoothing", smoothing, smoothing > 0.0 && smoothing <= 1.0, "above 0, at most 1")?;
        check("sigma", sigma, sigma > 0.0 && sigma <= 10.0, "above 0, at most 10")?;
        Ok(Self { settings, plans: Vec::new(), order: Vec::new(), mean: Vec::new(), variance: Vec::new() })
    }

    fn draw(&mut self, rng: &mut dyn Rng) {
        let n = self.mean.len();
        for plan in self.plans.chunks_exact_mut(n) {
            for (value, (mean, variance)) in plan.iter_mut().zip(self.mean.iter().zip(&self.variance)) {
                let z: f64 = StandardNormal.sample(rng);
                *value = (mean + variance.sqrt() * z).clamp(0.0, 1.0);
            }
        }
    }

    /// Moves the distribution towards the best plans.
    fn refine(&mut self) {
        let CemSettings { elite, smoothing, .. } = self.settings;
        let n = self.mean.len();
        let best = &self.order[..elite];
        for k in 0..n {
            let of = |(_, at): &(f64, usize)| self.plans[at * n + k];
            let mean = best.iter().map(of).sum::<f64>() / elite as f64;
            let variance = best.iter().map(|b| (of(b) - mean).powi(2)).sum::<f64>() / elite as f64;
            self.mean[k] += smoothing * (mean - self.mean[k]);
            self.variance[k] += smoothing * (variance - self.variance[k]);
        }
    }
}

impl Default for Cem {
    fn default() -> Self {
        let (plans, order, mean, variance) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Self { settings: CemSettings::default(), plans, order, mean, variance }
    }
}

impl Planner for Cem {
    fn plan(&mut self, task: &Task<'_>, plan: &mut Vec<f64>, rng: &mut dyn Rng) -> Result<f64, PlanError> {
        task.check()?;
        let n = task.len();
        plan.resize(n, 0.5);
        let CemSettings { samples, elite, rounds, sigma, .. } = self.settings;
        self.mean.clear();
        self.mean.extend(plan.iter().map(|v| if v.is_nan() { 0.5 } else { v.clamp(0.0, 1.0) }));
        self.variance.clear();
        self.variance.resize(n, sigma * sigma);
        self.plans.resize(samples * n, 0.5);
        let mut best = task.cost(plan);
        for _ in 0..rounds {
            self.draw(rng);
            self.order.clear();
            let costs = self.plans.chunks_exact(n).map(|p| task.cost(p));
            self.order.extend(costs.enumerate().map(|(k, c)| (c, k)));
            self.order.select_nth_unstable_by(elite - 1, |a, b| a.0.total_cmp(&b.0));
            self.refine();
        }
        // [Matl 2021] takes the last mean; should it be worse than what there was, that stays.
        let cost = task.cost(&self.mean);
        if cost <= best {
            plan.copy_from_slice(&self.mean);
            best = cost;
        }
        Ok(best)
    }
}
