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
//! Thesis section 2.3 and appendix A.2 have the same wedges as four cases, each 0/0 where the tilt or the volume vanish. Here
//! small segments are power series, and two angles that nearly agree (a cylinder nearly on its side) are an average over the
//! slices between them; both to rounding.

/// Angles below this one have their functions as series.
const SERIES_BELOW: f64 = 1.0;
/// Where the nearer wedge is at least this share of the farther one, slices are averaged.
const NEARLY_ALIKE: f64 = 0.85;

/// Functions of a segment's angle.
#[derive(Debug, Clone, Copy)]
struct Segment {
    alpha: f64,
    sin: f64,
    /// 1 - cos.
    delta: f64,
}

fn series(alpha: f64, power: i32, coefficients: &[f64; 10]) -> f64 {
    let square = alpha * alpha;
    alpha.powi(power) * coefficients.iter().rev().fold(0.0, |sum, c| sum * square + c)
}

impl Segment {
    fn of_delta(delta: f64) -> Self {
        let delta = delta.clamp(0.0, 2.0);
        Self { alpha: 2.0 * (0.5 * delta).sqrt().asin(), sin: (delta * (2.0 - delta)).sqrt(), delta }
    }

    fn cos(&self) -> f64 {
        1.0 - self.delta
    }

    fn area(&self) -> f64 {
        const SERIES: [f64; 10] = [
            0.666_666_666_666_666_6,
            -0.133_333_333_333_333_33,
            0.012_698_412_698_412_698,
            -0.000_705_467_372_134_038_8,
            2.565_335_898_669_232e-5,
            -6.577_784_355_562_133e-7,
            1.252_911_305_821_358_7e-8,
            -1.842_516_626_207_880_4e-10,
            2.154_990_206_091_088_2e-12,
            -2.052_371_624_848_655_7e-14,
        ];
        if self.alpha < SERIES_BELOW {
            series(self.alpha, 3, &SERIES)
        } else {
            self.alpha - self.sin * self.cos()
        }
    }

    fn k0(&self) -> f64 {
        const SERIES: [f64; 10] = [
            0.133_333_333_333_333_33,
            -0.034_920_634_920_634_92,
            0.004_497_354_497_354_497,
            -0.000_369_568_702_902_036_24,
            2.133_411_855_634_078e-5,
            -9.143_927_794_721_446e-7,
            3.025_595_832_162_903_4e-8,
            -7.962_104_817_578_651e-10,
            1.706_165_599_902_919_4e-11,
            -3.034_681_958_951_251_4e-13,
        ];
        if self.alpha < SERIES_BELOW {
            series(self.alpha, 5, &SERIES)
        } else {
            2.0 / 3.0 * self.sin.powi(3) - self.cos() * self.area()
        }
    }

    /// `int_0^alpha cos^2 sin^2`.
    fn squares(&self) -> f64 {
        let (s, c) = (self.sin, self.cos());
        0.125 * (self.alpha - s * c * (c * c - s * s))
    }

    fn e1(&self) -> f64 {
        const SERIES: [f64; 10] = [
            0.028_571_428_571_428_57,
            -0.010_317_460_317_460_317,
            0.001_810_966_810_966_811,
            -0.000_202_968_327_968_327_96,
            1.618_784_654_498_94e-5,
            -9.759_423_712_504_944e-7,
            4.627_955_057_030_196e-8,
            -1.776_321_193_509_974_5e-9,
            5.640_445_213_416_229e-11,
            -1.507_660_267_470_532e-12,
        ];
        if self.alpha < SERIES_BELOW {
            series(self.alpha, 7, &SERIES)
        } else {
            self.k0() - 2.0 * self.squares() + 2.0 / 3.0 * self.cos() * self.sin.powi(3)
        }
    }

    fn k2(&self) -> f64 {
        const SERIES: [f64; 10] = [
            0.019_047_619_047_619_05,
            -0.006_349_206_349_206_349,
            0.001_038_961_038_961_039,
            -0.000_110_506_777_173_443_83,
            8.513_532_323_056_133e-6,
            -5.024_542_839_668_89e-7,
            2.352_926_056_520_554_6e-8,
            -8.965_990_680_313_836e-10,
            2.835_314_895_094_774e-11,
            -7.561_001_963_068_924e-13,
        ];
        if self.alpha < SERIES_BELOW {
            series(self.alpha, 7, &SERIES)
        } else {
            let c = self.cos();
            self.squares() - 2.0 / 3.0 * c * self.sin.powi(3) + 0.5 * c * c * self.area()
        }
    }

