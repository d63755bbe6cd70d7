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

    /// The contact as a law in which only what acts is computed: an effect that is at zero and carries no derivative need not be.
    pub fn contact(&self, acting: Acting) -> Contact<'_, T> {
        Contact { law: self, real: acting.compliance.then(|| self.re()), acting }
    }

    /// What is not off; with numbers that carry derivatives, everything.
    fn acting(&self) -> Acting {
        let on = |x: T| T::NDERIV > 0 || x.re() != 0.0;
        Acting {
            adhesion: on(self.work_of_adhesion_j_m2),
            stiffening: on(self.stiffening),
            membrane: on(self.tension_n_m) || on(self.stretching_n_m3),
            rim: on(self.rim_stiffness_n_m),
            compliance: on(self.compliance_m_n),
        }
    }

    fn sample(&self) -> Sample<'_, T> {
        Sample(self, self.acting())
    }

    /// True indentation in m at a measured one.
    pub fn true_indentation_m(&self, measured_m: T) -> T {
        self.contact(self.acting()).true_indentation_m(measured_m)
    }

    /// The same contact without derivatives.
    fn re(&self) -> Indentation<f64> {
        Indentation {
            indenter: self.indenter,
            poisson_ratio: self.poisson_ratio,
            modulus_pa: self.modulus_pa.re(),
            layer: self.layer,
            inverse_thickness_per_m: self.inverse_thickness_per_m.re(),
            work_of_adhesion_j_m2: self.work_of_adhesion_j_m2.re(),
            stiffening: self.stiffening.re(),
            tension_n_m: self.tension_n_m.re(),
            stretching_n_m3: self.stretching_n_m3.re(),
            rim_depth_m: self.rim_depth_m.re(),
            rim_stiffness_n_m: self.rim_stiffness_n_m.re(),
            compliance_m_n: self.compliance_m_n.re(),
        }
    }
}

/// Which effects beside elasticity and the layer's are looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Acting {
    /// Adhesion.
    pub adhesion: bool,
    /// Strain stiffening.
    pub stiffening: bool,
    /// A membrane's tension and stretching.
    pub membrane: bool,
    /// A rim.
    pub rim: bool,
    /// The load cell's compliance.
    pub compliance: bool,
}

/// An [`Indentation`] of which only what acts is computed.
#[derive(Debug, Clone, Copy)]
pub struct Contact<'a, T> {
    law: &'a Indentation<T>,
    /// The same without derivatives, where the load cell gives: there a root is looked for.
    real: Option<Indentation<f64>>,
    acting: Acting,
}

impl<T: Number> Contact<'_, T> {
    fn cell(&self) -> Compliant<T, Sample<'_, T>> {
        Compliant { law: Sample(self.law, self.acting), compliance_m_n: self.law.compliance_m_n }
    }

    fn true_indentation_m(&self, measured_m: T) -> T {
        let Some(real) = &self.real else { return measured_m };
        let cell = Compliant { law: real.sample(), compliance_m_n: real.compliance_m_n };
        cell.root_m(measured_m.re()).map_or(measured_m, |root| self.cell().polished_m(root, measured_m))
    }
}

impl<T: Number> Law<T> for Contact<'_, T> {
    fn check(&self) -> Result<(), LawError> {
        self.cell().check()
    }

    fn force(&self, indentation_m: T) -> T {
        Sample(self.law, self.acting).force(self.true_indentation_m(indentation_m))
    }

    fn derivative(&self, indentation_m: T) -> T {
        self.both(indentation_m).1
    }

    fn both(&self, indentation_m: T) -> (T, T) {
        self.cell().both_at(self.true_indentation_m(indentation_m))
    }

    fn validity(&self, indentation_m: f64) -> Validity {
        self.cell().validity(indentation_m)
    }

    fn rises_from_m(&self) -> f64 {
        self.cell().rises_from_m()
    }

    fn inverse(&self, force_n: T) -> Result<T, InverseError> {
        let sample = Sample(self.law, self.acting);
        let guess = sample.half_space().inverse(force_n).map_or(1e-3, |x| x.re());
        let true_m = invert(&sample, force_n, guess)?;
        Ok(true_m + self.law.compliance_m_n * force_n)
    }
}

/// What is pressed, without the load cell.
struct Sample<'a, T>(&'a Indentation<T>, Acting);

