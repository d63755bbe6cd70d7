//! A layer of finite thickness on a rigid base.

mod solve;

use std::f64::consts::PI;

use super::elastic::{Elastic, nan_or_zero, power, power_slope};
use super::{InverseError, Law, LawError, Validity, invert, poisson, zero_or_more};
use crate::number::first_order;
use crate::{Number, indenter::Indenter};

/// How the layer rests on its base.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Base {
    /// Glued: it cannot slide.
    Bonded,
    /// It slides without friction, and is not lifted.
    Free,
}

/// Number of Chebyshev coefficients.
const TERMS: usize = 17;
/// Largest contact radius over thickness that is solved for.
const WIDEST: f64 = 4.0;

/// By what factor a layer is stiffer than a half-space: `F = F_half-space * C(chi)`.
///
/// `chi` is [`Indenter::reach_m`] over the thickness: `sqrt(R delta)/H` for a sphere, `R/H` for a cylinder,
/// `delta/(H tan(angle))` for a cone. The contact problem of linear elasticity is solved once, for this indenter's shape and
/// Poisson's ratio (0.3 ms), and kept as a Chebyshev series of `ln C` that is right to 1e-5. It ends where the contact
/// radius is 4 thicknesses; beyond, `C` goes on as the power of chi that it has there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layer {
    /// Coefficients of `ln C` over `2 v/v_end - 1`, `v = chi/(1 + chi)`, and of its derivative with respect to v.
    value: [f64; TERMS],
    slope: [f64; TERMS],
    v_end: f64,
    chi_end: f64,
    /// `ln C` at the end and its slope over `ln chi`.
    end: (f64, f64),
}

impl Indenter {
    /// Length in m that a layer's thickness is compared with: `sqrt(R delta)` for a sphere, `R` for a cylinder,
    /// `delta/tan(angle)` for a cone.
    pub fn reach_m<T: Number>(&self, indentation_m: T) -> T {
        match *self {
            Self::Sphere { radius_m } if indentation_m.re() > 0.0 => (indentation_m * radius_m).sqrt(),
            Self::Sphere { .. } => nan_or_zero(indentation_m),
            Self::Cylinder { radius_m } => T::from(radius_m),
            Self::Cone { angle_rad } => indentation_m / angle_rad.tan(),
        }
    }

    /// The exponent of `delta` in [`Indenter::reach_m`].
    pub(crate) fn reach_exponent(&self) -> f64 {
        match self {
            Self::Sphere { .. } => 0.5,
            Self::Cylinder { .. } => 0.0,
            Self::Cone { .. } => 1.0,
        }
    }
}

/// Chebyshev points on [-1, 1].
fn point(i: usize) -> f64 {
    (PI * (i as f64 + 0.5) / TERMS as f64).cos()
}

/// Coefficients of the series through values at the Chebyshev points.
fn coefficients(values: &[f64; TERMS]) -> [f64; TERMS] {
    std::array::from_fn(|k| {
        let sum: f64 = values
            .iter()
            .enumerate()
            .map(|(i, v)| v * (PI * k as f64 * (i as f64 + 0.5) / TERMS as f64).cos())
            .sum();
        sum * if k == 0 { 1.0 } else { 2.0 } / TERMS as f64
    })
}

/// Coefficients of the derivative.
fn differentiated(c: &[f64; TERMS]) -> [f64; TERMS] {
    let mut d = [0.0; TERMS];
    for k in (0..TERMS - 1).rev() {
        let beyond = if k + 2 < TERMS { d[k + 2] } else { 0.0 };
        d[k] = beyond + 2.0 * (k as f64 + 1.0) * c[k + 1];
    }
    d[0] *= 0.5;
    d
}

/// Clenshaw's sum.
fn sum<T: Number>(c: &[f64; TERMS], x: T) -> T {
    let (mut b, mut before) = (T::from(0.0), T::from(0.0));
    for c in c[1..].iter().rev() {
        (b, before) = (x * b * 2.0 - before + T::from(*c), b);
    }
    x * b - before + T::from(c[0])
}

