//! What is added to a contact or wrapped around it.

use super::elastic::nan_or_zero;
use super::{InverseError, Law, LawError, Validity, finite, invert, polish, positive, zero_or_more};
use crate::Number;

/// A membrane under the indenter: `F = T delta + K delta^3` for `delta > 0`.
///
/// The linear term is pre-tension, the cubic one stretching. A membrane is not a half-space: the law is empirical, and its
/// two factors depend on the membrane's span and on the indenter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Membrane<T> {
    /// T in N/m, zero or more.
    pub tension_n_m: T,
    /// K in N/m^3, zero or more.
    pub stretching_n_m3: T,
}

impl<T: Number> Law<T> for Membrane<T> {
    fn check(&self) -> Result<(), LawError> {
        zero_or_more("tension_n_m", self.tension_n_m.re())?;
        zero_or_more("stretching_n_m3", self.stretching_n_m3.re())
    }

    fn force(&self, indentation_m: T) -> T {
        if !(indentation_m.re() > 0.0) {
            return nan_or_zero(indentation_m);
        }
        let d = indentation_m;
        d * (self.tension_n_m + self.stretching_n_m3 * d * d)
    }

    fn derivative(&self, indentation_m: T) -> T {
        if !(indentation_m.re() > 0.0) {
            return nan_or_zero(indentation_m);
        }
        self.tension_n_m + self.stretching_n_m3 * indentation_m * indentation_m * 3.0
    }

    fn validity(&self, indentation_m: f64) -> Validity {
        Validity::of(indentation_m, "delta / span", 0.0, 0.0)
    }
}

/// A second contact that starts at a depth: `F = k (delta - depth)` beyond it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rim<T> {
    /// Depth in m at which the rim touches, zero or more.
    pub depth_m: T,
    /// Stiffness in N/m, zero or more.
    pub stiffness_n_m: T,
}

impl<T: Number> Law<T> for Rim<T> {
    fn check(&self) -> Result<(), LawError> {
        zero_or_more("depth_m", self.depth_m.re())?;
        zero_or_more("stiffness_n_m", self.stiffness_n_m.re())
    }

    fn force(&self, indentation_m: T) -> T {
        let beyond = indentation_m - self.depth_m;
        if beyond.re() > 0.0 { self.stiffness_n_m * beyond } else { nan_or_zero(indentation_m) }
    }

    fn derivative(&self, indentation_m: T) -> T {
        if indentation_m.re() > self.depth_m.re() { self.stiffness_n_m } else { nan_or_zero(indentation_m) }
    }

    fn validity(&self, indentation_m: f64) -> Validity {
        Validity::of(indentation_m - self.depth_m.re(), "delta / depth", 0.0, 0.0)
    }

    fn rises_from_m(&self) -> f64 {
        self.depth_m.re()
    }
}

/// A law times `1 + c delta/R`: strains that stiffen (c > 0) or soften what is pressed.
///
/// A first-order correction of any law; under a sphere, c is -0.1 for the true ball in linear elasticity. It means something
/// while `|c| delta/R <= 0.5`; the factor does not go below 2/3, since further down the force would fall with depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stiffened<T, L> {
    /// The law without stiffening.
    pub law: L,
    /// c, without unit.
    pub coefficient: T,
    /// R in m, positive.
    pub radius_m: f64,
}

impl<T: Number, L> Stiffened<T, L> {
    /// The factor and its slope in 1/m.
    fn factor(&self, indentation_m: T) -> (T, T) {
        stiffening(self.coefficient, self.radius_m, indentation_m)
    }
}

/// `1 + c delta/R`, kept above 2/3, and its slope; `delta (1 + c delta/R)` rises as long as the factor is above 1/2.
pub(super) fn stiffening<T: Number>(coefficient: T, radius_m: f64, indentation_m: T) -> (T, T) {
    let (one, zero) = (T::from(1.0), T::from(0.0));
    if !(indentation_m.re() > 0.0) {
        return (one, zero);
    }
    let slope = coefficient / radius_m;
    let factor = one + slope * indentation_m;
    if factor.re() < 2.0 / 3.0 { (T::from(2.0 / 3.0), zero) } else { (factor, slope) }
}

impl<T: Number, L: Law<T>> Law<T> for Stiffened<T, L> {
    fn check(&self) -> Result<(), LawError> {
        self.law.check()?;
        finite("coefficient", self.coefficient.re())?;
        positive("radius_m", self.radius_m)
    }

    fn force(&self, indentation_m: T) -> T {
        self.law.force(indentation_m) * self.factor(indentation_m).0
    }

    fn derivative(&self, indentation_m: T) -> T {
        let (factor, slope) = self.factor(indentation_m);
        self.law.derivative(indentation_m) * factor + self.law.force(indentation_m) * slope
    }

