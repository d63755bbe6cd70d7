//! A depth camera over the membrane.

use hw_traits::picture::{Intrinsics, NotRows, Picture};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use super::membrane::Membrane;

/// Pinhole, place and noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthEye {
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// Pinhole.
    pub intrinsics: Intrinsics,
    /// Distance from the level membrane, m.
    pub distance_m: f64,
    /// Distance from what is behind it, m.
    pub background_m: f64,
    /// Standard deviation of a depth at 0.25 m, m; grows with the square of the depth.
    pub noise_m: f64,
    /// Step of the readings, m.
    pub step_m: f64,
    /// Part of the pixels that see nothing.
    pub holes: f64,
    /// Part of the pixels that fly: anywhere between membrane and background.
    pub flying: f64,
    /// Slope (tangent) from which on pixels see nothing.
    pub steep: f64,
}

impl DepthEye {
    /// An SR305 at 0.25 m: 640 x 480 pixels, some 0.5 mm of noise, steps of 0.125 mm, 2 % holes.
    pub fn sr305() -> Self {
        Self {
            width_px: 640,
            height_px: 480,
            intrinsics: Intrinsics { fx: 474.0, fy: 474.0, cx: 319.5, cy: 239.5 },
            distance_m: 0.25,
            background_m: 0.42,
            noise_m: 0.5e-3,
            step_m: 0.125e-3,
            holes: 0.02,
            flying: 0.002,
            steep: 2.5,
        }
    }

    /// A picture of the membrane; holes come alone and in patches of 5 x 5.
    ///
    /// # Errors
    /// [`NotRows`] for a camera without pixels.
    pub fn picture(&self, membrane: &Membrane, rng: &mut impl Rng) -> Result<Picture<f32>, NotRows> {
        let (width, height) = (self.width_px, self.height_px);
        let mut depths = Vec::with_capacity(width * height);
        for v in 0..height {
            for u in 0..width {
                let z = self.depth(membrane, u as f64, v as f64);
                let noise: f64 = StandardNormal.sample(rng);
                let chance: f64 = rng.random();
                let seen = z.map_or(self.background_m, |(z, _)| z);
                let steep = z.is_some_and(|(_, slope)| slope > self.steep);
                let noisy = if chance < self.flying {
                    seen + rng.random::<f64>() * (self.background_m - seen)
                } else {
                    seen + self.noise_m * (seen / 0.25).powi(2) * noise
                };
                let hole = steep || chance > 1.0 - 0.5 * self.holes;
                let stepped =
                    if self.step_m > 0.0 { (noisy / self.step_m).round() * self.step_m } else { noisy };
                depths.push(if hole { f32::NAN } else { stepped as f32 });
            }
        }
        let patches = (0.5 * self.holes * depths.len() as f64 / 25.0) as usize;
        for _ in 0..patches {
            let (u, v) = (rng.random_range(0..width), rng.random_range(0..height));
            for row in v..(v + 5).min(height) {
                depths[row * width + u..row * width + (u + 5).min(width)].fill(f32::NAN);
            }
        }
        Picture::new(width, depths)
    }

    /// Depth without noise (rows of the picture go against the membrane's y) and the tangent of the slope to the ray's plane; none beside the membrane.
    fn depth(&self, membrane: &Membrane, u: f64, v: f64) -> Option<(f64, f64)> {
        let [x, y, _] = self.intrinsics.point(u, v, 1.0);
        let mut z = self.distance_m;
        for _ in 0..6 {
            z = self.distance_m - membrane.height_m(x * z, -y * z)?;
        }
        let h = 5e-4;
        let at = |dx: f64, dy: f64| membrane.height_m(x * z + dx, dy - y * z).unwrap_or(self.distance_m - z);
        let slope = ((at(h, 0.0) - at(-h, 0.0)) / (2.0 * h)).hypot((at(0.0, h) - at(0.0, -h)) / (2.0 * h));
        Some((z, slope))
    }
}
