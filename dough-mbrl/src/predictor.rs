//! What planners ask of dynamics, however these were learned.

use crate::roll::{Action, Roll, State};

/// A prediction of one output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// The mean.
    pub mean: f64,
    /// One sigma of what will be measured: noise and all that was not learned.
    pub sigma: f64,
}

/// Dynamics that say what a roll does.
pub trait Predictor {
    /// The next state's mean; allocates nothing where the hot path matters ([`Ridge`](crate::ridge::Ridge)).
    fn next(&self, state: &State, action: &Action) -> State;

    /// The next state, each dimension with one sigma of what will be measured.
    fn predict(&self, state: &State, action: &Action) -> [Prediction; 3];
}

/// Dynamics that learn from further rolls.
pub trait Refit: Predictor {
    /// Notes a roll with a weight (1 for a roll of the exploration); nothing changes before [`Refit::refit`].
    ///
    /// # Errors
    /// [`LearnError::Undetermined`] for a value that is no number; nothing is noted then.
    fn add(&mut self, roll: &Roll, weight: f64) -> Result<(), LearnError>;

    /// Learns anew from all that was noted.
    ///
    /// # Errors
    /// [`LearnError`]; what was learned before stays.
    fn refit(&mut self) -> Result<(), LearnError>;

    /// Distance (m) of a state from the nearest one that was learned from.
    fn distance_m(&self, state: &State) -> f64;
}

/// Why nothing could be learned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LearnError {
    /// There are too few rolls for the coefficients.
    #[error("{rolls} rolls are too few for {coefficients} coefficients: at least {least} are needed")]
    TooFew {
        /// Rolls there are.
        rolls: usize,
        /// Coefficients of the polynomial.
        coefficients: usize,
        /// Rolls needed.
        least: usize,
    },
    /// A value is not finite, or all rolls are too much alike for their polynomial.
    #[error("the rolls do not determine a polynomial of degree {degree} of state and action")]
    Undetermined {
        /// The degree.
        degree: u8,
    },
}

/// Why no roll could be planned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// A state that is none.
    #[error("the state {state:?} is none: length, width and height are to be finite and above 0")]
    State {
        /// The state.
        state: State,
    },
    /// A setting of a planner.
    #[error("{name} is {value}: expected {expected}")]
    Setting {
        /// The setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it should be.
        expected: &'static str,
    },
    /// The state is too far from all that was learned.
    #[error(
        "the state {state:?} is {distance_m:.4} m from the nearest one learned from, farther than {reach_m:.4} m: explore there first"
    )]
    Outside {
        /// The state.
        state: State,
        /// Its distance.
        distance_m: f64,
        /// The distance that was allowed.
        reach_m: f64,
    },
    /// The dynamics predict no numbers.
    #[error("the dynamics predict no number from the state {state:?}")]
    Prediction {
        /// The state.
        state: State,
    },
    /// Nothing could be learned.
    #[error(transparent)]
    Learn(#[from] LearnError),
}

impl PlanError {
    /// Refuses states that are none.
    ///
    /// # Errors
    /// [`PlanError::State`].
    pub(crate) fn check(state: &State) -> Result<(), Self> {
        let good = state.iter().all(|v| *v > 0.0 && v.is_finite());
        if good { Ok(()) } else { Err(Self::State { state: *state }) }
    }

    pub(crate) fn setting(
        name: &'static str,
        value: f64,
        good: bool,
        expected: &'static str,
    ) -> Result<(), Self> {
        if good { Ok(()) } else { Err(Self::Setting { name, value, expected }) }
    }
}

/// The nearest of some states, m.
pub(crate) fn nearest_m(states: &[State], state: &State) -> f64 {
    let squared = |s: &State| (0..3).map(|k| (s[k] - state[k]).powi(2)).sum::<f64>();
    states.iter().map(squared).fold(f64::INFINITY, f64::min).sqrt()
}

/// State and action as one row.
pub(crate) fn row(state: &State, action: &Action) -> [f64; 5] {
    [state[0], state[1], state[2], action[0], action[1]]
}

pub(crate) fn finite(roll: &Roll) -> bool {
    roll.state.iter().chain(&roll.action).chain(&roll.next).all(|v| v.is_finite())
}

/// Whether all rolls and their number will do for some coefficients.
pub(crate) fn enough(rolls: &[Roll], coefficients: usize, degree: u8) -> Result<(), LearnError> {
    if rolls.len() < coefficients {
        return Err(LearnError::TooFew { rolls: rolls.len(), coefficients, least: coefficients });
    }
    if rolls.iter().all(finite) { Ok(()) } else { Err(LearnError::Undetermined { degree }) }
}
