//! A tilted cylinder by brute force: it shares nothing with what is tested.

pub(crate) mod poses;
pub(crate) mod wrist;

use std::f64::consts::PI;

/// A cylindrical cavity of radius and length that begins `bottom` above the container's outer bottom (m).
#[derive(Clone, Copy)]
pub(crate) struct Cavity {
    pub(crate) radius: f64,
    pub(crate) length: f64,
    pub(crate) bottom: f64,
}

impl Cavity {
    pub(crate) fn capacity(&self) -> f64 {
        PI * self.radius * self.radius * self.length
    }

    /// Volume and first moments (across towards the lower wall, along the axis) of what lies below a level (m, along up from the
    /// container's origin) at a tilt: columns along the axis, midpoint rule over the angle `phi` of `x = r cos(phi)`.
    pub(crate) fn below(&self, tilt: f64, level: f64, columns: usize) -> [f64; 3] {
        let (sin, cos) = tilt.sin_cos();
        let step = PI / columns as f64;
        let mut sums = [0.0; 3];
        for k in 0..columns {
            let (s, c) = ((k as f64 + 0.5) * step).sin_cos();
            let x = self.radius * c;
            let area = 2.0 * self.radius * self.radius * s * s * step;
            // Wet where -x sin + z cos <= level.
            let (bottom, top) = (self.bottom, self.bottom + self.length);
            let (low, high) = if cos.abs() < 1e-12 {
                if -x * sin <= level { (bottom, top) } else { (bottom, bottom) }
            } else {
                let at = ((level + x * sin) / cos).clamp(bottom, top);
                if cos > 0.0 { (bottom, at) } else { (at, top) }
            };
            sums[0] += area * (high - low);
            sums[1] += area * (high - low) * x;
            sums[2] += area * (high - low) * 0.5 * (high + low);
        }
        sums
    }

    /// Centre of mass (across, along) of a volume at a tilt, by bisection for the level.
    pub(crate) fn center(&self, tilt: f64, volume: f64, columns: usize) -> [f64; 2] {
        let reach = self.radius + self.length + self.bottom;
        let (mut low, mut high) = (-reach, reach);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if self.below(tilt, middle, columns)[0] < volume { low = middle } else { high = middle }
        }
        let [v, x, z] = self.below(tilt, 0.5 * (low + high), columns);
        [x / v, z / v]
    }
}
