//! Powell's method in a box, as a solver of argmin: conjugate directions without derivatives (Powell 1964,
//! doi:10.1093/comjnl/7.2.155), each searched by bracketing and Brent's steps (Brent 1973), never outside the bounds.

use argmin::core::{
    CostFunction, Error, IterState, KV, Problem, Solver, TerminationReason, TerminationStatus,
};

use crate::line_search::LineSearch;

type Iterate = IterState<Vec<f64>, (), (), (), (), f64>;

/// The solver: one iteration is one sweep over all directions.
#[derive(Debug, Clone)]
pub struct Powell {
    low: Vec<f64>,
    high: Vec<f64>,
    /// Directions, one after the other.
    directions: Vec<f64>,
    trial: Vec<f64>,
    before: Vec<f64>,
    line_search: LineSearch,
    tolerance: f64,
    converged: bool,
}

/// Why there is no solver.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "bounds of {low} and {high} in dimension {dimension}: expected finite ones, the lower below the upper"
)]
pub struct BoundsError {
    /// The dimension, from 0; that of the shorter list's end where their lengths differ.
    pub dimension: usize,
    /// Lower bound, NaN where there is none.
    pub low: f64,
    /// Upper bound, NaN where there is none.
    pub high: f64,
}

impl Powell {
    /// A solver in a box; sweeps go on until one gains less than `tolerance` of the cost.
    ///
    /// # Errors
    /// [`BoundsError`].
    pub fn new(low: Vec<f64>, high: Vec<f64>, tolerance: f64) -> Result<Self, BoundsError> {
        let n = low.len();
        for dimension in 0..n.max(high.len()) {
            let at = |v: &[f64]| v.get(dimension).copied().unwrap_or(f64::NAN);
            let (low, high) = (at(&low), at(&high));
            if !(low < high && low.is_finite() && high.is_finite()) {
                return Err(BoundsError { dimension, low, high });
            }
        }
        let mut powell = Self {
            directions: vec![0.0; n * n],
            trial: vec![0.0; n],
            before: vec![0.0; n],
            line_search: LineSearch::default(),
            converged: false,
            low,
            high,
            tolerance,
        };
        powell.reset();
        Ok(powell)
    }

    /// How finely lines are searched: costs asked for at most, and the part of a line to which a place is found. By default 16
    /// and 2e-3: enough to plan, coarse for a narrow valley.
    #[must_use]
    pub fn with_lines(mut self, most: usize, precision: f64) -> Self {
        self.line_search = LineSearch { most, precision: precision.clamp(1e-12, 0.5) };
        self
    }

    fn reset(&mut self) {
        let n = self.low.len();
        self.directions.fill(0.0);
        for k in 0..n {
            self.directions[k * n + k] = self.high[k] - self.low[k];
        }
        self.converged = false;
    }

    /// How far a line goes from a point to either side.
    fn reach(&self, x: &[f64], direction: &[f64]) -> (f64, f64) {
        let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
        for (k, (&x, &d)) in x.iter().zip(direction).enumerate() {
            if d != 0.0 {
                let (a, b) = ((self.low[k] - x) / d, (self.high[k] - x) / d);
                (from, to) = (from.max(a.min(b)), to.min(a.max(b)));
            }
        }
        if from < to { (from.min(0.0), to.max(0.0)) } else { (0.0, 0.0) }
    }

    /// Moves along a direction to where the cost is least, and returns that. Allocates nothing.
    fn search(
        &mut self,
        cost: &mut dyn FnMut(&mut Vec<f64>) -> Result<f64, Error>,
        x: &mut [f64],
        at: f64,
        direction: &[f64],
    ) -> Result<f64, Error> {
        let (from, to) = self.reach(x, direction);
        if !(to - from > 1e-9) {
            return Ok(at);
        }
        let (low, high) = (&self.low, &self.high);
        let trial = &mut self.trial;
        let mut along = |t: f64| {
            for k in 0..x.len() {
                trial[k] = (x[k] + t * direction[k]).clamp(low[k], high[k]);
            }
            cost(trial)
        };
        let (t, value) = self.line_search.least(&mut along, at, from, to)?;
        if value < at {
            for k in 0..x.len() {
                x[k] = (x[k] + t * direction[k]).clamp(self.low[k], self.high[k]);
            }
            return Ok(value);
        }
        Ok(at)
    }

