//! Where a function of one variable is least.

use argmin::core::{CostFunction, Error, Executor, State as _};
use argmin::solver::brent::BrentOpt;

/// A cost of one variable, as argmin takes it.
struct OneVariable<F>(F);

impl<F: Fn(f64) -> f64> CostFunction for OneVariable<F> {
    type Param = f64;
    type Output = f64;

    fn cost(&self, at: &f64) -> Result<f64, Error> {
        Ok((self.0)(*at))
    }
}

/// Where a function of one variable is least, to a ten thousandth of the range, by Brent's method.
pub(super) fn least([low, high]: [f64; 2], cost: impl Fn(f64) -> f64) -> f64 {
    let solver = BrentOpt::new(low, high).set_tolerance(0.0, 1e-4 * (high - low));
    let found = Executor::new(OneVariable(cost), solver).configure(|state| state.max_iters(40)).run();
    found.ok().and_then(|f| f.state().get_best_param().copied()).unwrap_or(0.5 * (low + high))
}
