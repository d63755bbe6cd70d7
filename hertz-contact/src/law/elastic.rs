//! A rigid body on an elastic half-space, and laws of one parameter more.

use super::{
    InverseError, Law, LawError, Validity, finite, invert, plane_modulus, poisson, polish, positive,
};
use crate::{Number, indenter::Indenter};

/// Hertz's sphere, the flat punch or the cone on an elastic half-space without friction or adhesion.
///
/// `F = c E/(1 - nu^2) delta^n` with [`Indenter::factor`] c and [`Indenter::exponent`] n. Hertz 1882
/// (doi:10.1515/crll.1882.92.156), Sneddon 1965 (doi:10.1016/0020-7225(65)90019-4); [Matl 2021], eqs 6.2 to 6.4, corrected.
/// Small strains: `delta <= 0.1 R` (the parabola that stands for the ball is then 1 % off in force), a cone's angle up to
/// 0.35 rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elastic<T> {
    /// The indenter.
    pub indenter: Indenter,
    /// Young's modulus E in Pa, positive.
    pub modulus_pa: T,
    /// Poisson's ratio, above -1 and up to 0.5.
    pub poisson_ratio: f64,
}

impl<T: Number> Elastic<T> {
    /// The factor of `delta^n`.
    pub(crate) fn coefficient(&self) -> T {
        plane_modulus(self.modulus_pa, self.poisson_ratio) * self.indenter.factor()
    }
}

/// `x^n` for the exponents of indenters: 1, 3/2 and 2.
pub(crate) fn power<T: Number>(x: T, exponent: f64) -> T {
    if exponent == 1.0 {
        x
    } else if exponent == 1.5 {
        x * x.sqrt()
    } else if exponent == 2.0 {
        x * x
    } else {
        x.powf(exponent)
    }
}

/// `n x^(n - 1)`.
pub(crate) fn power_slope<T: Number>(x: T, exponent: f64) -> T {
    if exponent == 1.0 {
        T::from(1.0)
    } else if exponent == 1.5 {
        x.sqrt() * 1.5
    } else if exponent == 2.0 {
        x * 2.0
    } else {
        x.powf(exponent - 1.0) * exponent
    }
}

/// The inverse of `c x^n` with a finite value.
fn power_inverse<T: Number>(force_n: T, coefficient: T, exponent: f64) -> Result<T, InverseError> {
    let force = force_n.re();
    if !force.is_finite() {
        Err(InverseError::NotFinite { force_n: force })
    } else if force < 0.0 {
        Err(InverseError::BelowLowest { force_n: force, lowest_n: 0.0 })
    } else if force == 0.0 {
        Ok(if exponent == 1.0 { force_n / coefficient } else { T::from(0.0) })
    } else {
        let x = (force_n / coefficient).powf(1.0 / exponent);
        if x.re().is_finite() { Ok(x) } else { Err(InverseError::NotReached { force_n: force }) }
    }
}

impl<T: Number> Law<T> for Elastic<T> {
    fn check(&self) -> Result<(), LawError> {
        self.indenter.check()?;
        positive("modulus_pa", self.modulus_pa.re())?;
        poisson(self.poisson_ratio)
    }

    fn force(&self, indentation_m: T) -> T {
        if !(indentation_m.re() > 0.0) {
            return nan_or_zero(indentation_m);
        }
        self.coefficient() * power(indentation_m, self.indenter.exponent())
    }

    fn derivative(&self, indentation_m: T) -> T {
        if !(indentation_m.re() > 0.0) {
            return nan_or_zero(indentation_m);
        }
        self.coefficient() * power_slope(indentation_m, self.indenter.exponent())
    }

    fn validity(&self, indentation_m: f64) -> Validity {
        match self.indenter {
            Indenter::Sphere { radius_m } | Indenter::Cylinder { radius_m } => {
                Validity::of(indentation_m, "delta / R", indentation_m / radius_m, 0.1)
            }
            Indenter::Cone { angle_rad } => Validity::of(indentation_m, "angle_rad", angle_rad, 0.35),
        }
    }

    fn inverse(&self, force_n: T) -> Result<T, InverseError> {
        power_inverse(force_n, self.coefficient(), self.indenter.exponent())
    }
}