    /// One sweep: all directions, then the way that they made together in the place of the one that gained most.
    fn sweep(
        &mut self,
        cost: &mut dyn FnMut(&mut Vec<f64>) -> Result<f64, Error>,
        x: &mut [f64],
        start: f64,
    ) -> Result<f64, Error> {
        let n = x.len();
        self.before.copy_from_slice(x);
        let mut directions = std::mem::take(&mut self.directions);
        let (mut value, mut most, mut steepest) = (start, 0.0, 0);
        for k in 0..n {
            let found = self.search(cost, x, value, &directions[k * n..(k + 1) * n]);
            let Ok(found) = found else {
                self.directions = directions;
                return found;
            };
            if value - found > most {
                (most, steepest) = (value - found, k);
            }
            value = found;
        }
        if most > 0.0 {
            // Where the sweep would lead if it were made once more; beyond the box there is nothing to learn.
            for (k, &x) in x.iter().enumerate() {
                self.trial[k] = (2.0 * x - self.before[k]).clamp(self.low[k], self.high[k]);
            }
            let mut trial = std::mem::take(&mut self.trial);
            let beyond = cost(&mut trial);
            self.trial = trial;
            let beyond = match beyond {
                Ok(beyond) => beyond,
                Err(error) => {
                    self.directions = directions;
                    return Err(error);
                }
            };
            let gained = start - value;
            // Powell's two conditions for a direction to be exchanged.
            let curved = 2.0 * (start - 2.0 * value + beyond) * (gained - most).powi(2);
            if beyond < start && curved < (start - beyond).powi(2) * most {
                for k in 0..n {
                    directions[steepest * n + k] = x[k] - self.before[k];
                }
                let found = self.search(cost, x, value, &directions[steepest * n..(steepest + 1) * n]);
                match found {
                    Ok(found) => value = found,
                    Err(error) => {
                        self.directions = directions;
                        return Err(error);
                    }
                }
                // The newest direction comes last.
                directions[steepest * n..].rotate_left(n);
            }
        }
        self.directions = directions;
        Ok(value)
    }
}

impl<O: CostFunction<Param = Vec<f64>, Output = f64>> Solver<O, Iterate> for Powell {
    fn name(&self) -> &'static str {
        "Powell in a box"
    }

    fn init(&mut self, problem: &mut Problem<O>, mut state: Iterate) -> Result<(Iterate, Option<KV>), Error> {
        let given = state.take_param().unwrap_or_default();
        let middle = |k: usize| 0.5 * (self.low[k] + self.high[k]);
        let inside = |k: usize| match given.get(k) {
            Some(v) if !v.is_nan() => v.clamp(self.low[k], self.high[k]),
            _ => middle(k),
        };
        let x: Vec<f64> = (0..self.low.len()).map(inside).collect();
        let cost = problem.cost(&x)?;
        self.reset();
        Ok((state.param(x).cost(cost), None))
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<O>,
        mut state: Iterate,
    ) -> Result<(Iterate, Option<KV>), Error> {
        let start = state.get_cost();
        let mut x = state.take_param().unwrap_or_default();
        let value = self.sweep(&mut |x| problem.cost(x), &mut x, start)?;
        self.converged = !(start - value > self.tolerance * (start.abs() + self.tolerance));
        Ok((state.param(x).cost(value), None))
    }

    fn terminate(&mut self, _: &Iterate) -> TerminationStatus {
        if self.converged {
            return TerminationStatus::Terminated(TerminationReason::SolverConverged);
        }
        TerminationStatus::NotTerminated
    }
}
