//! A chance constraint on the length (Charnes and Cooper 1959, doi:10.1287/mnsc.6.1.73): no roll shortens a dough, so that a plan leaves room for
//! what a roll may do beyond its prediction, and the more it is to do, the more it may.

use statrs::distribution::{ContinuousCDF, Normal};

use crate::predictor::{PlanError, Predictor};
use crate::roll::Roll;

/// Fewest rolls from which a variance and its growth are estimated.
pub const LEAST_ROLLS: usize = 10;
/// Smallest variance of a length, m^2: a micrometre's.
const LEAST_VARIANCE_M2: f64 = 1e-12;
/// Rounds of scoring at most.
const ROUNDS: usize = 100;

/// The variance of a roll's lengthening, `base^2 + (growth change)^2`: a part that every roll has (cameras, the dough's hidden state) and
/// one that grows with the predicted change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VarianceGrowth {
    /// Sigma of a roll that is predicted to change nothing, m; at least 0.
    pub base_m: f64,
    /// Sigma of a large change, as a part of it; at least 0.
    pub growth: f64,
}

/// Why no variance was estimated.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum GrowthError {
    /// Too few rolls.
    #[error("{rolls} rolls: at least {least} are needed for a variance that grows")]
    TooFew {
        /// Rolls that came.
        rolls: usize,
        /// Rolls needed.
        least: usize,
    },
    /// A change that is no number.
    #[error("roll {number}: predicted {predicted_m} m, observed {observed_m} m; expected finite numbers")]
    NotFinite {
        /// Its number, from 0.
        number: usize,
        /// Predicted change, m.
        predicted_m: f64,
        /// Observed change, m.
        observed_m: f64,
    },
    /// All predictions are alike.
    #[error(
        "all rolls are predicted to lengthen by {predicted_m} m: the growth of a variance shows only where predictions differ"
    )]
    Constant {
        /// The change that all have, m.
        predicted_m: f64,
    },
}

impl VarianceGrowth {
    /// The most likely variance of normal residuals, by Fisher scoring (Davidian and Carroll 1987, doi:10.1080/01621459.1987.10478543),
    /// from the predicted and the observed lengthening (m) of rolls that the predictions were not learned from.
    ///
    /// # Errors
    /// [`GrowthError`].
    pub fn fit(changes_m: &[[f64; 2]]) -> Result<Self, GrowthError> {
        let rolls = changes_m.len();
        if let Some(number) = changes_m.iter().position(|c| !c.iter().all(|v| v.is_finite())) {
            let [predicted_m, observed_m] = changes_m[number];
            return Err(GrowthError::NotFinite { number, predicted_m, observed_m });
        }
        if rolls < LEAST_ROLLS {
            return Err(GrowthError::TooFew { rolls, least: LEAST_ROLLS });
        }
        // Squares of the predicted change and of the residual.
        let squares: Vec<[f64; 2]> = changes_m.iter().map(|[p, o]| [p * p, (o - p).powi(2)]).collect();
        let [least, most] =
            squares.iter().fold([f64::INFINITY, 0.0], |[l, h]: [f64; 2], s| [l.min(s[0]), h.max(s[0])]);
        if !(most - least > 1e-9 * most) {
            return Err(GrowthError::Constant { predicted_m: changes_m[0][0] });
        }
        let mean = squares.iter().map(|s| s[1]).sum::<f64>() / rolls as f64;
        let (mut base, mut growth) = (mean.max(LEAST_VARIANCE_M2), 0.0);
        for _ in 0..ROUNDS {
            let (b, g) = scored(&squares, base, growth);
            let settled = (b - base).abs() <= 1e-9 * base && (g - growth).abs() <= 1e-9 * g.max(1e-9);
            (base, growth) = (b, g);
            if settled {
                break;
            }
        }
        Ok(Self { base_m: base.sqrt(), growth: growth.sqrt() })
    }

    /// The variance of what some dynamics leave of rolls that they were not learned from.
    ///
    /// # Errors
    /// [`GrowthError`].
    pub fn of(dynamics: &dyn Predictor, unseen: &[Roll]) -> Result<Self, GrowthError> {
        let changes: Vec<[f64; 2]> = unseen.iter().map(|r| changes_m(dynamics, r)).collect();
        Self::fit(&changes)
    }

    /// Sigma (m) of a lengthening that is predicted (m).
    pub fn sigma_m(&self, change_m: f64) -> f64 {
        self.base_m.hypot(self.growth * change_m)
    }

    fn check(&self) -> Result<(), PlanError> {
        for (name, value) in [("base_m", self.base_m), ("growth", self.growth)] {
            PlanError::setting(name, value, value >= 0.0 && value.is_finite(), "at least 0, finite")?;
        }
        Ok(())
    }
}

/// Predicted and observed lengthening of a roll, m.
pub fn changes_m(dynamics: &dyn Predictor, roll: &Roll) -> [f64; 2] {
    let predicted = dynamics.next(&roll.state, &roll.action)[0];
    [predicted - roll.state[0], roll.next[0] - roll.state[0]]
}

/// One round: squared residuals regressed on squared changes, weighted by the variances so far; none below 0.
fn scored(squares: &[[f64; 2]], base: f64, growth: f64) -> (f64, f64) {
    let mut sums = [0.0; 5];
    for [change, residual] in squares {
        let weight = (base + growth * change).powi(-2);
        for (sum, term) in sums.iter_mut().zip([1.0, *change, change * change, *residual, change * residual])
        {
            *sum += weight * term;
        }
    }
    let [one, change, change_squared, residual, product] = sums;
    let determinant = one * change_squared - change * change;
    let base = (change_squared * residual - change * product) / determinant;
    let growth = (one * product - change * residual) / determinant;
    let (base, growth) = match (base > 0.0, growth > 0.0) {
        (true, true) => (base, growth),
        (_, false) => (residual / one, 0.0),
        (false, true) => (0.0, product / change_squared),
    };
    (base.max(LEAST_VARIANCE_M2), growth)
}

/// What length may be planned for: the goal's longest is exceeded with a chance of no more than `risk` at each roll.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chance {
    growth: VarianceGrowth,
    risk: f64,
    /// Sigmas that leave this risk above them.
    sigmas: f64,
}

impl Chance {
    /// A constraint; `risk` in (0, 0.5].
    ///
    /// # Errors
    /// [`PlanError::Setting`].
    pub fn new(growth: VarianceGrowth, risk: f64) -> Result<Self, PlanError> {
        growth.check()?;
        PlanError::setting("risk", risk, risk > 0.0 && risk <= 0.5, "above 0, at most 0.5")?;
        Ok(Self { growth, risk, sigmas: -Normal::standard().inverse_cdf(risk) })
    }

    /// The variance that it counts with.
    pub fn growth(&self) -> VarianceGrowth {
        self.growth
    }

    /// The chance that is taken at each roll.
    pub fn risk(&self) -> f64 {
        self.risk
    }

    /// By how much (m) a roll from a length to a predicted one breaks the constraint that it is to end no longer than a third length; 0 where
    /// it keeps it.
    pub fn excess_m(&self, from_m: f64, to_m: f64, longest_m: f64) -> f64 {
        (to_m + self.sigmas * self.growth.sigma_m(to_m - from_m) - longest_m).max(0.0)
    }
}
