//! Goals: uniform cylinders, and whether a dough can become one.

use crate::roll::{Limits, State};

/// A state to be reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// The state, m.
    pub state: State,
    /// It is reached within this Euclidean distance, m.
    pub within_m: f64,
}

/// Why a goal is none.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GoalError {
    /// A value is no number above zero.
    #[error("{name} is {value}: expected above 0 and finite")]
    Value {
        /// Which.
        name: &'static str,
        /// What it is.
        value: f64,
    },
    /// The dough has another volume.
    #[error(
        "a dough of {goal_m3:.3e} m^3 is asked for, and there are {dough_m3:.3e} m^3: rolling keeps the volume (to {percent:.0} %)"
    )]
    Volume {
        /// Volume of the goal, a cylinder in its box.
        goal_m3: f64,
        /// Volume that there is.
        dough_m3: f64,
        /// Difference that passes.
        percent: f64,
    },
    /// Rolling lengthens.
    #[error("the dough is {length_m:.4} m long and is to be {goal_m:.4} m: rolling does not shorten it")]
    Shorter {
        /// Length of the dough.
        length_m: f64,
        /// Length of the goal.
        goal_m: f64,
    },
    /// The goal is lower than the band can press.
    #[error(
        "a dough {length_m:.3} m long would be {height_m:.4} m high, below the smallest depth of {least_m:.4} m"
    )]
    TooThin {
        /// Length of the goal.
        length_m: f64,
        /// Its height.
        height_m: f64,
        /// The smallest depth.
        least_m: f64,
    },
}

/// Relative difference of volumes that passes: a box around a cloud is no scale.
const VOLUME_PERCENT: f64 = 20.0;

impl Goal {
    /// The uniform cylinder of a length and a volume: width and height are its diameter. Reached within 10 mm.
    ///
    /// # Errors
    /// [`GoalError::Value`].
    pub fn cylinder(length_m: f64, volume_m3: f64) -> Result<Self, GoalError> {
        for (name, value) in [("length_m", length_m), ("volume_m3", volume_m3)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(GoalError::Value { name, value });
            }
        }
        let diameter = 2.0 * (volume_m3 / (std::f64::consts::PI * length_m)).sqrt();
        Ok(Self { state: [length_m, diameter, diameter], within_m: 0.01 })
    }

    /// Euclidean distance of a state from it, m.
    pub fn distance_m(&self, state: &State) -> f64 {
        (0..3).map(|k| (state[k] - self.state[k]).powi(2)).sum::<f64>().sqrt()
    }

    /// Whether a state is it.
    pub fn reached(&self, state: &State) -> bool {
        self.distance_m(state) < self.within_m
    }

    /// Whether a dough of a volume can be rolled from a state to here.
    ///
    /// # Errors
    /// [`GoalError`].
    pub fn check(&self, from: &State, volume_m3: f64, limits: &Limits) -> Result<(), GoalError> {
        let names = ["goal's length", "goal's width", "goal's height", "tolerance", "volume"];
        let values = self.state.iter().chain([&self.within_m, &volume_m3]);
        for (name, &value) in names.into_iter().zip(values) {
            if !(value > 0.0 && value.is_finite()) {
                return Err(GoalError::Value { name, value });
            }
        }
        let [length, width, height] = self.state;
        let goal_m3 = 0.25 * std::f64::consts::PI * length * width * height;
        if !((goal_m3 / volume_m3 - 1.0).abs() <= 0.01 * VOLUME_PERCENT) {
            return Err(GoalError::Volume { goal_m3, dough_m3: volume_m3, percent: VOLUME_PERCENT });
        }
        if from[0] > length + self.within_m {
            return Err(GoalError::Shorter { length_m: from[0], goal_m: length });
        }
        if height <= limits.least_depth_m {
            return Err(GoalError::TooThin {
                length_m: length,
                height_m: height,
                least_m: limits.least_depth_m,
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goals_that_cannot_be_are_refused() {
        let (start, limits) = ([0.043, 0.042, 0.042], Limits::default());
        let goal = Goal::cylinder(0.15, 4e-5).unwrap();
        approx::assert_relative_eq!(goal.state[1], 0.018_426_6, max_relative = 1e-4);
        assert_eq!(goal.check(&start, 4e-5, &limits), Ok(()));
        assert!(matches!(goal.check(&start, 8e-5, &limits), Err(GoalError::Volume { .. })));
        assert!(matches!(goal.check(&[0.2, 0.016, 0.016], 4e-5, &limits), Err(GoalError::Shorter { .. })));
        assert!(matches!(
            goal.check(&start, f64::NAN, &limits),
            Err(GoalError::Value { name: "volume", .. })
        ));
        let thin = Goal::cylinder(3.0, 4e-5).unwrap();
        assert!(matches!(thin.check(&start, 4e-5, &limits), Err(GoalError::TooThin { .. })));
        assert!(Goal::cylinder(f64::NAN, 4e-5).is_err() && Goal::cylinder(0.1, -1.0).is_err());
    }

    #[test]
    fn longer_goals_are_thinner() {
        let goals: Vec<Goal> = (2..40).map(|i| Goal::cylinder(0.01 * f64::from(i), 4e-5).unwrap()).collect();
        assert!(goals.windows(2).all(|g| g[1].state[1] < g[0].state[1]));
    }
}
