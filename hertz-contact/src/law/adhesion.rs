//! A sphere that sticks.

use std::f64::consts::PI;

use super::elastic::{Elastic, nan_or_zero};
use super::{InverseError, Law, LawError, Validity, plane_modulus, poisson, polish, positive, zero_or_more};
use crate::{Number, indenter::Indenter};

/// Johnson, Kendall and Roberts 1971 (doi:10.1098/rspa.1971.0141): adhesion inside the contact, for soft, large, sticky
/// spheres.
///
/// With `E* = E/(1 - nu^2)` and contact radius a: `F = 4 E* a^3/(3 R) - sqrt(8 pi w E* a^3)`,
/// `delta = a^2/R - sqrt(2 pi w a/E*)`. The force is that of a contact which is held while the indentation is prescribed:
/// it goes on below `delta = 0` down to [`Jkr::pull_off_m`], where it is `-5/6 pi w R`; its minimum `-3/2 pi w R` is at
/// [`Law::rises_from_m`]. On the way in the bodies jump into contact at `delta = 0` only
/// ([`Jkr::force_on_approach`]). Holds for a Tabor number above 5 ([`Jkr::tabor_number`]), and where Hertz does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jkr<T> {
    /// Radius in m, positive.
    pub radius_m: f64,
    /// Young's modulus E in Pa, positive.
    pub modulus_pa: T,
    /// Poisson's ratio, above -1 and up to 0.5.
    pub poisson_ratio: f64,
    /// Work of adhesion w in J/m^2, zero or more; zero is Hertz.
    pub work_of_adhesion_j_m2: T,
}

/// A contact solved for its radius.
struct Contact<T> {
    /// Contact radius in m.
    radius_m: T,
    /// `(a_c/a)^(3/2)`, 1 where it breaks, 0 without adhesion.
    ratio: T,
    /// Force in N.
    force_n: T,
}

impl<T: Number> Jkr<T> {
    fn plane(&self) -> T {
        plane_modulus(self.modulus_pa, self.poisson_ratio)
    }

    fn hertz(&self) -> Elastic<T> {
        Elastic {
            indenter: Indenter::Sphere { radius_m: self.radius_m },
            modulus_pa: self.modulus_pa,
            poisson_ratio: self.poisson_ratio,
        }
    }

    /// Contact radius in m at which a contact under prescribed indentation breaks, `(pi w R^2 / (8 E*))^(1/3)`.
    fn critical_m(&self) -> T {
        if !(self.work_of_adhesion_j_m2.re() > 0.0) {
            return T::from(0.0);
        }
        (self.work_of_adhesion_j_m2 * (PI / 8.0 * self.radius_m * self.radius_m) / self.plane()).cbrt()
    }

    /// Indentation in m, below zero, at which a contact breaks if the indentation is prescribed.
    pub fn pull_off_m(&self) -> f64 {
        let a = self.critical_m().re();
        -3.0 * a * a / self.radius_m
    }

    /// Contact radius in m at an indentation in m; zero where there is no contact.
    pub fn contact_radius_m(&self, indentation_m: T) -> T {
        self.contact(indentation_m).map_or_else(|| nan_or_zero(indentation_m), |c| c.radius_m)
    }

    /// Force in N on the way in: zero until `delta = 0`, where the bodies jump into contact.
    pub fn force_on_approach(&self, indentation_m: T) -> T {
        if indentation_m.re() >= 0.0 { self.force(indentation_m) } else { nan_or_zero(indentation_m) }
    }

    /// Tabor's number `(R w^2 / (E*^2 z^3))^(1/3)` for a range z of the attraction in m: JKR above 5, DMT below 0.1.
    pub fn tabor_number(&self, range_m: f64) -> f64 {
        let w = self.work_of_adhesion_j_m2.re() / self.plane().re();
        (self.radius_m * w * w).cbrt() / range_m
    }

