//! Liquid in a circular cylinder of unit radius that is tilted by at most a right angle and at most half full.
//!
//! A slice across the axis at height z is wet where `x > x0 + D z / L`, with `D = L cot(theta)`: a segment of the circle.
//! With `x = cos(phi)` the segment beyond the angle alpha has the area `S(alpha) = alpha - sin(alpha) cos(alpha)`, and sums of
//! slices are differences of `K(alpha)` at the angles where the surface meets the bottom (alpha0) and the lid (alpha1):
//!
//! * `K0 = 2 int_0^alpha (cos phi - cos alpha) sin^2 phi` (volume),
//! * `K2 = int_0^alpha (cos phi - cos alpha)^2 sin^2 phi` (moment about the bottom),
//! * `E1 = 2 int_0^alpha (cos phi - cos alpha) (1 - cos phi) sin^2 phi` (moment about the lowest line of the wall).
//!
//! [Matl 2021], section 2.3 and appendix A.2, has the same wedges as four cases, each 0/0 where the tilt or the volume vanish. Here
//! small segments are power series, and two angles that nearly agree (a cylinder nearly on its side) are Taylor's series about the
//! slice in the middle; both to rounding.

use super::segment::Segment;

/// Where the surface moves sideways by at most this share of its place at the bottom, slices are summed about the middle one: the
/// first term left out is below rounding.
const NEARLY_ALIKE: f64 = 0.06;
/// Householder's step of third order leaves the fourth power of a change this small: nothing.
const CLOSE: f64 = 1e-4;

/// Slices of a cylinder nearly on its side, by Taylor's series about the middle one in half the surface's sideways move `d`.
///
/// With `e = d^2 / sin^4` of the middle angle all even terms of area and moment are the middle slice's plus powers of `e`.
struct Slices {
    middle: Segment,
    half: f64,
    e: f64,
}

impl Slices {
    fn new(delta: f64, shift: f64) -> Self {
        let middle = Segment::of_delta(delta - 0.5 * shift);
        let half = 0.5 * shift;
        let root = half / (middle.sin * middle.sin);
        Self { middle, half, e: root * root }
    }

    /// Mean area of the slices.
    fn area(&self) -> f64 {
        let (c, s, e) = (self.middle.cos(), self.middle.sin, self.e);
        let more = 1.0 / 3.0 + e * (1.0 / 20.0 + e * (3.0 + 4.0 * c * c) / 168.0);
        self.middle.area() + c * s * s * s * e * more
    }

    /// Mean of the areas' derivatives by delta: the first, and two more to leading order.
    fn slopes(&self) -> [f64; 3] {
        let (c, s, e) = (self.middle.cos(), self.middle.sin, self.e);
        let square = c * c;
        let less = 1.0 / 3.0
            + e * ((1.0 + 4.0 * square) / 20.0 + e * (1.0 + 12.0 * square + 8.0 * square * square) / 56.0);
        [s * (2.0 - e * less), c / s * (2.0 + e), -2.0 / (s * s * s)]
    }

    /// Mean moment of the slices about the lowest line of the wall.
    fn moment(&self) -> f64 {
        let (c, s, e) = (self.middle.cos(), self.middle.sin, self.e);
        let near = 1.0 / (1.0 + c);
        let more = (2.0 - near) / 3.0 - e * near * (1.0 / 20.0 + e * (4.0 * c * c - 2.0 * c + 1.0) / 168.0);
        self.middle.moment() + s.powi(5) * e * more
    }

    /// Mean of the areas times their place along the axis (-1/2 at the bottom, 1/2 at the lid).
    fn along(&self) -> f64 {
        let (c, s, e) = (self.middle.cos(), self.middle.sin, self.e);
        -self.half * s * (1.0 / 3.0 - e * (1.0 / 30.0 + e * (1.0 + 4.0 * c * c) / 280.0))
    }
}

/// A tilted cylinder of unit radius.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tilted {
    length: f64,
    /// `D = L cot(theta)`: how far the surface moves sideways from bottom to lid.
    shift: f64,
    tangent: f64,
}

/// The centre of mass's distances from the lowest line of the wall and from the bottom.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sums {
    pub(super) from_wall: f64,
    pub(super) from_bottom: f64,
}

