//! Dough as a body between a block and a ball, of a volume that is kept.

use statrs::function::gamma::ln_gamma;

/// A superellipsoid `|x/a|^n + |y/a|^n + |z/c|^n <= 1` on a table: n of 2 is a ball (or, pressed, a lens), a large n a block.
///
/// How dough is kneaded here is a rule and no theory: rolled, n falls towards 2 with the way; pressed beyond what it bears, c falls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lump {
    /// Volume, m^3.
    pub volume_m3: f64,
    /// n, 2 or more.
    pub exponent: f64,
    /// c over a, above 0.
    pub flatness: f64,
}

impl Lump {
    /// A cube with slightly rounded edges of a side (m).
    pub fn cube(side_m: f64) -> Self {
        let unit = Self { volume_m3: 1.0, exponent: 8.0, flatness: 1.0 };
        Self { volume_m3: (side_m * 0.5 / unit.half_m()).powi(3), ..unit }
    }

    /// a: half the breadth, m.
    pub fn half_m(&self) -> f64 {
        // 8 a a c Gamma(1 + 1/n)^3 / Gamma(1 + 3/n).
        let n = self.exponent;
        let shape = (3.0 * ln_gamma(1.0 + 1.0 / n) - ln_gamma(1.0 + 3.0 / n)).exp();
        (self.volume_m3 / (8.0 * shape * self.flatness)).cbrt()
    }

    /// Height over the table, m.
    pub fn height_m(&self) -> f64 {
        2.0 * self.flatness * self.half_m()
    }

    /// Height of the upper side at a place off the axis, less that on the axis, m; none beside it.
    pub fn below_top_m(&self, x: f64, y: f64) -> Option<f64> {
        let (a, n) = (self.half_m(), self.exponent);
        let left = 1.0 - (x.abs() / a).powf(n) - (y.abs() / a).powf(n);
        (left > 0.0).then(|| self.flatness * a * (left.powf(1.0 / n) - 1.0))
    }

    /// Rolled by a way (m) under a force so many times what it takes.
    pub(super) fn rolled(self, way_m: f64, force: f64) -> Self {
        // A way of two breadths takes a third of what is left of the edges.
        let shrunk = (-0.2 * way_m / self.half_m() * (force - 1.0).clamp(0.0, 1.0)).exp();
        Self { exponent: 2.0 + (self.exponent - 2.0) * shrunk, ..self }
    }

    /// Pressed flatter by a hundredth.
    pub(super) fn pressed(self) -> Self {
        Self { flatness: 0.99 * self.flatness, ..self }
    }
}
