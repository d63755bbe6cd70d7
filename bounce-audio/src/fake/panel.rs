//! Furniture: flat panels beside the table that send each sound back once.

use super::error::RoomError;

/// A flat, rectangular panel in the table's frame that reflects sound on both of its sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Panel {
    /// One corner, m.
    pub corner_m: [f64; 3],
    /// The two edges from that corner, m, at a right angle to each other.
    pub edges_m: [[f64; 3]; 2],
    /// Amplitude of what comes back over what arrives, from 0 to 1.
    pub reflection: f64,
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Panel {
    /// A panel that stands upright on the line between two places seen from above (m), between two heights (m).
    pub fn upright(from_m: [f64; 2], to_m: [f64; 2], z_m: [f64; 2], reflection: f64) -> Self {
        let along = [to_m[0] - from_m[0], to_m[1] - from_m[1], 0.0];
        let up = [0.0, 0.0, z_m[1] - z_m[0]];
        Self { corner_m: [from_m[0], from_m[1], z_m[0]], edges_m: [along, up], reflection }
    }

    /// Whether all values are within their ranges.
    ///
    /// # Errors
    /// [`RoomError`] names the first that is not.
    pub fn check(&self) -> Result<(), RoomError> {
        let wrong = |what, expected, got| Err(RoomError { what, expected, got });
        let [a, b] = &self.edges_m;
        for v in self.corner_m.iter().chain(a).chain(b) {
            if !v.is_finite() {
                return wrong("a panel's place", "a finite number", *v);
            }
        }
        for edge in [a, b] {
            let length = dot(edge, edge).sqrt();
            if !(length > 0.0) {
                return wrong("a panel's edge", "longer than 0", length);
            }
        }
        let cosine = dot(a, b) / (dot(a, a) * dot(b, b)).sqrt();
        if !(cosine.abs() < 1e-9) {
            return wrong("the cosine between a panel's edges", "0", cosine);
        }
        if !(0.0..=1.0).contains(&self.reflection) {
            return wrong("a panel's reflection", "0 to 1", self.reflection);
        }
        Ok(())
    }

    /// Length (m) of the way from one place by the panel to another; `None` where the mirror's point is off the panel, or the two are not
    /// on one side of it.
    pub(super) fn way_m(&self, from_m: [f64; 3], to_m: [f64; 3]) -> Option<f64> {
        let [a, b] = &self.edges_m;
        let normal = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        let size = dot(&normal, &normal).sqrt();
        let from: [f64; 3] = std::array::from_fn(|k| from_m[k] - self.corner_m[k]);
        let to: [f64; 3] = std::array::from_fn(|k| to_m[k] - self.corner_m[k]);
        let (h, k) = (dot(&normal, &from) / size, dot(&normal, &to) / size);
        if !(h * k > 0.0) {
            return None;
        }
        // The mirror's point divides the way in the ratio of the heights.
        let part = h / (h + k);
        let at: [f64; 3] = std::array::from_fn(|i| from[i] + part * (to[i] - from[i]));
        let within = |edge: &[f64; 3]| (0.0..=1.0).contains(&(dot(&at, edge) / dot(edge, edge)));
        let square = (0..3).map(|i| (to_m[i] - from_m[i]).powi(2)).sum::<f64>();
        (within(a) && within(b)).then(|| (square + 4.0 * h * k).sqrt())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    #[test]
    fn the_way_by_a_mirror_is_that_from_the_image() {
        // A wall in the plane x = -0.2: the image of (0.1, 0.3, 0) is (-0.5, 0.3, 0).
        let panel = Panel::upright([-0.2, 0.0], [-0.2, 0.5], [-0.1, 0.6], 0.8);
        panel.check().unwrap();
        let way = panel.way_m([0.1, 0.3, 0.0], [0.4, 0.1, 0.08]).unwrap();
        approx::assert_relative_eq!(way, (0.81f64 + 0.04 + 0.0064).sqrt(), epsilon = 1e-12);
        // From behind, across it, or off its edge there is no way.
        assert!(panel.way_m([-0.5, 0.3, 0.0], [-0.4, 0.1, 0.08]).is_some());
        assert_eq!(panel.way_m([-0.5, 0.3, 0.0], [0.4, 0.1, 0.08]), None);
        assert_eq!(panel.way_m([0.1, 0.9, 0.0], [0.4, 0.9, 0.08]), None);
    }

    #[test]
    fn a_panel_that_is_none_is_refused() {
        let good = Panel::upright([0.0, 0.0], [1.0, 0.0], [0.0, 1.0], 0.9);
        for bad in [
            Panel { reflection: 1.1, ..good },
            Panel { reflection: f64::NAN, ..good },
            Panel { corner_m: [f64::INFINITY, 0.0, 0.0], ..good },
            Panel { edges_m: [[0.0; 3], [0.0, 0.0, 1.0]], ..good },
            Panel { edges_m: [[1.0, 0.0, 0.0], [1.0, 0.0, 1.0]], ..good },
        ] {
            assert!(bad.check().is_err(), "{bad:?}");
        }
    }
}
