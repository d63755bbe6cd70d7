//! What lies below a level within one interval between vertex heights.

use super::cut::Cut;

/// One interval between vertex heights: polynomials in `t` from 0 to 1 over it, and what lies below it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Leaf {
    pub(super) cut: Cut,
    /// Volume, moment along up, and moments across, below the interval; about the reference point.
    pub(super) below: [f64; 4],
}

impl Leaf {
    /// Volume and moments below `t` within the interval.
    pub(super) fn up_to(&self, t: f64, low: f64, span: f64) -> [f64; 4] {
        let t = t.clamp(0.0, 1.0);
        let [a, b, c] = self.cut.area;
        let volume = span * t * (a + t * (b / 2.0 + t * c / 3.0));
        let lifted = span * span * t * t * (a / 2.0 + t * (b / 3.0 + t * c / 4.0));
        let moment = |m: &[f64; 4]| span * t * (m[0] + t * (m[1] / 2.0 + t * (m[2] / 3.0 + t * m[3] / 4.0)));
        [
            self.below[0] + volume,
            self.below[1] + low * volume + lifted,
            self.below[2] + moment(&self.cut.moments[0]),
            self.below[3] + moment(&self.cut.moments[1]),
        ]
    }

    /// The `t` below which lies a volume, given over the interval's span: Newton's method between brackets.
    pub(super) fn height_of(&self, volume: f64) -> f64 {
        let [a, b, c] = self.cut.area;
        let (mut low, mut high) = (0.0, 1.0);
        let mut t = 0.5;
        for _ in 0..60 {
            let value = t * (a + t * (b / 2.0 + t * c / 3.0)) - volume;
            if value < 0.0 {
                low = t;
            } else {
                high = t;
            }
            let newton = t - value / (a + t * (b + t * c));
            let next = if newton >= low && newton <= high { newton } else { 0.5 * (low + high) };
            let still = (next - t).abs() <= 1e-16;
            t = next;
            if still || value == 0.0 {
                break;
            }
        }
        t
    }
}