    fn contact(&self, indentation_m: T) -> Option<Contact<T>> {
        let (d, w) = (indentation_m, self.work_of_adhesion_j_m2);
        let (r, e) = (self.radius_m, self.plane());
        if d.re().is_nan() {
            return None;
        }
        // s = sqrt(2 pi w a/E*) = q d with q = sqrt(z) y, y^4 = 1 + sqrt(z) y.
        let z = w * (2.0 * PI * r.sqrt()) / (e * d * d.abs().sqrt());
        if d.re() > 0.0 && z.re() < 1.0 {
            // The root's derivative is infinite at z = 0; what it does to the force vanishes there.
            let (y, q) = if z.re() > 1e-20 { spread(z.sqrt()) } else { (T::from(1.0), T::from(0.0)) };
            let one = q + T::from(1.0);
            let radius_m = (d * one * r).sqrt();
            // F - F_Hertz with the terms of order sqrt(w), which cancel, left out.
            let bottom = one.sqrt() * (T::from(4.0 / 3.0) - q * (2.0 / 3.0)) + T::from(4.0 / 3.0);
            let pull = w * (8.0 / 9.0 * PI * r) * y * y * (T::from(3.0) - q) / bottom;
            let force_n = self.hertz().force(d) - pull;
            return Some(Contact { radius_m, ratio: q / (one * 4.0), force_n });
        }
        if !(w.re() > 0.0) {
            return None;
        }
        // a = a_c x^2, delta R/a_c^2 = x^4 - 4 x with x >= 1.
        let critical = self.critical_m();
        let depth = d * r / (critical * critical);
        let over = depth.re() + 3.0;
        if !(over >= -1e-12) {
            return None;
        }
        let mut x = 1.0 + (over.max(0.0) / 6.0).sqrt();
        for _ in 0..60 {
            // The quartic is convex and x starts right of the root: every step stays there.
            let slope = 4.0 * (x * x * x - 1.0);
            let step = (x * (x * x * x - 4.0) - depth.re()) / slope;
            if !(step > 1e-16 * x) {
                break;
            }
            x -= step;
        }
        let x = polish(T::from(x), |x| (x.powi(4) - x * 4.0 - depth, (x.powi(3) - 1.0) * 4.0));
        let cube = x * x * x;
        let force_n = e * critical.powi(3) * cube * (cube * (4.0 / 3.0) - 8.0) / r;
        Some(Contact { radius_m: critical * x * x, ratio: cube.recip(), force_n })
    }
}

/// y with `y^4 = 1 + root y`, and `q = root y`.
fn spread<T: Number>(root: T) -> (T, T) {
    let mut y = 1.0;
    for _ in 0..8 {
        // From y = 1 Newton overshoots, then comes down: the quartic is convex.
        let (value, slope) = (y * y * y * y - 1.0 - root.re() * y, 4.0 * y * y * y - root.re());
        y -= value / slope;
    }
    let y = polish(T::from(y), |y| (y.powi(4) - root * y - 1.0, y.powi(3) * 4.0 - root));
    (y, root * y)
}

impl<T: Number> Law<T> for Jkr<T> {
    fn check(&self) -> Result<(), LawError> {
        positive("radius_m", self.radius_m)?;
        positive("modulus_pa", self.modulus_pa.re())?;
        poisson(self.poisson_ratio)?;
        zero_or_more("work_of_adhesion_j_m2", self.work_of_adhesion_j_m2.re())
    }

    fn force(&self, indentation_m: T) -> T {
        self.contact(indentation_m).map_or_else(|| nan_or_zero(indentation_m), |c| c.force_n)
    }

    fn derivative(&self, indentation_m: T) -> T {
        self.both(indentation_m).1
    }

    fn both(&self, indentation_m: T) -> (T, T) {
        self.contact(indentation_m).map_or_else(
            || (nan_or_zero(indentation_m), nan_or_zero(indentation_m)),
            |c| {
                let one = T::from(1.0);
                let slope = self.plane() * c.radius_m * 2.0 * (one - c.ratio * 3.0) / (one - c.ratio);
                (c.force_n, slope)
            },
        )
    }

