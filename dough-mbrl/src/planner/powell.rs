//! Planning with Powell's method.

use argmin::core::{CostFunction, Error, Executor};
use rand::Rng;

use super::objective::{Planner, Task};
use crate::powell::Powell;
use crate::predictor::PlanError;

/// Plans with Powell's method from where the plan is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowellPlanner {
    /// Sweeps at most.
    pub sweeps: u64,
    /// Relative gain of a sweep at which it ends.
    pub tolerance: f64,
}

impl Default for PowellPlanner {
    fn default() -> Self {
        Self { sweeps: 12, tolerance: 1e-3 }
    }
}

/// A task as argmin sees it.
struct Cost<'a>(&'a Task<'a>);

impl CostFunction for Cost<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, plan: &Vec<f64>) -> Result<f64, Error> {
        Ok(self.0.cost(plan))
    }
}

impl Planner for PowellPlanner {
    fn plan(&mut self, task: &Task<'_>, plan: &mut Vec<f64>, _: &mut dyn Rng) -> Result<f64, PlanError> {
        task.check()?;
        let n = task.len();
        plan.resize(n, 0.5);
        let settings = |_| PlanError::Setting { name: "horizon", value: n as f64, expected: "1 to 50 rolls" };
        let powell = Powell::new(vec![0.0; n], vec![1.0; n], self.tolerance).map_err(settings)?;
        let executor = Executor::new(Cost(task), powell)
            .configure(|s| s.param(plan.clone()).max_iters(self.sweeps))
            .timer(false)
            .ctrlc(false);
        let failed = |_| PlanError::Prediction { state: task.state };
        let mut result = executor.run().map_err(failed)?;
        let cost = result.state.get_best_cost();
        match result.state.take_best_param() {
            Some(best) => plan.copy_from_slice(&best),
            None => return Err(PlanError::Prediction { state: task.state }),
        }
        Ok(cost)
    }
}
