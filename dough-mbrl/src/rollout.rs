//! Rollouts: a policy rolls a dough on a rig until the goal.

use hw_traits::ErrorKind;
use hw_traits::arm::{Arm, Pose};
use hw_traits::camera::DepthCamera;
use hw_traits::clock::Clock;
use hw_traits::gripper::Gripper;
use rand::Rng;

use crate::dough::{Shape, View};
use crate::goal::{Goal, GoalError};
use crate::handling::{Handling, Motion, RigError, Side, device, look};
use crate::policy::Policy;
use crate::predictor::PlanError;
use crate::roll::{Limits, Roll};

/// All that a rollout is told, but rig and policy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setup {
    /// How pictures are read.
    pub view: View,
    /// The camera in the base frame.
    pub camera_in_world: Pose,
    /// How the rig moves.
    pub handling: Handling,
    /// What is allowed.
    pub limits: Limits,
    /// Rolls at most.
    pub most_rolls: usize,
}

impl Setup {
    /// The defaults, for a camera.
    pub fn of(camera_in_world: Pose) -> Self {
        Self {
            view: View::default(),
            camera_in_world,
            handling: Handling::default(),
            limits: Limits::default(),
            most_rolls: 150,
        }
    }
}

/// One roll of a rollout.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rolled {
    /// What was seen before and after it, and what was done.
    pub roll: Roll,
    /// When it began, on the rig's clock, s.
    pub t_s: f64,
}

/// How a rollout ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// The goal was reached.
    Reached,
    /// The dough is longer than the goal and its tolerance: it cannot be rolled back.
    TooLong,
    /// All rolls were made.
    OutOfRolls,
    /// The rig stopped for safety in the middle of a roll (fingers that hit the dough); the rolls before it count.
    Stopped,
}

/// A rollout that ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Rollout {
    /// Its rolls.
    pub rolls: Vec<Rolled>,
    /// Its end.
    pub end: End,
}

/// Why a rollout broke off; what was rolled until then has been learned by the policy.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RolloutError {
    /// The rig failed.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// The policy had no answer.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The goal is none for this dough.
    #[error(transparent)]
    Goal(#[from] GoalError),
}

impl Setup {
    /// Looks at the dough.
    ///
    /// # Errors
    /// [`RigError`].
    pub fn look<R: DepthCamera>(&self, rig: &mut R) -> Result<Shape, RigError> {
        look(rig, &self.view, &self.camera_in_world)
    }

    /// One roll of a policy: looks, acts, rolls, looks again.
    ///
    /// The state after a roll is not taken for the one before the next: dough springs back, and only two pictures of one dough tell
    /// the camera's noise from what rolls do.
    ///
    /// # Errors
    /// [`RolloutError`].
    pub fn step<R: Arm + Gripper + DepthCamera + Clock>(
        &self,
        rig: &mut R,
        policy: &mut dyn Policy,
        goal: &Goal,
        rng: &mut dyn Rng,
    ) -> Result<(Rolled, Shape), RolloutError> {
        let mut rng = rng;
        let before = self.look(rig)?;
        let state = before.state();
        let action = policy.act(&state, goal, &self.limits, rng)?;
        let t_s = rig.now_s().map_err(device("reading the clock"))?;
        let motion = Motion::constrained(&before, action);
        self.handling.roll(rig, before.ground_m, &motion, Side::draw(&mut rng))?;
        let after = self.look(rig)?;
        let roll = Roll { state, action, next: after.state() };
        policy.learn(&roll)?;
        Ok((Rolled { roll, t_s }, after))
    }

    /// Rolls the dough to a goal.
    ///
    /// # Errors
    /// [`RolloutError`].
    pub fn run<R: Arm + Gripper + DepthCamera + Clock>(
        &self,
        rig: &mut R,
        policy: &mut dyn Policy,
        goal: &Goal,
        volume_m3: f64,
        rng: &mut dyn Rng,
    ) -> Result<Rollout, RolloutError> {
        let mut shape = self.look(rig)?;
        goal.check(&shape.state(), volume_m3, &self.limits)?;
        let mut rolls = Vec::new();
        loop {
            let end = if goal.reached(&shape.state()) {
                End::Reached
            } else if shape.length_m > goal.state[0] + goal.within_m {
                End::TooLong
            } else if rolls.len() >= self.most_rolls {
                End::OutOfRolls
            } else {
                match self.step(rig, policy, goal, rng) {
                    Ok((rolled, after)) => {
                        rolls.push(rolled);
                        shape = after;
                        continue;
                    }
                    Err(RolloutError::Rig(RigError::Device { kind: ErrorKind::Stopped, .. })) => End::Stopped,
                    Err(other) => return Err(other),
                }
            };
            return Ok(Rollout { rolls, end });
        }
    }
}
