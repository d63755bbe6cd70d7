//! Powell's method in a box, as a solver of argmin: conjugate directions without derivatives (Powell 1964,
//! doi:10.1093/comjnl/7.2.155), each searched by bracketing and Brent's steps (Brent 1973), never outside the bounds.

use argmin::core::{
    CostFunction, Error, Executor, IterState, KV, Problem, Solver, TerminationReason, TerminationStatus,
};
use rand::Rng;

use crate::objective::{Planner, Task};
use crate::predictor::PlanError;

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
    line: Line,
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
            line: Line::default(),
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
        self.line = Line { most, precision: precision.clamp(1e-12, 0.5) };
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
        let (t, value) = self.line.least(&mut along, at, from, to)?;
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

/// A search on an interval.
#[derive(Debug, Clone, Copy)]
struct Line {
    /// Costs that are asked for at most.
    most: usize,
    /// Part of the interval to which the place is found.
    precision: f64,
}

impl Default for Line {
    fn default() -> Self {
        Self { most: 16, precision: 2e-3 }
    }
}

const GOLDEN: f64 = 0.381_966_011_250_105_1;

impl Line {
    /// The least cost found between two places about 0, where it is `at`.
    fn least(
        &self,
        cost: &mut dyn FnMut(f64) -> Result<f64, Error>,
        at: f64,
        from: f64,
        to: f64,
    ) -> Result<(f64, f64), Error> {
        let span = to - from;
        let (mut a, mut b, mut x, mut fx, mut asked) = self.bracket(cost, at, from, to)?;
        // Brent: parabolas through the three best places, golden sections where these mislead.
        let (mut w, mut fw, mut v, mut fv) = (x, fx, x, fx);
        let (mut step, mut last) = (0.0_f64, b - a);
        let fine = self.precision * span;
        while asked < self.most && (b - a) > 2.0 * fine {
            let middle = 0.5 * (a + b);
            let (r, q) = ((x - w) * (fx - fv), (x - v) * (fx - fw));
            let mut p = (x - v) * q - (x - w) * r;
            let mut q = 2.0 * (q - r);
            if q > 0.0 {
                p = -p;
            }
            q = q.abs();
            let good = p.abs() < 0.5 * q * last.abs() && p > q * (a - x) && p < q * (b - x);
            last = step;
            step = if good {
                p / q
            } else {
                last = if x < middle { b - x } else { a - x };
                GOLDEN * last
            };
            let u = if step.abs() >= fine { x + step } else { x + fine.copysign(step) };
            let u = u.clamp(a, b);
            let fu = cost(u)?;
            asked += 1;
            if fu <= fx {
                if u < x {
                    b = x
                } else {
                    a = x
                }
                (v, fv, w, fw, x, fx) = (w, fw, x, fx, u, fu);
            } else {
                if u < x {
                    a = u
                } else {
                    b = u
                }
                if fu <= fw || w == x {
                    (v, fv, w, fw) = (w, fw, u, fu);
                } else if fu <= fv || v == x || v == w {
                    (v, fv) = (u, fu);
                }
            }
        }
        Ok((x, fx))
    }

    /// Goes downhill from 0 with growing steps until the cost rises or the interval ends: both ends, the best place and its
    /// cost, and how many costs were asked for.
    fn bracket(
        &self,
        cost: &mut dyn FnMut(f64) -> Result<f64, Error>,
        at: f64,
        from: f64,
        to: f64,
    ) -> Result<(f64, f64, f64, f64, usize), Error> {
        // Towards the roomier side first.
        let ends = if to >= -from { [to, from] } else { [from, to] };
        let mut asked = 0;
        let mut uphill = 0.0;
        for end in ends {
            if end == 0.0 {
                continue;
            }
            let (mut behind, mut x, mut fx) = (uphill, 0.0_f64, at);
            let mut reach = 0.15 * (to - from);
            loop {
                let next = if x.abs() + reach < end.abs() { x + reach.copysign(end) } else { end };
                let f = cost(next)?;
                asked += 1;
                if !(f < fx) {
                    if x == 0.0 {
                        uphill = next;
                        break;
                    }
                    return Ok((behind.min(next), behind.max(next), x, fx, asked));
                }
                (behind, x, fx) = (x, next, f);
                if next == end {
                    return Ok((behind.min(end), behind.max(end), x, fx, asked));
                }
                reach *= 2.0;
            }
        }
        // Uphill to both sides: the best place is between.
        let first = if ends[0] > 0.0 { from } else { to };
        let other = if uphill == 0.0 { first } else { uphill };
        let near = 0.15 * (to - from);
        let (a, b) = ((-near).max(from).min(other), near.min(to).max(other));
        Ok((a.min(0.0), b.max(0.0), 0.0, at, asked))
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
