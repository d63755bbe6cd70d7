//! What the camera behind the skin sees.

use hw_traits::picture::{Intrinsics, NotRows, Picture};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

/// A camera on the axis, looking at the dome from inside.
#[derive(Debug, Clone, PartialEq)]
pub struct Eye {
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// Pinhole.
    pub intrinsics: Intrinsics,
    /// Distance of the lens from the dome's centre, m.
    pub behind_m: f64,
    /// Radius of a marker, m.
    pub marker_m: f64,
    /// Standard deviation of a pixel's noise, grey levels.
    pub noise: f64,
    /// Grey level of the skin at the middle.
    pub skin_grey: f64,
    /// Grey level of a marker at the middle.
    pub marker_grey: f64,
    /// What is left of the light in the corners.
    pub vignette: f64,
}

impl Eye {
    /// 640 x 480 pixels, 67 mm behind the rim.
    pub fn matl_2021() -> Self {
        Self {
            width_px: 640,
            height_px: 480,
            intrinsics: Intrinsics { fx: 640.0, fy: 640.0, cx: 319.5, cy: 239.5 },
            behind_m: 0.067,
            marker_m: 0.001,
            noise: 2.0,
            skin_grey: 30.0,
            marker_grey: 210.0,
            vignette: 0.75,
        }
    }

    /// Where a point (from the dome's centre, z along the axis, m) is seen; none behind the lens.
    pub fn pixel(&self, [x, y, z]: [f64; 3]) -> Option<[f64; 2]> {
        self.intrinsics.pixel([x, y, z + self.behind_m]).map(|(u, v)| [u, v])
    }

    /// A picture of markers at points; edges are as sharp as a lens leaves them (a pixel wide).
    ///
    /// # Errors
    /// [`NotRows`] for a camera without pixels.
    pub fn picture(&self, points: &[[f64; 3]], rng: &mut impl Rng) -> Result<Picture<u8>, NotRows> {
        let (width, height) = (self.width_px, self.height_px);
        let mut cover = vec![0f32; width * height];
        for p in points {
            let Some([u, v]) = self.pixel(*p) else { continue };
            let radius = self.intrinsics.fx * self.marker_m / (p[2] + self.behind_m);
            self.disc(&mut cover, [u, v], radius);
        }
        let middle = [self.intrinsics.cx, self.intrinsics.cy];
        let corner = middle[0].hypot(middle[1]);
        let mut grey = Vec::with_capacity(cover.len());
        for (i, &c) in cover.iter().enumerate() {
            let out = ((i % width) as f64 - middle[0]).hypot((i / width) as f64 - middle[1]) / corner;
            let light = 1.0 - (1.0 - self.vignette) * out * out;
            let (skin, marker) = (self.skin_grey, self.marker_grey);
            let noise: f64 = StandardNormal.sample(rng);
            let value = light * (skin + (marker - skin) * f64::from(c)) + self.noise * noise;
            grey.push(value.round().clamp(0.0, 255.0) as u8);
        }
        Picture::new(width, grey)
    }

    fn disc(&self, cover: &mut [f32], [u, v]: [f64; 2], radius: f64) {
        let (width, height) = (self.width_px, self.height_px);
        let clamp = |x: f64, end: usize| x.clamp(0.0, end as f64) as usize;
        let reach = radius + 2.0;
        for row in clamp(v - reach, height)..clamp(v + reach + 1.0, height) {
            for column in clamp(u - reach, width)..clamp(u + reach + 1.0, width) {
                let out = (column as f64 - u).hypot(row as f64 - v) - radius;
                let part = (0.5 - 0.5 * out).clamp(0.0, 1.0) as f32;
                let c = &mut cover[row * width + column];
                *c = c.max(part);
            }
        }
    }
}
