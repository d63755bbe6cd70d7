//! The whole contact: everything that may act at once.

use super::adhesion::Jkr;
use super::elastic::Elastic;
use super::extra::{Compliant, Membrane, Rim, stiffening};
use super::layer::{Layer, Layered};
use super::{InverseError, Law, LawError, Validity, finite, invert, zero_or_more};
use crate::{Number, indenter::Indenter};

/// A contact with all its effects, each off at zero: what a measured curve is explained with.
///
/// `F(delta) = s(delta) [C(chi) F_Hertz + F_JKR - F_Hertz] + T delta + K delta^3 + k (delta - d_rim)_+` with
/// `s = 1 + c delta/R`, at the true indentation delta that the load cell's compliance leaves of the measured one. Adhesion on
/// a layer is taken as that on a half-space, which is right to first order in w. The membrane acts from `delta = 0` on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Indentation<T> {
    /// The indenter.
    pub indenter: Indenter,
    /// Poisson's ratio, above -1 and up to 0.5.
    pub poisson_ratio: f64,
    /// Young's modulus E in Pa, positive.
    pub modulus_pa: T,
    /// The layer's factor; none for a half-space.
    pub layer: Option<Layer>,
    /// One over the thickness in 1/m, zero or more.
    pub inverse_thickness_per_m: T,
    /// Work of adhesion w in J/m^2, zero or more (JKR, spheres only).
    pub work_of_adhesion_j_m2: T,
    /// Strain stiffening c, without unit (spheres and cylinders only).
    pub stiffening: T,
    /// Tension of a membrane in N/m, zero or more.
    pub tension_n_m: T,
    /// Stretching of a membrane in N/m^3, zero or more.
    pub stretching_n_m3: T,
    /// Depth in m at which a rim touches, zero or more.
    pub rim_depth_m: T,
    /// Stiffness of the rim in N/m, zero or more.
    pub rim_stiffness_n_m: T,
    /// Compliance of the load cell in m/N, zero or more.
    pub compliance_m_n: T,
}

impl<T: Number> Indentation<T> {
    /// The bare contact on a half-space.
    pub fn elastic(indenter: Indenter, modulus_pa: T, poisson_ratio: f64) -> Self {
        let zero = T::from(0.0);
        Self {
            indenter,
            poisson_ratio,
            modulus_pa,
            layer: None,
            inverse_thickness_per_m: zero,
            work_of_adhesion_j_m2: zero,
            stiffening: zero,
            tension_n_m: zero,
            stretching_n_m3: zero,
            rim_depth_m: zero,
            rim_stiffness_n_m: zero,
            compliance_m_n: zero,
        }
    }

    fn sample(&self) -> Sample<'_, T> {
        Sample(self)
    }

    fn cell(&self) -> Compliant<T, Sample<'_, T>> {
        Compliant { law: self.sample(), compliance_m_n: self.compliance_m_n }
    }

    /// A rigid load cell that no parameter softens, which needs no solution.
    fn rigid(&self) -> bool {
        T::NDERIV == 0 && self.compliance_m_n.re() == 0.0
    }

    /// True indentation in m at a measured one.
    pub fn true_indentation_m(&self, measured_m: T) -> T {
        if self.rigid() { measured_m } else { self.cell().true_indentation_m(measured_m) }
    }
}

/// What is pressed, without the load cell.
struct Sample<'a, T>(&'a Indentation<T>);

