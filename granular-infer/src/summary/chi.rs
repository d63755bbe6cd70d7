//! A shifted and scaled chi distribution, fitted by maximum likelihood.

use argmin::core::{CostFunction, Error, Executor, State as _};
use argmin::solver::brent::BrentOpt;
use statrs::function::gamma::{digamma, ln_gamma};

use super::SummaryError;

/// Degrees of freedom that are allowed: below 1 the likelihood has no largest value, far above it is that of a Gaussian.
const DEGREES: [f64; 2] = [1.0, 100.0];
/// Shifts that are tried first.
const GRID: usize = 24;
/// To which the best is found between its neighbours, as a part of the range.
const TOLERANCE: f64 = 1e-6;

/// A bound at which a fit ended: the likelihood rises beyond it, and the three numbers are only as good as the bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bound {
    /// One degree of freedom: as many values at the shift as beside it.
    FewestDegrees,
    /// A hundred degrees of freedom: a Gaussian does as well.
    MostDegrees,
    /// The shift is the largest value below 0.
    LeastShift,
    /// The shift is the smallest value.
    MostShift,
}

/// `(r - shift)/scale` follows a chi distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChiFit {
    /// Degrees of freedom df, 1 to 100.
    pub degrees: f64,
    /// Shift b, from minus the largest value to the smallest.
    pub shift: f64,
    /// Scale A.
    pub scale: f64,
    /// Mean log density.
    pub ln_density: f64,
    /// The bound it ended at, if it did.
    pub bound: Option<Bound>,
}

/// Fits a chi distribution to values that are zero or more by maximum likelihood.
///
/// With the shift given, `(r - b)^2` follows a gamma distribution, whose shape solves one equation and whose scale is a mean;
/// so only the shift is searched for, on a grid and then by Brent's method.
///
/// # Errors
/// [`SummaryError::TooFew`] below 20 values, [`SummaryError::NotFinite`], [`SummaryError::NoSpread`] where all are equal.
pub fn fit_chi(values: &[f64]) -> Result<ChiFit, SummaryError> {
    if values.len() < super::LEAST {
        return Err(SummaryError::TooFew { received: values.len(), least: super::LEAST });
    }
    if let Some(point) = values.iter().position(|v| !v.is_finite()) {
        return Err(SummaryError::NotFinite { point });
    }
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let spread = high - low;
    if spread <= 1e-9 * high.abs() {
        return Err(SummaryError::NoSpread { radius_m: high });
    }
    // A value at the shift itself has no logarithm.
    let least = -high.abs();
    let most = low - 1e-6 * spread;
    let shifts = Shifts { values, least, most };
    let (mut best, mut fit) = (0.0, shifts.fit(0.0));
    let step = 1.0 / GRID as f64;
    for k in 1..=GRID {
        let other = shifts.fit(k as f64 * step);
        if other.ln_density > fit.ln_density {
            (best, fit) = (k as f64 * step, other);
        }
    }
    let solver = BrentOpt::new((best - step).max(0.0), (best + step).min(1.0)).set_tolerance(0.0, TOLERANCE);
    let found = Executor::new(shifts, solver).configure(|state| state.max_iters(60)).run();
    if let Some(k) = found.ok().and_then(|f| f.state().get_best_param().copied()) {
        let other = shifts.fit(k);
        if other.ln_density > fit.ln_density {
            fit = other;
        }
    }
    let tolerance = 1e-4 * (most - least);
    let shift = if fit.shift < least + tolerance {
        Some(Bound::LeastShift)
    } else if fit.shift > most - tolerance {
        Some(Bound::MostShift)
    } else {
        None
    };
    fit.bound = fit.bound.or(shift);
    Ok(fit)
}

/// Values whose shift lies between two, 0 and 1.
#[derive(Clone, Copy)]
struct Shifts<'a> {
    values: &'a [f64],
    least: f64,
    most: f64,
}

impl Shifts<'_> {
    /// The best fit at a part of the way from the least shift to the most.
    fn fit(&self, part: f64) -> ChiFit {
        given_shift(self.values, self.least + (self.most - self.least) * part)
    }
}

impl CostFunction for Shifts<'_> {
    type Param = f64;
    type Output = f64;

    fn cost(&self, part: &f64) -> Result<f64, Error> {
        Ok(-self.fit(*part).ln_density)
    }
}

/// The best fit with a shift below all values.
fn given_shift(values: &[f64], shift: f64) -> ChiFit {
    let n = values.len() as f64;
    let square = values.iter().map(|v| (v - shift).powi(2)).sum::<f64>() / n;
    let ln_mean = values.iter().map(|v| (v - shift).ln()).sum::<f64>() / n;
    let wanted = shape(square.ln() - 2.0 * ln_mean);
    let degrees = (2.0 * wanted).clamp(DEGREES[0], DEGREES[1]);
    let bound = if 2.0 * wanted < DEGREES[0] {
        Some(Bound::FewestDegrees)
    } else if 2.0 * wanted > DEGREES[1] {
        Some(Bound::MostDegrees)
    } else {
        None
    };
    let scale = (square / degrees).sqrt();
    let half = 0.5 * degrees;
    let ln_density = (1.0 - half) * std::f64::consts::LN_2 - ln_gamma(half) + (degrees - 1.0) * ln_mean
        - degrees * scale.ln()
        - half;
    ChiFit { degrees, shift, scale, ln_density, bound }
}

/// The gamma distribution's shape a: `ln a - digamma(a) = s`, by Newton steps in 1/a (Minka 2002).
fn shape(s: f64) -> f64 {
    if !(s > 1e-12) {
        return f64::INFINITY;
    }
    let mut a = (3.0 - s + ((s - 3.0).powi(2) + 24.0 * s).sqrt()) / (12.0 * s);
    for _ in 0..20 {
        let left = a.ln() - digamma(a) - s;
        // ln a - digamma(a) falls about as 1/(2 a): its slope from two values.
        let h = 1e-4 * a;
        let slope = ((a + h).ln() - digamma(a + h) - (a - h).ln() + digamma(a - h)) / (2.0 * h);
        let next = (a - left / slope).clamp(0.2 * a, 5.0 * a);
        let done = (next - a).abs() < 1e-10 * a;
        a = next;
        if done {
            break;
        }
    }
    a
}
