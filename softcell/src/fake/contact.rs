//! An inflated skin on a rubber body pressed against an elastic object: axisymmetric contact on rings, solved numerically.
//!
//! The skin's displacement w inward answers the contact's pressure q by `q = K_b w - T lap w + (Y/R^2) w`: the body as an elastic half-space, the shell under
//! the air's tension `T = p R/2`, which rises as it is stretched by its slopes (Berger 1955, DOI 10.1115/1.4011138: a mean over the skin), and the stretching of a shallow
//! sphere (Vella et al. 2012, DOI 10.1098/rsif.2011.0352). The object is a half-space by its influence matrix (Johnson 1985, section 3.4). Both surfaces are circles, not parabolas. No
//! contact law in closed form is in it.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{DMatrix, DVector};

/// Rings from the axis to the skin's rim.
const RINGS: usize = 48;
/// Part of the radius at which the skin is held.
const RIM: f64 = 0.95;

/// An inflated tip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoftTip {
    /// Radius without pressure, m.
    pub radius_m: f64,
    /// Growth of the radius, m/Pa.
    pub growth_m_pa: f64,
    /// Modulus of the rubber body in plane strain, `E/(1 - nu^2)`, Pa.
    pub body_pa: f64,
    /// Young's modulus of the skin times its thickness, N/m.
    pub skin_n_m: f64,
}

impl SoftTip {
    /// The tip of [Matl 2021], 21.23 mm, about as firm as [`super::Dome`].
    pub fn matl_2021() -> Self {
        Self { radius_m: 0.02123, growth_m_pa: 7e-7, body_pa: 3000.0, skin_n_m: 60.0 }
    }

    /// The same tip with its rubber firmer by a share.
    pub fn aged(&self, share: f64) -> Self {
        Self { body_pa: self.body_pa * (1.0 + share), skin_n_m: self.skin_n_m * (1.0 + share), ..*self }
    }
}

/// An elastic ball or half-space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Object {
    /// Modulus in plane strain, `E/(1 - nu^2)`, Pa; infinite: rigid.
    pub modulus_pa: f64,
    /// Radius, m; infinite: flat; negative: a bowl, which has to be wider than the tip.
    pub radius_m: f64,
    /// Part of its own indentation that stays when the tip leaves.
    pub dent: f64,
}

/// A state of the contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Approach of base and object since they touched, m.
    pub travel_m: f64,
    /// Indentation of the tip at its apex, m.
    pub tip_m: f64,
    /// Radius of the contact, m.
    pub contact_m: f64,
    /// Force, N.
    pub force_n: f64,
}

/// The rings of a tip, with what does not change from press to press.
#[derive(Debug, Clone)]
pub struct Rings {
    width_m: f64,
    /// Displacements of a half-space of modulus one by pressures of one on each ring.
    half_space: DMatrix<f64>,
    inverse: DMatrix<f64>,
    /// Minus the Laplacian.
    curvature: DMatrix<f64>,
}

impl Rings {
    /// Rings up to the rim of a tip; none for a radius that is none.
    pub fn new(radius_m: f64) -> Option<Self> {
        let width_m = RIM * radius_m / RINGS as f64;
        let place = |i: usize| (i as f64 + 0.5) * width_m;
        let half_space = DMatrix::from_fn(RINGS, RINGS, |i, k| {
            let disc = |n: usize| disc(place(i), n as f64 * width_m);
            disc(k + 1) - disc(k)
        });
        let inverse = half_space.clone().try_inverse()?;
        let mut curvature = DMatrix::zeros(RINGS, RINGS);
        for i in 0..RINGS {
            let area = place(i) * width_m;
            // Circumferences over 2 pi times the distance between rings.
            let (inner, outer) = (i as f64, i as f64 + 1.0);
            curvature[(i, i)] += (inner + outer) / area;
            if i > 0 {
                curvature[(i, i - 1)] -= inner / area;
            }
            if i + 1 < RINGS {
                curvature[(i, i + 1)] -= outer / area;
            } else {
                // Held at half a ring beyond.
                curvature[(i, i)] += outer / area;
            }
        }
        Some(Self { width_m, half_space, inverse, curvature })
    }

    fn place_m(&self, i: usize) -> f64 {
        (i as f64 + 0.5) * self.width_m
    }