impl Layer {
    /// A layer under an indenter of this shape (its size does not matter).
    ///
    /// # Errors
    /// [`LawError`] of the indenter or of Poisson's ratio (above -1, up to 0.5).
    pub fn new(indenter: &Indenter, poisson_ratio: f64, base: Base) -> Result<Self, LawError> {
        indenter.check()?;
        poisson(poisson_ratio)?;
        let failed =
            LawError::OutOfRange { name: "poisson_ratio", value: poisson_ratio, low: -1.0, high: 0.5 };
        let solver = solve::Solver::new(poisson_ratio, base);
        // chi and ln C as series in the contact radius, then ln C as a series in v.
        let (mut chi, mut log) = ([0.0; TERMS], [0.0; TERMS]);
        for i in 0..TERMS {
            let radius = WIDEST * 0.5 * (1.0 + point(i));
            let pressed = solver.at(indenter, radius).ok_or(failed)?;
            if !(pressed.chi > 0.0 && pressed.factor > 0.0) {
                return Err(failed);
            }
            // chi/radius is smooth and does not vanish.
            chi[i] = pressed.chi / radius;
            log[i] = pressed.factor.ln();
        }
        let (chi, log) = (coefficients(&chi), coefficients(&log));
        let chi_at = |x: f64| 0.5 * WIDEST * (1.0 + x) * sum(&chi, x);
        let chi_end = chi_at(1.0);
        let v_end = chi_end / (1.0 + chi_end);
        let chi_slope = differentiated(&chi);
        let mut value = [0.0; TERMS];
        for (i, value) in value.iter_mut().enumerate() {
            let v = v_end * 0.5 * (1.0 + point(i));
            let target = v / (1.0 - v);
            let f = |x: f64| {
                let slope = 0.5 * WIDEST * (sum(&chi, x) + (1.0 + x) * sum(&chi_slope, x));
                (chi_at(x) - target, slope)
            };
            *value = sum(&log, crate::root::rising(f, -1.0, 1.0, 2.0 * target / chi_end - 1.0));
        }
        let mut value = coefficients(&value);
        // C is 1 at chi = 0.
        value[0] -= sum(&value, -1.0);
        let slope = differentiated(&value).map(|d| 2.0 * d / v_end);
        // d ln C/d ln chi = dlnC/dv chi/(1 + chi)^2.
        let end = (sum(&value, 1.0), sum(&slope, 1.0) * chi_end / (1.0 + chi_end).powi(2));
        Ok(Self { value, slope, v_end, chi_end, end })
    }

    /// Largest chi of the series; beyond, the factor is extrapolated.
    pub fn chi_end(&self) -> f64 {
        self.chi_end
    }

    /// The factor C at chi, and its logarithmic slope `d ln C/d ln chi`. Below zero chi counts as zero.
    pub fn factor<T: Number>(&self, chi: T) -> (T, T) {
        if !(chi.re() <= self.chi_end) {
            let log = (chi / self.chi_end).ln() * self.end.1 + T::from(self.end.0);
            return (log.exp(), T::from(self.end.1));
        }
        let chi = if chi.re() < 0.0 { T::from(0.0) } else { chi };
        let one = chi + T::from(1.0);
        let x = chi / one * (2.0 / self.v_end) - T::from(1.0);
        // The slope is that over v = (1 + x)/2 v_end.
        let log = first_order(x, |x| (sum(&self.value, x), 0.5 * self.v_end * sum(&self.slope, x)))
            .unwrap_or_else(|| sum(&self.value, x));
        (log.exp(), sum(&self.slope, x) * chi / (one * one))
    }
}

/// An [`Elastic`] contact on a layer, which counts as stiffer the thinner it is.
///
/// `F = C(chi) F_half-space`, see [`Layer`]. Holds as far as the half-space's law does, for `delta` below a tenth of the
/// thickness and up to [`Layer::chi_end`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layered<T> {
    /// The contact on a half-space.
    pub elastic: Elastic<T>,
    /// The layer's factor, for the same shape and Poisson's ratio.
    pub layer: Layer,
    /// One over the thickness in 1/m, zero or more; zero is a half-space.
    pub inverse_thickness_per_m: T,
}

impl<T: Number> Law<T> for Layered<T> {
    fn check(&self) -> Result<(), LawError> {
        self.elastic.check()?;
        zero_or_more("inverse_thickness_per_m", self.inverse_thickness_per_m.re())
    }

    fn force(&self, indentation_m: T) -> T {
        self.both(indentation_m).0
    }

    fn derivative(&self, indentation_m: T) -> T {
        self.both(indentation_m).1
    }

    fn both(&self, indentation_m: T) -> (T, T) {
        if !(indentation_m.re() > 0.0) {
            return (nan_or_zero(indentation_m), nan_or_zero(indentation_m));
        }
        let chi = self.elastic.indenter.reach_m(indentation_m) * self.inverse_thickness_per_m;
        let (factor, slope) = self.layer.factor(chi);
        let n = slope * self.elastic.indenter.reach_exponent() + T::from(self.elastic.indenter.exponent());
        // F = c delta^n C: dF/d(delta) = F/delta (n + dlnC/dln(delta)).
        let force = self.elastic.force(indentation_m) * factor;
        (force, force / indentation_m * n)
    }

    fn validity(&self, indentation_m: f64) -> Validity {
        let per_m = self.inverse_thickness_per_m.re();
        let chi = self.elastic.indenter.reach_m(indentation_m) * per_m;
        Law::<T>::validity(&self.elastic, indentation_m)
            .and(Validity::of(indentation_m, "delta / thickness", indentation_m * per_m, 0.1))
            .and(Validity::of(indentation_m, "chi", chi, self.layer.chi_end()))
    }

