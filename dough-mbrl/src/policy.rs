//! Policies that choose the next roll: the trait, and the two that know no dynamics ([Matl 2021], section 7.4).

use rand::{Rng, RngExt};

use crate::goal::Goal;
use crate::predictor::PlanError;
use crate::roll::{Action, Limits, Roll, State};

/// Chooses rolls.
pub trait Policy {
    /// The next roll (throw and depth, m), within the limits at the state.
    ///
    /// # Errors
    /// [`PlanError`].
    fn act(
        &mut self,
        state: &State,
        goal: &Goal,
        limits: &Limits,
        rng: &mut dyn Rng,
    ) -> Result<Action, PlanError>;

    /// Takes note of what a roll did. By default nothing is made of it.
    ///
    /// # Errors
    /// [`PlanError`].
    fn learn(&mut self, _roll: &Roll) -> Result<(), PlanError> {
        Ok(())
    }
}

/// Random exploration: uniform within the bounds at the state.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Explore;

impl Policy for Explore {
    fn act(
        &mut self,
        state: &State,
        _: &Goal,
        limits: &Limits,
        rng: &mut dyn Rng,
    ) -> Result<Action, PlanError> {
        PlanError::check(state)?;
        Ok(limits.at(state).place([rng.random(), rng.random()]))
    }
}

/// The fixed policy: a long band, pressed to half the goal's height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heuristic {
    /// Throw as a part of the largest; 4/5 in [Matl 2021].
    pub throw: f64,
}

impl Default for Heuristic {
    fn default() -> Self {
        Self { throw: 0.8 }
    }
}

impl Policy for Heuristic {
    fn act(
        &mut self,
        state: &State,
        goal: &Goal,
        limits: &Limits,
        _: &mut dyn Rng,
    ) -> Result<Action, PlanError> {
        PlanError::check(state)?;
        let wanted = [self.throw * limits.most_throw_m, state[2] - 0.5 * goal.state[2]];
        Ok(limits.at(state).clamp(wanted))
    }
}