    /// Moment of the segment about its outermost point: `S - 2/3 sin^3`.
    fn moment(&self) -> f64 {
        const SERIES: [f64; 10] = [
            0.2,
            -0.059_523_809_523_809_52,
            0.008_333_333_333_333_333,
            -0.000_713_985_088_985_089,
            4.201_431_284_764_618e-5,
            -1.816_277_857_944_524_5e-6,
            6.032_775_494_726_941e-8,
            -1.590_266_269_252_508e-9,
            3.410_278_906_472_754_7e-11,
            -6.067_741_506_760_515e-13,
        ];
        if self.alpha < SERIES_BELOW {
            series(self.alpha, 5, &SERIES)
        } else {
            self.area() - 2.0 / 3.0 * self.sin.powi(3)
        }
    }
}

/// Gauss-Legendre nodes and weights on [0, 1], 6 points (Abramowitz and Stegun 1964, table 25.4).
const NODES: [(f64, f64); 6] = [
    (0.033_765_242_898_423_975, 0.085_662_246_189_585_17),
    (0.169_395_306_766_867_76, 0.180_380_786_524_069_3),
    (0.380_690_406_958_401_5, 0.233_956_967_286_345_53),
    (0.619_309_593_041_598_5, 0.233_956_967_286_345_53),
    (0.830_604_693_233_132_3, 0.180_380_786_524_069_3),
    (0.966_234_757_101_576, 0.085_662_246_189_585_17),
];

/// A tilted cylinder of unit radius.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tilted {
    length: f64,
    /// `D = L cot(theta)`: how far the surface moves sideways from bottom to lid.
    shift: f64,
    tangent: f64,
}

/// Volume and the centre of mass's distances from the lowest line of the wall and from the bottom.
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

    /// The wedges at bottom and lid; the second is empty where the surface does not reach the lid.
    fn ends(&self, delta: f64) -> (Segment, Segment) {
        (Segment::of_delta(delta), Segment::of_delta((delta - self.shift).max(0.0)))
    }

    /// Volume of the liquid whose surface meets the bottom at `x = 1 - delta`, and its derivative by `delta`.
    pub(super) fn volume(&self, delta: f64) -> (f64, f64) {
        let (near, far) = self.ends(delta);
        let (k0, k1) = (near.k0(), far.k0());
        if k1 > NEARLY_ALIKE * k0 {
            let slices = |of: fn(&Segment) -> f64| -> f64 {
                NODES.iter().map(|(t, w)| w * of(&Segment::of_delta(delta - self.shift * t))).sum()
            };
            return (self.length * slices(Segment::area), self.length * slices(|s| 2.0 * s.sin));
        }
        (self.tangent * (k0 - k1), self.tangent * (near.area() - far.area()))
    }

    /// The `delta` of a volume, by Newton's method in logarithms, between brackets.
    pub(super) fn delta_of(&self, volume: f64) -> f64 {
        // Both bounds on the volume (no lid; all slices like the lowest one) give a delta that is too small.
        let wedge = (7.5 * volume / self.tangent).powf(0.4) * 0.5;
        let prism = (1.5 * volume / self.length).powf(2.0 / 3.0) * 0.5;
        let mut delta = wedge.max(prism).clamp(f64::MIN_POSITIVE, 2.0);
        let (mut low, mut high) = (0.0, 2.0);
        for _ in 0..60 {
            let (value, slope) = self.volume(delta);
            if value < volume {
                low = delta;
            } else {
                high = delta;
            }
            let power = delta * slope / value;
            let next = delta * ((volume / value).ln() / power).exp();
            let next = if next >= low && next <= high { next } else { 0.5 * (low + high) };
            // Convergence is quadratic: what is close now is exact after this step.
            let close = (next - delta).abs() <= 1e-8 * delta;
            delta = next;
            if close {
                break;
            }
        }
        delta
    }

    /// The centre of mass of the liquid whose surface meets the bottom at `x = 1 - delta`.
    pub(super) fn center(&self, delta: f64) -> Sums {
        let (near, far) = self.ends(delta);
        let (k0, k1) = (near.k0(), far.k0());
        if k1 > NEARLY_ALIKE * k0 {
            let (mut area, mut moment, mut height) = (0.0, 0.0, 0.0);
            for (t, w) in NODES {
                let slice = Segment::of_delta(delta - self.shift * t);
                let wet = w * slice.area();
                area += wet;
                height += wet * t;
                moment += w * slice.moment();
            }
            return Sums { from_wall: moment / area, from_bottom: self.length * height / area };
        }
        let volume = k0 - k1;
        Sums {
            from_wall: (near.e1() - far.e1()) / volume,
            from_bottom: self.tangent * (near.k2() - far.k2() - self.shift * k1) / volume,
        }
    }
}