impl<T: Number> Sample<'_, T> {
    fn half_space(&self) -> Elastic<T> {
        let i = self.0;
        Elastic { indenter: i.indenter, modulus_pa: i.modulus_pa, poisson_ratio: i.poisson_ratio }
    }

    fn adhesive(&self) -> Option<Jkr<T>> {
        let i = self.0;
        let sticks = i.work_of_adhesion_j_m2.re() > 0.0 || T::NDERIV > 0;
        match i.indenter {
            Indenter::Sphere { radius_m } if sticks => Some(Jkr {
                radius_m,
                modulus_pa: i.modulus_pa,
                poisson_ratio: i.poisson_ratio,
                work_of_adhesion_j_m2: i.work_of_adhesion_j_m2,
            }),
            _ => None,
        }
    }

    fn layered(&self) -> Option<Layered<T>> {
        let i = self.0;
        i.layer.map(|layer| Layered {
            elastic: self.half_space(),
            layer,
            inverse_thickness_per_m: i.inverse_thickness_per_m,
        })
    }

    fn membrane(&self) -> Membrane<T> {
        Membrane { tension_n_m: self.0.tension_n_m, stretching_n_m3: self.0.stretching_n_m3 }
    }

    fn rim(&self) -> Rim<T> {
        Rim { depth_m: self.0.rim_depth_m, stiffness_n_m: self.0.rim_stiffness_n_m }
    }

    /// Stiffness's factor and slope; a cone has no length to compare the depth with.
    fn stiffening(&self, indentation_m: T) -> (T, T) {
        match self.0.indenter.radius_m() {
            Some(radius_m) => stiffening(self.0.stiffening, radius_m, indentation_m),
            None => (T::from(1.0), T::from(0.0)),
        }
    }

    /// Force and stiffness of the bulk: the layer, plus what adhesion changes on a half-space.
    fn bulk(&self, d: T) -> (T, T) {
        let half = self.half_space();
        match (self.layered(), self.adhesive()) {
            (None, None) => half.both(d),
            (Some(layered), None) => layered.both(d),
            (None, Some(sticky)) => sticky.both(d),
            (Some(layered), Some(sticky)) => {
                let (a, b, c) = (layered.both(d), sticky.both(d), half.both(d));
                (a.0 + b.0 - c.0, a.1 + b.1 - c.1)
            }
        }
    }
}

impl<T: Number> Law<T> for Sample<'_, T> {
    fn check(&self) -> Result<(), LawError> {
        let i = self.0;
        self.half_space().check()?;
        self.membrane().check()?;
        self.rim().check()?;
        zero_or_more("inverse_thickness_per_m", i.inverse_thickness_per_m.re())?;
        zero_or_more("work_of_adhesion_j_m2", i.work_of_adhesion_j_m2.re())?;
        finite("stiffening", i.stiffening.re())?;
        if i.work_of_adhesion_j_m2.re() > 0.0 && !matches!(i.indenter, Indenter::Sphere { .. }) {
            return Err(LawError::Indenter { effect: "adhesion" });
        }
        if i.stiffening.re() != 0.0 && i.indenter.radius_m().is_none() {
            return Err(LawError::Indenter { effect: "strain stiffening" });
        }
        Ok(())
    }

    fn force(&self, indentation_m: T) -> T {
        self.both(indentation_m).0
    }

    fn derivative(&self, indentation_m: T) -> T {
        self.both(indentation_m).1
    }

    fn both(&self, indentation_m: T) -> (T, T) {
        let d = indentation_m;
        let (factor, slope) = self.stiffening(d);
        let (force, stiffness) = self.bulk(d);
        let (membrane, rim) = (self.membrane().both(d), self.rim().both(d));
        (force * factor + membrane.0 + rim.0, stiffness * factor + force * slope + membrane.1 + rim.1)
    }

    fn validity(&self, indentation_m: f64) -> Validity {
        let d = indentation_m;
        let bulk = match (self.adhesive(), self.layered()) {
            (Some(sticky), _) if d <= 0.0 => return sticky.validity(d),
            (_, Some(layered)) => layered.validity(d),
            _ => self.half_space().validity(d),
        };
        let radius_m = self.0.indenter.radius_m().unwrap_or(f64::INFINITY);
        let change = self.0.stiffening.re().abs() * d / radius_m;
        bulk.and(Validity::of(d, "|c| delta / R", change, 0.5))
    }

    fn rises_from_m(&self) -> f64 {
        self.adhesive().map_or(0.0, |sticky| sticky.rises_from_m())
    }
}

impl<T: Number> Law<T> for Indentation<T> {
    fn check(&self) -> Result<(), LawError> {
        self.cell().check()
    }

    fn force(&self, indentation_m: T) -> T {
        self.both(indentation_m).0
    }

    fn derivative(&self, indentation_m: T) -> T {
        self.both(indentation_m).1
    }

    fn both(&self, indentation_m: T) -> (T, T) {
        if self.rigid() { self.sample().both(indentation_m) } else { self.cell().both(indentation_m) }
    }

    fn validity(&self, indentation_m: f64) -> Validity {
        self.cell().validity(indentation_m)
    }

    fn rises_from_m(&self) -> f64 {
        self.cell().rises_from_m()
    }

    fn inverse(&self, force_n: T) -> Result<T, InverseError> {
        let guess = self.sample().half_space().inverse(force_n).map_or(1e-3, |x| x.re());
        let true_m = invert(&self.sample(), force_n, guess)?;
        Ok(true_m + self.compliance_m_n * force_n)
    }
}
