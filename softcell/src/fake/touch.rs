//! What a touch does to the skin.

use std::f64::consts::{FRAC_PI_2, PI};

use super::dome::Dome;

/// A plate (or a large ball) that touches the dome along its axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Place of the contact's centre off the axis, m.
    pub at_m: [f64; 2],
    /// Indentation, m; zero or less: no touch.
    pub indentation_m: f64,
    /// Tangential movement of what touches, m.
    pub shear_m: [f64; 2],
    /// Turning of what touches about the normal, rad.
    pub turn_rad: f64,
    /// Friction between skin and plate.
    pub friction: f64,
}

impl Touch {
    /// Nothing touches.
    pub fn none() -> Self {
        Self { at_m: [0.0; 2], indentation_m: 0.0, shear_m: [0.0; 2], turn_rad: 0.0, friction: 1.0 }
    }

    /// Radius of the contact on a dome of a radius, m.
    pub fn contact_m(&self, radius_m: f64) -> f64 {
        (radius_m * self.indentation_m.max(0.0)).sqrt()
    }

    /// Where a skin's point goes that is at rest in a direction of the dome; z along the axis from the dome's centre, m.
    pub fn point(&self, dome: &Dome, pressure_pa: f64, [off, around]: [f64; 2]) -> [f64; 3] {
        let radius = dome.radius_at_m(pressure_pa);
        let rest = [radius * off.sin() * around.cos(), radius * off.sin() * around.sin(), radius * off.cos()];
        let a = self.contact_m(radius);
        if !(a > 0.0) {
            return rest;
        }
        // The skin is pressed flat: its arc from the contact's centre keeps its length.
        let out = [rest[0] - self.at_m[0], rest[1] - self.at_m[1]];
        let chord = out[0].hypot(out[1]).max(1e-12);
        let arc = radius * (chord / radius).min(1.0).asin();
        let sunk = pressed(arc, a);
        let spread = 1.0 + (arc / chord - 1.0) * sunk;
        let turn = self.turn_rad * twisted(arc, a);
        let (c, s) = (turn.cos() * spread, turn.sin() * spread);
        let [u, v] = self.sheared(arc, a);
        [
            self.at_m[0] + c * out[0] - s * out[1] + u,
            self.at_m[1] + s * out[0] + c * out[1] + v,
            rest[2] - self.indentation_m * sunk,
        ]
    }

    /// Movement of the skin under the part of the shear that the contact holds, and the part that it holds in full at most.
    fn sheared(&self, r: f64, a: f64) -> [f64; 2] {
        let wanted = self.shear_m[0].hypot(self.shear_m[1]);
        if !(wanted > 0.0) {
            return [0.0; 2];
        }
        let limit = self.slides_m(a);
        let held = wanted.min(limit);
        // Cattaneo 1938, Mindlin 1949: full slip over a, less the same over the stick radius c, so that the inside moves alike.
        let stick = a * (1.0 - held / limit).sqrt();
        let full = |r: f64, a: f64| a * a * hertzian(r, a);
        let scale = held / (full(0.0, a) - full(0.0, stick));
        let by = scale * (full(r, a) - full(r, stick));
        [by * self.shear_m[0] / wanted, by * self.shear_m[1] / wanted]
    }

    /// Movement in m at which a contact of a radius slides as a whole: `3 mu N (2 - nu)/(16 G a)` with Hertz's N, in which the
    /// modulus cancels.
    pub fn slides_m(&self, contact_m: f64) -> f64 {
        let nu = 0.5;
        // N = 4 E a delta / (3 (1 - nu^2)) with delta = a^2/R, G = E/(2 (1 + nu)).
        self.friction * (2.0 - nu) * 0.5 / (1.0 - nu) * self.indentation_m.max(0.0).max(1e-12 * contact_m)
    }
}

/// Normal displacement under Hertz's pressure over its value at the middle (Johnson 1985, eqs 3.41 and 3.42), but flat inside: the
/// skin lies on the plate.
fn pressed(r: f64, a: f64) -> f64 {
    if r <= a {
        return 1.0;
    }
    // Continuous at the edge, where Hertz has half of the middle's.
    2.0 * hertzian(r, a)
}

/// `(2 - r^2/a^2)/2` inside, `[(2 - r^2/a^2) asin(a/r) + sqrt(r^2/a^2 - 1)] / pi` outside; zero for a = 0.
fn hertzian(r: f64, a: f64) -> f64 {
    if !(a > 0.0) {
        return 0.0;
    }
    let q = r / a;
    if q <= 1.0 {
        return 1.0 - 0.5 * q * q;
    }
    ((2.0 - q * q) * (1.0 / q).asin() + (q * q - 1.0).sqrt()) / PI
}

/// Turning outside a disc that is turned by 1 (Reissner and Sagoci 1944).
fn twisted(r: f64, a: f64) -> f64 {
    if r <= a {
        return 1.0;
    }
    let q = a / r;
    (q.asin() - q * (1.0 - q * q).sqrt()) / FRAC_PI_2
}
