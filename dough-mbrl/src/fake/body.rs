//! A dough as slices along its axis, each an ellipse of constant volume: elastic under a light load, plastic above it.
//!
//! * A slice that is squeezed by u has a flat of half width `sqrt(rho u)`, rho the radius of curvature at its top; it bears `q = E u`
//!   for each metre of its length, but no more than `2 H sqrt(rho u)`, H its hardness (2.8 times the yield stress, Tabor 1951).
//! * What is squeezed beyond the elastic part stays. Dough flows where the way is short (Orowan and Siebel's friction hill): the share
//!   `2a/(2a + b)` of a squeeze under a strip of breadth b goes along the axis, the rest to the sides.
//! * Turning the dough turns its cross-section, and brings round material under the band in the place of the flat.

/// One slice of the dough.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Slice {
    pub(super) volume_m3: f64,
    pub(super) length_m: f64,
    /// Second harmonic of its outline: half the difference of the half axes along and across the table, and turned by 45 degrees.
    pub(super) oval_m: [f64; 2],
    /// Squeeze of which the flat on top still tells, m.
    flat_m: f64,
}

/// What a material does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Material {
    /// Pressure that a flat bears, Pa.
    pub(super) hardness_pa: f64,
    /// Force for each metre of length and of squeeze, Pa.
    pub(super) elastic_pa: f64,
    /// Part of the friction hill's axial share.
    pub(super) axial_flow: f64,
}

/// Largest share of the radius by which a slice is oval.
const MOST_OVAL: f64 = 0.5;

impl Slice {
    pub(super) fn radius_m(&self) -> f64 {
        (self.volume_m3 / (std::f64::consts::PI * self.length_m)).sqrt()
    }

    pub(super) fn half_width_m(&self) -> f64 {
        self.radius_m() + self.oval_m[0]
    }

    pub(super) fn height_m(&self) -> f64 {
        2.0 * (self.radius_m() - self.oval_m[0])
    }

    fn curvature_radius_m(&self) -> f64 {
        2.0 * self.half_width_m().powi(2) / self.height_m().max(1e-6)
    }

    /// Half width of the flat under a squeeze.
    pub(super) fn flat_half_width_m(&self, squeeze_m: f64) -> f64 {
        (self.curvature_radius_m() * (squeeze_m + self.flat_m)).sqrt().min(self.half_width_m())
    }

    /// Force on each metre of its length.
    pub(super) fn load_n_m(&self, squeeze_m: f64, material: &Material) -> f64 {
        if squeeze_m <= 0.0 {
            return 0.0;
        }
        let bears = 2.0 * material.hardness_pa * self.flat_half_width_m(squeeze_m);
        bears.min(material.elastic_pa * squeeze_m)
    }

    /// Lets flow what a squeeze is beyond the elastic part.
    pub(super) fn flow(&mut self, squeeze_m: f64, breadth_m: f64, material: &Material) {
        let elastic = self.load_n_m(squeeze_m, material) / material.elastic_pa;
        let plastic = squeeze_m - elastic;
        if !(plastic > 0.0) {
            return;
        }
        let contact = 2.0 * self.flat_half_width_m(squeeze_m);
        let along = material.axial_flow * contact / (contact + breadth_m);
        let height = self.height_m();
        let squeezed = (plastic / height).min(0.3);
        let before = self.radius_m();
        self.length_m *= 1.0 + along * squeezed;
        let after = self.radius_m();
        self.oval_m[0] += 0.5 * squeezed * height + after - before;
        self.flat_m += squeezed * height;
        self.bound();
    }

    /// Turns the cross-section by an angle; `squeeze_m` is what lies on it.
    pub(super) fn turn(&mut self, angle_rad: f64, squeeze_m: f64) {
        let (s, c) = (2.0 * angle_rad).sin_cos();
        let [x, y] = self.oval_m;
        self.oval_m = [c * x - s * y, s * x + c * y];
        let flat = 2.0 * self.flat_half_width_m(squeeze_m.max(0.0)) / self.radius_m();
        self.flat_m *= (-angle_rad / flat.max(1e-3)).exp();
    }

    /// Takes over a part of another slice's flat.
    pub(super) fn keep_flat(&mut self, other: &Self, part: f64) {
        self.flat_m += part * (other.flat_m - self.flat_m);
    }

    fn bound(&mut self) {
        let most = MOST_OVAL * self.radius_m();
        let size = self.oval_m[0].hypot(self.oval_m[1]);
        if size > most {
            self.oval_m = self.oval_m.map(|v| v * most / size);
        }
    }
}

/// The whole dough, lying along y.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Body {
    pub(super) slices: Vec<Slice>,
    /// Where its middle lies on the table, m.
    pub(super) at_m: [f64; 2],
}

const SLICES: usize = 41;

impl Body {
    /// A ball, hand-rolled: each slice a little oval, by at most `uneven` of its radius.
    pub(super) fn ball(volume_m3: f64, at_m: [f64; 2], mut uneven: impl FnMut() -> f64) -> Self {
        let radius = (3.0 * volume_m3 / (4.0 * std::f64::consts::PI)).cbrt();
        let length = 2.0 * radius / SLICES as f64;
        // The same oval all along it, a ball is one piece.
        let oval = [uneven(), uneven()];
        let slices = (0..SLICES)
            .map(|i| {
                let (a, b) = (-radius + i as f64 * length, -radius + (i + 1) as f64 * length);
                // Between two parallel cuts of a ball.
                let upto = |y: f64| std::f64::consts::PI * (radius * radius * y - y * y * y / 3.0);
                let mut slice =
                    Slice { volume_m3: upto(b) - upto(a), length_m: length, oval_m: [0.0; 2], flat_m: 0.0 };
                slice.oval_m = oval.map(|v| v * slice.radius_m());
                slice
            })
            .collect();
        Self { slices, at_m }
    }

    pub(super) fn volume_m3(&self) -> f64 {
        self.slices.iter().map(|s| s.volume_m3).sum()
    }

    pub(super) fn length_m(&self) -> f64 {
        self.slices.iter().map(|s| s.length_m).sum()
    }

    /// Each slice with the y of its two faces.
    pub(super) fn placed(&self) -> impl Iterator<Item = ([f64; 2], &Slice)> {
        let first = self.at_m[1] - 0.5 * self.length_m();
        self.slices.iter().scan(first, |y, slice| {
            let from = *y;
            *y += slice.length_m;
            Some(([from, *y], slice))
        })
    }
}