    fn inverse(&self, force_n: T) -> Result<T, InverseError> {
        let guess = self.elastic.inverse(force_n).map_or(1e-3, |x| x.re());
        invert(self, force_n, guess)
    }
}

/// The polynomial of Dimitriadis et al. 2002 (doi:10.1016/S0006-3495(02)75620-8) for a sphere on a layer, kept by name.
///
/// Their formula for any Poisson's ratio; for a bonded layer with `nu = 0.5` its last coefficient is -0.0975.
///
/// With `chi = sqrt(R delta)/H`: bonded, `nu = 0.5`, the force is 3 % low at `chi = 0.3`, 8 % at 0.5 and 15 % at
/// 0.75; [`Layered`] has no such error. On a base without friction the factor does not depend on Poisson's ratio
/// at all; theirs meets it near `nu = 0.3`, and its first-order term is 19 % too large at 0.5.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dimitriadis<T> {
    /// Radius in m, positive.
    pub radius_m: f64,
    /// Young's modulus E in Pa, positive.
    pub modulus_pa: T,
    /// Poisson's ratio, above -1 and up to 0.5.
    pub poisson_ratio: f64,
    /// How the layer rests on its base.
    pub base: Base,
    /// One over the thickness in 1/m, zero or more.
    pub inverse_thickness_per_m: T,
}

impl<T: Number> Dimitriadis<T> {
    fn elastic(&self) -> Elastic<T> {
        Elastic {
            indenter: Indenter::Sphere { radius_m: self.radius_m },
            modulus_pa: self.modulus_pa,
            poisson_ratio: self.poisson_ratio,
        }
    }

    /// Coefficients of chi^1 to chi^4.
    fn polynomial(&self) -> [f64; 4] {
        let nu = self.poisson_ratio;
        let (alpha, beta) = match self.base {
            Base::Bonded => (
                -(1.2876 - 1.4678 * nu + 1.3442 * nu * nu) / (1.0 - nu),
                (0.6387 - 1.0277 * nu + 1.5164 * nu * nu) / (1.0 - nu),
            ),
            Base::Free => (-0.347 * (3.0 - 2.0 * nu) / (1.0 - nu), 0.056 * (5.0 - 2.0 * nu) / (1.0 - nu)),
        };
        let (square, cube) = (alpha * alpha, alpha * alpha * alpha);
        [
            -2.0 * alpha / PI,
            4.0 * square / PI.powi(2),
            -8.0 / PI.powi(3) * (cube + 4.0 * PI.powi(2) / 15.0 * beta),
            16.0 * alpha / PI.powi(4) * (cube + 3.0 * PI.powi(2) / 5.0 * beta),
        ]
    }
}

impl<T: Number> Law<T> for Dimitriadis<T> {
    fn check(&self) -> Result<(), LawError> {
        self.elastic().check()?;
        zero_or_more("inverse_thickness_per_m", self.inverse_thickness_per_m.re())
    }

    fn force(&self, indentation_m: T) -> T {
        if !(indentation_m.re() > 0.0) {
            return nan_or_zero(indentation_m);
        }
        let chi = (indentation_m * self.radius_m).sqrt() * self.inverse_thickness_per_m;
        let factor = self.polynomial().iter().rev().fold(T::from(0.0), |sum, c| (sum + T::from(*c)) * chi);
        self.elastic().coefficient() * power(indentation_m, 1.5) * (factor + T::from(1.0))
    }

    fn derivative(&self, indentation_m: T) -> T {
        if !(indentation_m.re() > 0.0) {
            return nan_or_zero(indentation_m);
        }
        let chi = (indentation_m * self.radius_m).sqrt() * self.inverse_thickness_per_m;
        // delta^(3/2) chi^k has the slope (3 + k)/2 delta^(1/2) chi^k.
        let factor = self
            .polynomial()
            .iter()
            .enumerate()
            .rev()
            .fold(T::from(0.0), |sum, (k, c)| (sum + T::from(c * (1.0 + (k as f64 + 1.0) / 3.0))) * chi);
        self.elastic().coefficient() * power_slope(indentation_m, 1.5) * (factor + T::from(1.0))
    }

    fn validity(&self, indentation_m: f64) -> Validity {
        let per_m = self.inverse_thickness_per_m.re();
        let chi = (indentation_m.max(0.0) * self.radius_m).sqrt() * per_m;
        self.elastic()
            .validity(indentation_m)
            .and(Validity::of(indentation_m, "delta / thickness", indentation_m * per_m, 0.1))
            .and(Validity::of(indentation_m, "chi", chi, 0.2))
    }

    fn inverse(&self, force_n: T) -> Result<T, InverseError> {
        invert(self, force_n, 1e-3)
    }
}