/// Zero out of contact; an indentation that is not a number stays one.
pub(crate) fn nan_or_zero<T: Number>(indentation_m: T) -> T {
    T::from(if indentation_m.re().is_nan() { f64::NAN } else { 0.0 })
}

/// The true sphere (not its parabola) on an elastic half-space.
///
/// `delta = a/2 ln((R + a)/(R - a))`, `F = E/(1 - nu^2) [(a^2 + R^2)/2 ln((R + a)/(R - a)) - a R]`, solved for the contact
/// radius a (Sneddon 1965, doi:10.1016/0020-7225(65)90019-4). The geometry holds at any depth, small strains up to
/// `delta = 0.3 R`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SneddonSphere<T> {
    /// Radius in m, positive.
    pub radius_m: f64,
    /// Young's modulus E in Pa, positive.
    pub modulus_pa: T,
    /// Poisson's ratio, above -1 and up to 0.5.
    pub poisson_ratio: f64,
}

impl<T: Number> SneddonSphere<T> {
    /// Contact radius in m at an indentation in m.
    pub fn contact_radius_m(&self, indentation_m: T) -> T {
        if !(indentation_m.re() > 0.0) {
            return nan_or_zero(indentation_m);
        }
        self.angle(indentation_m).tanh() * self.radius_m
    }

    /// y with `y tanh(y) = delta/R`; `a = R tanh(y)`.
    fn angle(&self, indentation_m: T) -> T {
        let d = indentation_m / self.radius_m;
        // tanh(y) lies between y/(1 + y) and y.
        let (low, high) = (d.re().sqrt(), 0.5 * (d.re() + (d.re() * (d.re() + 4.0)).sqrt()));
        let f = |y: f64| (y * y.tanh() - d.re(), y.tanh() + y * (1.0 - y.tanh().powi(2)));
        let y = crate::root::rising(f, low, high, high);
        polish(T::from(y), |y| {
            let t = y.tanh();
            (y * t - d, t + y * (T::from(1.0) - t * t))
        })
    }
}

impl<T: Number> Law<T> for SneddonSphere<T> {
    fn check(&self) -> Result<(), LawError> {
        positive("radius_m", self.radius_m)?;
        positive("modulus_pa", self.modulus_pa.re())?;
        poisson(self.poisson_ratio)
    }

    fn force(&self, indentation_m: T) -> T {
        if !(indentation_m.re() > 0.0) {
            return nan_or_zero(indentation_m);
        }
        let y = self.angle(indentation_m);
        let shape = if y.re() < 0.1 {
            // (1 + tanh^2) y - tanh by its series: the terms up to y cancel.
            const SERIES: [f64; 6] = [
                4.0 / 3.0,
                -12.0 / 15.0,
                136.0 / 315.0,
                -620.0 / 2835.0,
                16584.0 / 155_925.0,
                -305_816.0 / 6_081_075.0,
            ];
            let square = y * y;
            let sum = SERIES.iter().rev().fold(T::from(0.0), |sum, c| sum * square + T::from(*c));
            sum * square * y
        } else {
            let t = y.tanh();
            (t * t + T::from(1.0)) * y - t
        };
        plane_modulus(self.modulus_pa, self.poisson_ratio) * shape * (self.radius_m * self.radius_m)
    }

    fn derivative(&self, indentation_m: T) -> T {
        plane_modulus(self.modulus_pa, self.poisson_ratio) * self.contact_radius_m(indentation_m) * 2.0
    }

    fn validity(&self, indentation_m: f64) -> Validity {
        Validity::of(indentation_m, "delta / R", indentation_m / self.radius_m, 0.3)
    }

    fn inverse(&self, force_n: T) -> Result<T, InverseError> {
        invert(self, force_n, self.radius_m)
    }
}

/// An empirical power law `F = K delta^n`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowerLaw<T> {
    /// K in N/m^n, positive.
    pub coefficient: T,
    /// n, from 0.5 to 4.
    pub exponent: f64,
}

impl<T: Number> Law<T> for PowerLaw<T> {
    fn check(&self) -> Result<(), LawError> {
        positive("coefficient", self.coefficient.re())?;
        if self.exponent >= 0.5 && self.exponent <= 4.0 {
            return Ok(());
        }
        Err(LawError::OutOfRange { name: "exponent", value: self.exponent, low: 0.5, high: 4.0 })
    }

