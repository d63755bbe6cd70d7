//! Dynamics that were learned, and what has since been found to be different: the response is a factor of the learned one, and
//! below some force there is none.

use crate::band::Band;
use crate::predictor::{LearnError, PlanError, Prediction, Predictor, Refit};
use crate::roll::{Action, Roll, State};

/// What a diagnosis found; the default changes nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// Strain over the learned strain, above 0.
    pub factor: f64,
    /// Force (N) below which the band slips and changes nothing; 0: it never slips.
    pub slip_n: f64,
    /// The band that makes the force.
    pub band: Band,
}

impl Default for Response {
    fn default() -> Self {
        Self { factor: 1.0, slip_n: 0.0, band: Band::default() }
    }
}

impl Response {
    /// Strain over the learned strain of a roll.
    pub fn of(&self, action: &Action) -> f64 {
        if self.band.force_n(action[0], action[1]) < self.slip_n { 0.0 } else { self.factor }
    }
}

/// A state after a part of a roll, or more than it: each dimension's logarithmic strain is `response` times that of the whole roll, so
/// that what keeps its volume keeps it.
pub fn answered(state: &State, next: &State, response: f64) -> State {
    std::array::from_fn(|k| {
        let ratio = next[k] / state[k];
        // A strain that is none (a prediction of no dough) is left a change.
        if ratio > 0.0 { state[k] * ratio.powf(response) } else { state[k] + response * (next[k] - state[k]) }
    })
}

/// Repaired dynamics: the learned ones, [`answered`].
#[derive(Debug, Clone)]
pub struct Repaired<M> {
    learned: M,
    response: Response,
}

impl<M> Repaired<M> {
    /// Puts a response before learned dynamics.
    ///
    /// # Errors
    /// [`PlanError::Setting`].
    pub fn new(learned: M, response: Response) -> Result<Self, PlanError> {
        let Response { factor, slip_n, .. } = response;
        PlanError::setting("factor", factor, factor > 0.0 && factor.is_finite(), "above 0, finite")?;
        PlanError::setting("slip_n", slip_n, slip_n >= 0.0 && slip_n.is_finite(), "at least 0, finite")?;
        Ok(Self { learned, response })
    }
}

impl<M: Predictor> Predictor for Repaired<M> {
    fn next(&self, state: &State, action: &Action) -> State {
        answered(state, &self.learned.next(state, action), self.response.of(action))
    }

    /// As unsure as the learned dynamics, whatever the response: a sigma holds the camera's noise too.
    fn predict(&self, state: &State, action: &Action) -> [Prediction; 3] {
        let response = self.response.of(action);
        let learned = self.learned.predict(state, action);
        let mean = answered(state, &learned.map(|p| p.mean), response);
        std::array::from_fn(|k| Prediction { mean: mean[k], sigma: learned[k].sigma * response.max(1.0) })
    }
}

/// A further roll teaches the learned dynamics what it would have done without the response.
impl<M: Refit> Refit for Repaired<M> {
    fn add(&mut self, roll: &Roll, weight: f64) -> Result<(), LearnError> {
        let response = self.response.of(&roll.action);
        // A roll that slipped says nothing of the rest.
        if response == 0.0 {
            return Ok(());
        }
        let next = answered(&roll.state, &roll.next, 1.0 / response);
        // The noise is divided too.
        self.learned.add(&Roll { next, ..*roll }, weight * response * response)
    }

    fn refit(&mut self) -> Result<(), LearnError> {
        self.learned.refit()
    }

    fn distance_m(&self, state: &State) -> f64 {
        self.learned.distance_m(state)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ridge::Ridge;

    /// Rolls that lengthen by a known part of the depth.
    fn rolls(part: f64) -> Vec<Roll> {
        (0..60)
            .map(|i| {
                let u = f64::from(i);
                let state = [0.05 + 1e-3 * u, 0.04 + 1e-3 * (2.0 * u).sin(), 0.03 + 1e-3 * (3.0 * u).cos()];
                let action = [0.08 + 0.03 * (1.3 * u).sin(), 0.02 + 0.01 * (0.7 * u).cos()];
                let next = [state[0] + part * action[1], state[1] - 0.2 * part * action[1], state[2]];
                Roll { state, action, next }
            })
            .collect()
    }

    fn learned(part: f64) -> Ridge {
        Ridge::learn(&rolls(part), 1, 1e-9).unwrap()
    }

    #[test]
    fn a_factor_and_slip_do_what_they_say() {
        let response = Response { factor: 0.5, slip_n: 1.0, ..Response::default() };
        let repaired = Repaired::new(learned(0.4), response).unwrap();
        let (state, deep, shallow) = ([0.07, 0.04, 0.03], [0.08, 0.02], [0.08, 5e-3]);
        // 96 N/m: 2.2 N and 0.5 N.
        approx::assert_relative_eq!(
            repaired.next(&state, &deep)[0],
            0.07 * f64::sqrt(1.0 + 0.4 * 0.02 / 0.07),
            max_relative = 1e-5
        );
        assert_eq!(repaired.next(&state, &shallow), state);
        approx::assert_relative_eq!(
            repaired.predict(&state, &deep)[1].mean,
            0.04 * f64::sqrt(1.0 - 0.08 * 0.02 / 0.04),
            max_relative = 1e-5
        );
    }

    #[test]
    fn further_rolls_that_obey_the_response_change_nothing() {
        let response = Response { factor: 0.5, slip_n: 1.0, ..Response::default() };
        let mut repaired = Repaired::new(learned(0.4), response).unwrap();
        let (state, action) = ([0.07, 0.04, 0.03], [0.08, 0.02]);
        let before = repaired.next(&state, &action);
        for roll in rolls(0.4).into_iter().filter(|r| response.of(&r.action) > 0.0) {
            let next = answered(&roll.state, &roll.next, 0.5);
            repaired.add(&Roll { next, ..roll }, 10.0).unwrap();
        }
        let slipped = Roll { state, action: [0.08, 5e-3], next: state };
        repaired.add(&slipped, 1e3).unwrap();
        repaired.refit().unwrap();
        approx::assert_relative_eq!(repaired.next(&state, &action)[0], before[0], max_relative = 1e-5);
    }

    /// Half a roll twice is the roll; what keeps its volume keeps it.
    #[test]
    fn parts_of_a_roll_keep_the_volume() {
        let (state, next) = ([0.05, 0.04, 0.03], [0.0625, 0.036, 0.03 / 1.125]);
        let volume = |s: &State| s.iter().product::<f64>();
        for response in [0.0, 0.3, 1.0, 1.7] {
            let part = answered(&state, &next, response);
            approx::assert_relative_eq!(volume(&part), volume(&state), max_relative = 1e-12);
        }
        let half = answered(&state, &next, 0.5);
        approx::assert_relative_eq!(half[0] * half[0] / state[0], next[0], max_relative = 1e-12);
        assert!(answered(&state, &[-0.01, 0.04, 0.03], 0.5).iter().all(|v| v.is_finite()));
    }

    #[test]
    fn responses_that_are_none_are_refused() {
        for (factor, slip_n) in [(0.0, 0.0), (f64::NAN, 0.0), (1.0, -1.0), (1.0, f64::INFINITY)] {
            let response = Response { factor, slip_n, ..Response::default() };
            assert!(matches!(Repaired::new(learned(0.4), response), Err(PlanError::Setting { .. })));
        }
    }
}
