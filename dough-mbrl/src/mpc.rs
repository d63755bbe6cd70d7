//! Model-predictive control: plan, roll once, look, plan again; learn every few rolls ([Matl 2021], section 7.4).

use rand::Rng;

use crate::goal::Goal;
use crate::planner::{Objective, Planner, Task};
use crate::policy::Policy;
use crate::predictor::{PlanError, Refit};
use crate::roll::{Action, Limits, Roll, State};

/// Settings; the defaults are those of [Matl 2021].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MpcSettings {
    /// What counts, and how far ahead.
    pub objective: Objective,
    /// Rolls after which the dynamics are learned anew: T; none: they stay as they are.
    pub refit_every: Option<usize>,
    /// Weight of a roll of this rollout; one of the exploration has 1.
    pub weight: f64,
    /// A state farther than this (m) from all that were learned from is refused; infinite: it is only said
    /// ([`Mpc::distance_m`]).
    pub reach_m: f64,
}

impl Default for MpcSettings {
    fn default() -> Self {
        Self { objective: Objective::default(), refit_every: Some(10), weight: 10.0, reach_m: f64::INFINITY }
    }
}

/// A policy that plans over learned dynamics, and refines them.
#[derive(Debug, Clone)]
pub struct Mpc<M, P> {
    dynamics: M,
    planner: P,
    settings: MpcSettings,
    plan: Vec<f64>,
    fresh: usize,
    distance_m: f64,
}

impl<M: Refit, P: Planner> Mpc<M, P> {
    /// A controller.
    ///
    /// # Errors
    /// [`PlanError::Setting`].
    pub fn new(dynamics: M, planner: P, settings: MpcSettings) -> Result<Self, PlanError> {
        settings.objective.check()?;
        let every = settings.refit_every.unwrap_or(1);
        PlanError::setting("refit_every", every as f64, every > 0, "at least 1 roll")?;
        let good = settings.weight > 0.0 && settings.weight.is_finite();
        PlanError::setting("weight", settings.weight, good, "above 0, finite")?;
        PlanError::setting("reach_m", settings.reach_m, settings.reach_m > 0.0, "above 0")?;
        Ok(Self { dynamics, planner, settings, plan: Vec::new(), fresh: 0, distance_m: 0.0 })
    }

    /// The dynamics as they are now.
    pub fn dynamics(&self) -> &M {
        &self.dynamics
    }

    /// How far the last state was from the nearest one that was learned from, m.
    pub fn distance_m(&self) -> f64 {
        self.distance_m
    }
}

impl<M: Refit, P: Planner> Policy for Mpc<M, P> {
    fn act(
        &mut self,
        state: &State,
        goal: &Goal,
        limits: &Limits,
        rng: &mut dyn Rng,
    ) -> Result<Action, PlanError> {
        PlanError::check(state)?;
        self.distance_m = self.dynamics.distance_m(state);
        let reach_m = self.settings.reach_m;
        if self.distance_m > reach_m {
            return Err(PlanError::Outside { state: *state, distance_m: self.distance_m, reach_m });
        }
        let task = Task {
            dynamics: &self.dynamics,
            state: *state,
            goal: *goal,
            limits: *limits,
            objective: self.settings.objective,
        };
        // What was planned before, one roll on.
        if self.plan.len() == task.len() {
            self.plan.rotate_left(2);
        }
        self.planner.plan(&task, &mut self.plan, rng)?;
        Ok(task.first(&self.plan))
    }

    fn learn(&mut self, roll: &Roll) -> Result<(), PlanError> {
        let Some(every) = self.settings.refit_every else { return Ok(()) };
        self.dynamics.add(roll, self.settings.weight)?;
        self.fresh += 1;
        if self.fresh >= every {
            self.fresh = 0;
            self.dynamics.refit()?;
        }
        Ok(())
    }
}