    fn validity(&self, indentation_m: f64) -> Validity {
        let change = self.coefficient.re().abs() * indentation_m / self.radius_m;
        let this = Validity::of(indentation_m, "|c| delta / R", change, 0.5);
        match self.law.validity(indentation_m) {
            // Adhesion holds a contact below delta = 0, where nothing is stiffened.
            Validity::Holds if indentation_m <= 0.0 => Validity::Holds,
            inner => inner.and(this),
        }
    }

    fn rises_from_m(&self) -> f64 {
        self.law.rises_from_m()
    }
}

/// A law seen through a load cell that gives: the measured indentation is `delta + C F(delta)`.
///
/// Solved for delta, which rises with what is measured as long as the force rises with delta.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compliant<T, L> {
    /// The law over the true indentation.
    pub law: L,
    /// C in m/N, zero or more.
    pub compliance_m_n: T,
}

impl<T: Number, L: Law<T>> Compliant<T, L> {
    /// True indentation in m at a measured one.
    ///
    /// Where adhesion holds the bodies, the spring of the load cell lets go before they would; from there on nothing
    /// touches and the two are the same.
    pub fn true_indentation_m(&self, measured_m: T) -> T {
        self.root_m(measured_m.re()).map_or(measured_m, |root| self.polished_m(root, measured_m))
    }

    /// The true indentation as a real number; none where nothing touches.
    pub(super) fn root_m(&self, m: f64) -> Option<f64> {
        let c = self.compliance_m_n.re();
        if !m.is_finite() {
            return None;
        }
        let at = |x: f64| {
            let (force, slope) = self.law.both(T::from(x));
            (x + c * force.re() - m, 1.0 + c * slope.re())
        };
        let lowest = self.law.rises_from_m();
        if c == 0.0 {
            Some(m)
        } else if m > 0.0 && lowest >= 0.0 {
            Some(crate::root::rising(at, 0.0, m, m))
        } else {
            stuck(&at, lowest, m)
        }
    }

    /// The true indentation with its derivatives, from a real one.
    pub(super) fn polished_m(&self, root: f64, measured_m: T) -> T {
        polish(T::from(root), |x| {
            let (force, slope) = self.law.both(x);
            (x + self.compliance_m_n * force - measured_m, self.compliance_m_n * slope + T::from(1.0))
        })
    }

    /// Force and stiffness over the measured indentation, at a true one.
    pub(super) fn both_at(&self, true_m: T) -> (T, T) {
        let (force, slope) = self.law.both(true_m);
        (force, slope / (self.compliance_m_n * slope + T::from(1.0)))
    }
}

/// The root of `x + C F(x) - m` where F has a minimum at `low`: from the right, since what is left of the root that is
/// found first is another branch. None where the spring has let go.
fn stuck(at: &impl Fn(f64) -> (f64, f64), low: f64, m: f64) -> Option<f64> {
    if low >= 0.0 {
        // No adhesion and nothing pressed.
        return None;
    }
    if at(low).0 <= 0.0 {
        let mut high = m.max(0.0) - low;
        while at(high).0 < 0.0 {
            high *= 4.0;
            if !high.is_finite() {
                return None;
            }
        }
        return Some(crate::root::rising(at, low, high, m.clamp(low, high)));
    }
    let mut x = low;
    for _ in 0..100 {
        let (value, slope) = at(x);
        let step = value / slope;
        if !(slope > 0.0) || !step.is_finite() {
            return None;
        }
        // The force is convex there: Newton from the right does not pass the root.
        x -= step;
        if step.abs() <= 1e-15 * low.abs() {
            return Some(x);
        }
    }
    None
}

impl<T: Number, L: Law<T>> Law<T> for Compliant<T, L> {
    fn check(&self) -> Result<(), LawError> {
        self.law.check()?;
        zero_or_more("compliance_m_n", self.compliance_m_n.re())
    }

    fn force(&self, indentation_m: T) -> T {
        self.law.force(self.true_indentation_m(indentation_m))
    }

    fn derivative(&self, indentation_m: T) -> T {
        self.both(indentation_m).1
    }

    fn both(&self, indentation_m: T) -> (T, T) {
        self.both_at(self.true_indentation_m(indentation_m))
    }

    fn validity(&self, indentation_m: f64) -> Validity {
        self.law.validity(self.true_indentation_m(T::from(indentation_m)).re())
    }

    fn rises_from_m(&self) -> f64 {
        let low = self.law.rises_from_m();
        low + self.compliance_m_n.re() * self.law.force(T::from(low)).re()
    }

    fn inverse(&self, force_n: T) -> Result<T, InverseError> {
        let true_m = invert(&self.law, force_n, 1e-3)?;
        Ok(true_m + self.compliance_m_n * force_n)
    }
}