impl<T: Number> Sample<'_, T> {
    fn half_space(&self) -> Elastic<T> {
        let i = self.0;
        Elastic { indenter: i.indenter, modulus_pa: i.modulus_pa, poisson_ratio: i.poisson_ratio }
    }

    fn adhesive(&self) -> Option<Jkr<T>> {
        let i = self.0;
        match i.indenter {
            Indenter::Sphere { radius_m } if self.1.adhesion => Some(Jkr {
                radius_m,
                modulus_pa: i.modulus_pa,
                poisson_ratio: i.poisson_ratio,
                work_of_adhesion_j_m2: i.work_of_adhesion_j_m2,
            }),
            _ => None,
        }
    }

    fn membrane(&self) -> Membrane<T> {
        Membrane { tension_n_m: self.0.tension_n_m, stretching_n_m3: self.0.stretching_n_m3 }
    }

    fn rim(&self) -> Rim<T> {
        Rim { depth_m: self.0.rim_depth_m, stiffness_n_m: self.0.rim_stiffness_n_m }
    }

    /// Stiffness's factor and slope; a cone has no length to compare the depth with.
    fn stiffening(&self, indentation_m: T) -> Option<(T, T)> {
        let radius_m = self.0.indenter.radius_m().filter(|_| self.1.stiffening)?;
        Some(stiffening(self.0.stiffening, radius_m, indentation_m))
    }

    /// The layer's factor and its logarithmic slope over the depth, inside the contact.
    fn layered(&self, d: T) -> Option<(T, T)> {
        let i = self.0;
        let layer = i.layer.as_ref().filter(|_| d.re() > 0.0)?;
        let (factor, slope) = layer.factor(i.indenter.reach_m(d) * i.inverse_thickness_per_m);
        Some((factor, slope * i.indenter.reach_exponent()))
    }

    /// Force of the bulk: the layer, plus what adhesion changes on a half-space.
    fn bulk(&self, d: T) -> T {
        let half = self.half_space().force(d);
        let layered = self.layered(d).map_or(half, |(factor, _)| half * factor);
        self.adhesive().map_or(layered, |sticky| layered + sticky.force(d) - half)
    }

    /// The same and its slope.
    fn bulk_both(&self, d: T) -> (T, T) {
        let half = self.half_space().both(d);
        let layered = self
            .layered(d)
            .map_or(half, |(factor, slope)| (half.0 * factor, half.1 * factor + half.0 * factor / d * slope));
        self.adhesive().map_or(layered, |sticky| {
            let sticky = sticky.both(d);
            (layered.0 + sticky.0 - half.0, layered.1 + sticky.1 - half.1)
        })
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

    fn force(&self, d: T) -> T {
        let mut force = self.bulk(d);
        if let Some((factor, _)) = self.stiffening(d) {
            force *= factor;
        }
        if self.1.membrane {
            force += self.membrane().force(d);
        }
        if self.1.rim {
            force += self.rim().force(d);
        }
        force
    }

    fn derivative(&self, indentation_m: T) -> T {
        self.both(indentation_m).1
    }

    fn both(&self, d: T) -> (T, T) {
        let mut both = self.bulk_both(d);
        if let Some((factor, slope)) = self.stiffening(d) {
            both = (both.0 * factor, both.1 * factor + both.0 * slope);
        }
        let mut add = |(force, slope): (T, T)| both = (both.0 + force, both.1 + slope);
        if self.1.membrane {
            add(self.membrane().both(d));
        }
        if self.1.rim {
            add(self.rim().both(d));
        }
        both
    }

    fn validity(&self, indentation_m: f64) -> Validity {
        let d = indentation_m;
        let layered = |layer: Layer| {
            let (elastic, per_m) = (self.half_space(), self.0.inverse_thickness_per_m);
            Layered { elastic, layer, inverse_thickness_per_m: per_m }.validity(d)
        };
        let bulk = match (self.adhesive(), self.0.layer) {
            (Some(sticky), _) if d <= 0.0 => return sticky.validity(d),
            (_, Some(layer)) => layered(layer),
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
        self.contact(self.acting()).check()
    }

    fn force(&self, indentation_m: T) -> T {
        self.contact(self.acting()).force(indentation_m)
    }

    fn derivative(&self, indentation_m: T) -> T {
        self.both(indentation_m).1
    }

    fn both(&self, indentation_m: T) -> (T, T) {
        self.contact(self.acting()).both(indentation_m)
    }

    fn validity(&self, indentation_m: f64) -> Validity {
        self.contact(self.acting()).validity(indentation_m)
    }

    fn rises_from_m(&self) -> f64 {
        self.contact(self.acting()).rises_from_m()
    }

    fn inverse(&self, force_n: T) -> Result<T, InverseError> {
        self.contact(self.acting()).inverse(force_n)
    }
}