    fn force(&self, indentation_m: T) -> T {
        if !(indentation_m.re() > 0.0) {
            return nan_or_zero(indentation_m);
        }
        self.coefficient * power(indentation_m, self.exponent)
    }

    fn derivative(&self, indentation_m: T) -> T {
        if !(indentation_m.re() > 0.0) {
            return nan_or_zero(indentation_m);
        }
        self.coefficient * power_slope(indentation_m, self.exponent)
    }

    fn validity(&self, indentation_m: f64) -> Validity {
        Validity::of(indentation_m, "delta / R", 0.0, 0.0)
    }

    fn inverse(&self, force_n: T) -> Result<T, InverseError> {
        power_inverse(force_n, self.coefficient, self.exponent)
    }
}

/// A sphere on an incompressible neo-Hookean half-space after Lin et al. 2009 (doi:10.1007/s10237-008-0139-9).
///
/// Tabor's indentation strain `e = 0.2 a/R` with `a = sqrt(R delta)` is put into uniaxial compression:
/// `F = pi a^2 B ((1 - e)^-2 - (1 - e))`, with B chosen so that small indentations give Hertz with nu = 0.5. A rule of
/// thumb, kept by name: it takes the material's stiffening and leaves out the ball's own -0.1 delta/R. `delta <= R`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NeoHookean<T> {
    /// Radius in m, positive.
    pub radius_m: f64,
    /// Young's modulus at small strain in Pa, positive.
    pub modulus_pa: T,
}

impl<T: Number> NeoHookean<T> {
    /// Strain e and the factor of `e`-dependent stress.
    fn parts(&self, indentation_m: T) -> (T, T) {
        let strain = (indentation_m / self.radius_m).sqrt() * 0.2;
        // pi B (3 * 0.2) = 16/9 E.
        (strain, self.modulus_pa * (16.0 / 9.0 / 0.6 * self.radius_m))
    }
}

impl<T: Number> Law<T> for NeoHookean<T> {
    fn check(&self) -> Result<(), LawError> {
        positive("radius_m", self.radius_m)?;
        positive("modulus_pa", self.modulus_pa.re())
    }

    fn force(&self, indentation_m: T) -> T {
        if !(indentation_m.re() > 0.0) {
            return nan_or_zero(indentation_m);
        }
        let (e, b) = self.parts(indentation_m);
        let left = T::from(1.0) - e;
        // (1 - e)^-2 - (1 - e) = e (3 - 3 e + e^2) / (1 - e)^2
        let stress = e * (T::from(3.0) - e * 3.0 + e * e) / (left * left);
        b * indentation_m * stress
    }

    fn derivative(&self, indentation_m: T) -> T {
        if !(indentation_m.re() > 0.0) {
            return nan_or_zero(indentation_m);
        }
        let (e, b) = self.parts(indentation_m);
        let left = T::from(1.0) - e;
        let stress = e * (T::from(3.0) - e * 3.0 + e * e) / (left * left);
        let slope = T::from(2.0) / (left * left * left) + T::from(1.0);
        b * (stress + e * slope * 0.5)
    }

    fn validity(&self, indentation_m: f64) -> Validity {
        Validity::of(indentation_m, "delta / R", indentation_m / self.radius_m, 1.0)
    }

    fn inverse(&self, force_n: T) -> Result<T, InverseError> {
        finite("force_n", force_n.re()).map_err(|_| InverseError::NotFinite { force_n: force_n.re() })?;
        // The stress is infinite at e = 1, delta = 25 R.
        let top = 25.0 * self.radius_m * (1.0 - 1e-9);
        if force_n.re() < 0.0 {
            return Err(InverseError::BelowLowest { force_n: force_n.re(), lowest_n: 0.0 });
        }
        if !(force_n.re() <= self.force(T::from(top)).re()) {
            return Err(InverseError::NotReached { force_n: force_n.re() });
        }
        let at = |x: f64| {
            let x = T::from(x);
            (self.force(x).re() - force_n.re(), self.derivative(x).re())
        };
        let root = crate::root::rising(at, 0.0, top, 0.1 * self.radius_m);
        Ok(polish(T::from(root), |x| (self.force(x) - force_n, self.derivative(x))))
    }
}