    fn validity(&self, indentation_m: f64) -> Validity {
        if indentation_m >= self.pull_off_m() {
            let a = self.contact_radius_m(T::from(indentation_m)).re();
            let touching = if a > 0.0 { 1.0 } else { 0.0 };
            // Hertz's limit delta <= 0.1 R, for the contact radius.
            return Validity::of(touching, "contact radius / R", a / self.radius_m, 0.1_f64.sqrt());
        }
        Validity::NoContact
    }

    fn rises_from_m(&self) -> f64 {
        // x^3 = 3: delta R/a_c^2 = 3^(4/3) - 4 3^(1/3) = -3^(1/3).
        let a = self.critical_m().re();
        -(3.0_f64.cbrt()) * a * a / self.radius_m
    }

    fn inverse(&self, force_n: T) -> Result<T, InverseError> {
        let force = force_n.re();
        if !force.is_finite() {
            return Err(InverseError::NotFinite { force_n: force });
        }
        let w = self.work_of_adhesion_j_m2;
        if !(w.re() > 0.0) {
            return self.hertz().inverse(force_n);
        }
        let pull = w * (1.5 * PI * self.radius_m);
        if force < -pull.re() {
            return Err(InverseError::BelowLowest { force_n: force, lowest_n: -pull.re() });
        }
        // a^3 E* 4/(3 R) = F + 2 P + 2 sqrt(P (F + P)) with P = 3/2 pi w R (their eq. 18).
        let room = force_n + pull;
        let root = if room.re() > 0.0 { (pull * room).sqrt() } else { T::from(0.0) };
        let cube = (room + pull + root * 2.0) * (0.75 * self.radius_m) / self.plane();
        if !cube.re().is_finite() {
            return Err(InverseError::NotReached { force_n: force });
        }
        let a = cube.cbrt();
        Ok(a * a / self.radius_m - (w * a * (2.0 * PI) / self.plane()).sqrt())
    }
}

/// Derjaguin, Muller and Toporov 1975 (doi:10.1016/0021-9797(75)90018-1): adhesion around the contact, for hard, small
/// spheres.
///
/// `F = F_Hertz - 2 pi w R` for `delta >= 0`, zero below: the range of the attraction is taken as none. Holds for a Tabor
/// number below 0.1, and where Hertz does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dmt<T> {
    /// Radius in m, positive.
    pub radius_m: f64,
    /// Young's modulus E in Pa, positive.
    pub modulus_pa: T,
    /// Poisson's ratio, above -1 and up to 0.5.
    pub poisson_ratio: f64,
    /// Work of adhesion w in J/m^2, zero or more.
    pub work_of_adhesion_j_m2: T,
}

impl<T: Number> Dmt<T> {
    fn hertz(&self) -> Elastic<T> {
        Elastic {
            indenter: Indenter::Sphere { radius_m: self.radius_m },
            modulus_pa: self.modulus_pa,
            poisson_ratio: self.poisson_ratio,
        }
    }

    fn pull(&self) -> T {
        self.work_of_adhesion_j_m2 * (2.0 * PI * self.radius_m)
    }
}

impl<T: Number> Law<T> for Dmt<T> {
    fn check(&self) -> Result<(), LawError> {
        self.hertz().check()?;
        zero_or_more("work_of_adhesion_j_m2", self.work_of_adhesion_j_m2.re())
    }

    fn force(&self, indentation_m: T) -> T {
        if !(indentation_m.re() >= 0.0) {
            return nan_or_zero(indentation_m);
        }
        self.hertz().force(indentation_m) - self.pull()
    }

    fn derivative(&self, indentation_m: T) -> T {
        self.hertz().derivative(indentation_m)
    }

    fn validity(&self, indentation_m: f64) -> Validity {
        self.hertz().validity(indentation_m)
    }

    fn inverse(&self, force_n: T) -> Result<T, InverseError> {
        let pull = self.pull();
        if force_n.re() < -pull.re() {
            return Err(InverseError::BelowLowest { force_n: force_n.re(), lowest_n: -pull.re() });
        }
        self.hertz().inverse(force_n + pull)
    }
}