    /// Contacts of rising radius, up to an approach or to four fifths of the skin; none where the skin's equations have no solution.
    pub fn press(
        &self,
        tip: &SoftTip,
        object: &Object,
        pressure_pa: f64,
        travel_m: f64,
    ) -> Option<Vec<Contact>> {
        let radius_m = tip.radius_m + tip.growth_m_pa * pressure_pa;
        let gap = DVector::from_fn(RINGS, |i, _| {
            depth(radius_m, self.place_m(i)) + depth(object.radius_m, self.place_m(i))
        });
        let untouched = Contact { travel_m: 0.0, tip_m: 0.0, contact_m: 0.0, force_n: 0.0 };
        let mut contacts = vec![untouched];
        let rest_n_m = 0.5 * pressure_pa.max(0.0) * radius_m;
        let mut stretch = 0.0;
        for touching in 2..RINGS * 4 / 5 {
            let mut next = untouched;
            for _ in 0..3 {
                let tension = rest_n_m + tip.skin_n_m * stretch;
                let firmness = &self.inverse * tip.body_pa
                    + &self.curvature * tension
                    + DMatrix::identity(RINGS, RINGS) * (tip.skin_n_m / radius_m.powi(2));
                let yields = firmness.try_inverse()?;
                let both = &yields + &self.half_space / object.modulus_pa;
                let lu = both.view((0, 0), (touching, touching)).into_owned().lu();
                let rise = lu.solve(&DVector::from_element(touching, 1.0))?;
                let bend = lu.solve(&gap.rows(0, touching).into_owned())?;
                // The outermost ring just touches.
                let travel = bend[touching - 1] / rise[touching - 1];
                let mut pressure = DVector::zeros(RINGS);
                pressure.rows_mut(0, touching).copy_from(&(rise * travel - bend));
                let sunk = &yields * &pressure;
                stretch = self.stretch(&sunk);
                let area = |i: usize| 2.0 * PI * self.place_m(i) * self.width_m;
                next = Contact {
                    travel_m: travel,
                    tip_m: sunk[0],
                    contact_m: (touching as f64 - 1.0) * self.width_m,
                    force_n: (0..touching).map(|i| pressure[i] * area(i)).sum(),
                };
            }
            contacts.push(next);
            if next.travel_m > travel_m {
                break;
            }
        }
        Some(contacts)
    }

    /// Mean over the skin of half the square of its slope.
    fn stretch(&self, sunk: &DVector<f64>) -> f64 {
        let mut sum = 0.0;
        for i in 1..RINGS {
            let slope = (sunk[i] - sunk[i - 1]) / self.width_m;
            sum += 0.5 * slope * slope * 2.0 * i as f64;
        }
        sum / (RINGS as f64).powi(2)
    }
}

/// How far a circle of a radius falls off at a distance from its apex, m.
fn depth(radius_m: f64, r: f64) -> f64 {
    if radius_m.is_infinite() {
        return 0.0;
    }
    r * r / (radius_m + radius_m.signum() * (radius_m * radius_m - r * r).max(0.0).sqrt())
}

/// Displacement at r of a half-space of modulus one by a pressure of one on a disc (Johnson 1985, eqs 3.29).
fn disc(r: f64, radius: f64) -> f64 {
    if !(radius > 0.0) {
        return 0.0;
    }
    if r < radius {
        return 4.0 / PI * radius * elliptic(r / radius)[1];
    }
    let k = radius / r;
    let [first, second] = elliptic(k);
    4.0 / PI * r * (second - (1.0 - k * k) * first)
}

/// Complete elliptic integrals of the first and second kind of a modulus below one, by the arithmetic-geometric mean (DLMF 19.8).
fn elliptic(k: f64) -> [f64; 2] {
    let (mut a, mut g, mut c) = (1.0, (1.0 - k * k).max(1e-30).sqrt(), k);
    let (mut sum, mut power) = (0.5 * c * c, 0.5);
    for _ in 0..12 {
        (a, g, c) = (0.5 * (a + g), (a * g).sqrt(), 0.5 * (a - g));
        power *= 2.0;
        sum += power * c * c;
    }
    let first = FRAC_PI_2 / a;
    [first, first * (1.0 - sum)]
}