impl Tilted {
    /// `sin` and `cos` of the tilt, both at least zero, the sine above.
    pub(super) fn new(length: f64, sin: f64, cos: f64) -> Self {
        Self { length, shift: length * cos / sin, tangent: sin / cos.max(f64::MIN_POSITIVE) }
    }

    fn alike(&self, delta: f64) -> bool {
        self.shift < NEARLY_ALIKE * delta
    }

    /// The segment at the lid, where the surface reaches it.
    fn far(&self, delta: f64) -> Option<Segment> {
        (delta > self.shift).then(|| Segment::of_delta(delta - self.shift))
    }

    /// Volume of the liquid whose surface meets the bottom at `x = 1 - delta`, and its derivatives by `delta`.
    pub(super) fn volume(&self, delta: f64) -> [f64; 4] {
        if self.alike(delta) {
            let slices = Slices::new(delta, self.shift);
            let [first, second, third] = slices.slopes();
            return [slices.area(), first, second, third].map(|v| self.length * v);
        }
        let of = |s: &Segment| [s.k0(), s.area(), 2.0 * s.sin, 2.0 * s.cos() / s.sin];
        let mut sums = of(&Segment::of_delta(delta));
        if let Some(far) = self.far(delta) {
            sums.iter_mut().zip(of(&far)).for_each(|(near, far)| *near -= far);
        }
        sums.map(|v| self.tangent * v)
    }

    /// A `delta` of a volume to some per cent: the leading powers of a wedge (of a prism, where the surface reaches the lid) with
    /// their next terms; those that no expansion gives are fitted at `delta` of 1 and 2.
    fn guess(&self, volume: f64) -> f64 {
        let w = (15.0 / 128f64.sqrt() * volume / self.tangent).powf(0.4);
        let wedge = w * (1.0 + w * (3.0 / 70.0 + w * (2.7e-3 + w * 8.2e-3)));
        if wedge <= self.shift {
            return wedge;
        }
        let p = (3.0 / 32f64.sqrt() * volume / self.length).cbrt().powi(2);
        let middle = p * (1.0 + p * (0.1 + p * 0.052));
        middle + 0.5 * self.shift - self.shift * self.shift / (48.0 * middle)
    }

    /// The `delta` of a volume by Householder's method of third order, between brackets.
    pub(super) fn delta_of(&self, volume: f64) -> f64 {
        let (mut low, mut high) = (0.0, 2.0);
        let mut delta = self.guess(volume).clamp(f64::MIN_POSITIVE, 2.0 - 1e-9);
        for _ in 0..80 {
            let [value, f1, f2, f3] = self.volume(delta);
            let f = value - volume;
            if f < 0.0 {
                low = delta;
            } else {
                high = delta;
            }
            let step = -f * (f1 * f1 - 0.5 * f * f2) / (f1 * (f1 * f1 - f * f2) + f * f * f3 / 6.0);
            let next = delta + step;
            let next = if next >= low && next <= high { next } else { 0.5 * (low + high) };
            // Third derivatives are singular where the surface meets an edge.
            let edge = delta.min(2.0 - delta).min((delta - self.shift).abs());
            let close = (next - delta).abs() <= (CLOSE * edge).max(1e-9 * delta);
            delta = next;
            if close {
                break;
            }
        }
        delta
    }

    /// The centre of mass of the liquid whose surface meets the bottom at `x = 1 - delta`.
    pub(super) fn center(&self, delta: f64) -> Sums {
        if self.alike(delta) {
            let slices = Slices::new(delta, self.shift);
            let area = slices.area();
            return Sums {
                from_wall: slices.moment() / area,
                from_bottom: self.length * (0.5 + slices.along() / area),
            };
        }
        let of = |s: &Segment| [s.k0(), s.e1(), s.k2()];
        let mut sums = of(&Segment::of_delta(delta));
        let mut lid = 0.0;
        if let Some(far) = self.far(delta) {
            let far = of(&far);
            lid = self.shift * far[0];
            sums.iter_mut().zip(far).for_each(|(near, far)| *near -= far);
        }
        let [volume, wall, bottom] = sums;
        Sums { from_wall: wall / volume, from_bottom: self.tangent * (bottom - lid) / volume }
    }
}
