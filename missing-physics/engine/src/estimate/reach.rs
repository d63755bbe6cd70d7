//! How far 95 % intervals reach.

use statrs::distribution::{ContinuousCDF as _, StudentsT};

use crate::noise::rule::NoiseRule;
use crate::problem::{Problem, Selection};

/// The quantile at which two-sided 95 % intervals end.
pub(crate) const END: f64 = 0.975;
/// The normal law's quantile there.
pub(crate) const Z95: f64 = 1.959_963_984_540_054;

/// How many standard errors an interval reaches to either side: Student's law where the noise is sized by the residuals themselves.
pub(crate) fn reach(problem: &Problem<'_>, selection: &Selection, rule: &NoiseRule) -> f64 {
    let of = |sized: bool| -> usize {
        let mine = (0..problem.channels()).filter(|&c| rule.fixed_sigma[c].is_none() == sized);
        mine.map(|c| problem.count(c)).sum()
    };
    let (sized, fixed) = (of(true) as f64, of(false) as f64);
    if sized == 0.0 {
        return Z95;
    }
    let unknowns = (selection.shared.len() + selection.nuisance.len() * problem.rows.len()) as f64;
    student(sized - unknowns * sized / (sized + fixed))
}

/// The reach of an interval whose noise is sized by so many degrees of freedom.
pub(crate) fn student(freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, freedom.max(1.0)).map_or(Z95, |law| law.inverse_cdf(END))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quantiles of a table; and few runs that differ know their mean less well than many.
    #[test]
    fn few_degrees_of_freedom_reach_further() {
        approx::assert_abs_diff_eq!(student(2.0), 4.3027, epsilon = 1e-3);
        approx::assert_abs_diff_eq!(student(10.0), 2.2281, epsilon = 1e-3);
        approx::assert_abs_diff_eq!(student(1e6), Z95, epsilon = 1e-3);
    }
}
