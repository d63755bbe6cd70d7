//! What a plan is worth: the discounted objective of eq. 7.1 over predicted states.

use super::chance::Chance;
use crate::goal::Goal;
use crate::predictor::{PlanError, Predictor};
use crate::roll::{Action, Limits, State};

/// The objective of a planner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Objective {
    /// Rolls that are looked ahead: H.
    pub horizon: usize,
    /// Discount of each further roll: gamma, in (0, 1].
    pub discount: f64,
    /// Cost of each sigma of a predicted state, in its own metres: 0 plans as if the dynamics were certain; 1 is cautious.
    pub caution: f64,
    /// Part of the goal's tolerance within which a predicted state counts as there: a plan that only just enters it misses half of
    /// the time, and what is too long stays too long. In [0, 1]; at 0 a plan goes on beyond the goal.
    pub aim: f64,
    /// Cost of each metre by which the dough may get too long, since no roll shortens it; 0 counts too long like too short.
    pub too_long: f64,
    /// By how much more than predicted a roll may lengthen, as a part of what is predicted: what `too_long` counts with.
    pub doubt: f64,
    /// A bound on the chance of getting too long, of each roll of the plan.
    pub chance: Option<Chance>,
}

impl Default for Objective {
    /// Ten rolls, 0.9, certain; a third of the tolerance; too long is dear, and a roll may do two and a half times what is
    /// predicted: deep rolls of a long dough do, on the fake.
    fn default() -> Self {
        Self {
            horizon: 10,
            discount: 0.9,
            caution: 0.0,
            aim: 1.0 / 3.0,
            too_long: 5.0,
            doubt: 1.5,
            chance: None,
        }
    }
}

/// Most rolls that are looked ahead.
pub const MOST_HORIZON: usize = 50;

/// Cost of each metre by which a roll breaks the chance constraint: far above what any plan gains.
const BROKEN: f64 = 100.0;

impl Objective {
    /// Eq. 7.1 of [Matl 2021] and nothing else, ten rolls ahead at a discount of 0.9 (which she does not give): the discounted distances from
    /// the goal over the whole horizon, dynamics taken for certain.
    pub fn equation_7_1() -> Self {
        Self { horizon: 10, discount: 0.9, caution: 0.0, aim: 0.0, too_long: 0.0, doubt: 0.0, chance: None }
    }

    /// Eq. 7.1, ended within a third of the goal's tolerance, under a chance constraint on the length.
    pub fn constrained(chance: Chance) -> Self {
        Self { aim: 1.0 / 3.0, chance: Some(chance), ..Self::equation_7_1() }
    }

    pub(crate) fn check(&self) -> Result<(), PlanError> {
        let h = self.horizon as f64;
        PlanError::setting("horizon", h, (1..=MOST_HORIZON).contains(&self.horizon), "1 to 50 rolls")?;
        let good = self.discount > 0.0 && self.discount <= 1.0;
        PlanError::setting("discount", self.discount, good, "above 0, at most 1")?;
        let good = self.caution >= 0.0 && self.caution.is_finite();
        PlanError::setting("caution", self.caution, good, "at least 0, finite")?;
        PlanError::setting("aim", self.aim, (0.0..=1.0).contains(&self.aim), "0 to 1")?;
        for (name, value) in [("too_long", self.too_long), ("doubt", self.doubt)] {
            PlanError::setting(name, value, value >= 0.0 && value.is_finite(), "at least 0, finite")?;
        }
        Ok(())
    }
}

/// A state from which rolls are planned.
///
/// A plan is a place in the unit square for each roll: between the bounds at the state from which that roll is to start. So no plan
/// leaves the bounds, whatever a planner makes of it.
#[derive(Clone, Copy)]
pub struct Task<'a> {
    /// The dynamics.
    pub dynamics: &'a dyn Predictor,
    /// The present state.
    pub state: State,
    /// The state to be reached.
    pub goal: Goal,
    /// What is allowed.
    pub limits: Limits,
    /// What counts.
    pub objective: Objective,
}

impl Task<'_> {
    /// Refuses what cannot be planned.
    ///
    /// # Errors
    /// [`PlanError`].
    pub fn check(&self) -> Result<(), PlanError> {
        self.objective.check()?;
        PlanError::check(&self.state)?;
        let middle = self.limits.at(&self.state).place([0.5; 2]);
        let good = self.dynamics.next(&self.state, &middle).iter().all(|v| v.is_finite());
        if good { Ok(()) } else { Err(PlanError::Prediction { state: self.state }) }
    }

    /// Length of a plan: two numbers a roll.
    pub fn len(&self) -> usize {
        2 * self.objective.horizon
    }

    /// Whether there is nothing to plan; never for a task that was checked.
    pub fn is_empty(&self) -> bool {
        self.objective.horizon == 0
    }

    /// The cost of a plan, m: the sum of the discounted distances from the goal after each roll; the reward of eq. 7.1 with the sign
    /// turned. What is at the goal stays there. Allocates nothing beyond what the dynamics do.
    pub fn cost(&self, plan: &[f64]) -> f64 {
        let mut state = self.state;
        let (mut cost, mut discount) = (0.0, 1.0);
        for unit in plan.chunks_exact(2).take(self.objective.horizon) {
            if self.goal.distance_m(&state) < self.objective.aim * self.goal.within_m {
                break;
            }
            let action = self.limits.at(&state).place([unit[0], unit[1]]);
            let mut unsure = 0.0;
            let next = if self.objective.caution > 0.0 {
                let predicted = self.dynamics.predict(&state, &action);
                unsure = predicted.iter().map(|p| p.sigma * p.sigma).sum::<f64>().sqrt();
                predicted.map(|p| p.mean)
            } else {
                self.dynamics.next(&state, &action)
            };
            // Dynamics that predict no dough predict nothing good; and no roll shortens it.
            let mut next = next.map(|v| if v.is_nan() { 10.0 } else { v.clamp(1e-3, 10.0) });
            let one_way = self.objective.too_long > 0.0 || self.objective.chance.is_some();
            if one_way {
                next[0] = next[0].max(state[0]);
            }
            let longest = next[0] + self.objective.doubt * (next[0] - state[0]);
            let too_long = (longest - self.goal.state[0] - 0.5 * self.goal.within_m).max(0.0);
            let longest_m = self.goal.state[0] + self.goal.within_m;
            let broken = self.objective.chance.map_or(0.0, |c| c.excess_m(state[0], next[0], longest_m));
            state = next;
            let off = self.goal.distance_m(&state) + self.objective.caution * unsure;
            cost += discount * (off + self.objective.too_long * too_long + BROKEN * broken);
            discount *= self.objective.discount;
        }
        cost
    }

    /// The first roll of a plan.
    pub fn first(&self, plan: &[f64]) -> Action {
        let unit = [plan.first().copied().unwrap_or(0.5), plan.get(1).copied().unwrap_or(0.5)];
        self.limits.at(&self.state).place(unit)
    }
}

/// Plans rolls.
pub trait Planner {
    /// Improves a plan (two numbers in [0, 1] a roll; what it holds is where to begin) and returns its cost, m.
    ///
    /// The plan is lengthened by halves or cut to the task's length; it is never worse than it was.
    ///
    /// # Errors
    /// [`PlanError`]; the plan is then as it was.
    fn plan(
        &mut self,
        task: &Task<'_>,
        plan: &mut Vec<f64>,
        rng: &mut dyn rand::Rng,
    ) -> Result<f64, PlanError>;
}
