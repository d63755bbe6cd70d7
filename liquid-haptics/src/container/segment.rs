//! Segments of a circle, and the sums of them that make a wedge: by power series where they are small.

/// Angles below this one have their functions as series.
const SERIES_BELOW: f64 = 1.0;
/// A segment of the unit circle by half its angle `alpha`, and the functions that `wedge` sums.
#[derive(Debug, Clone, Copy)]
pub(super) struct Segment {
    alpha: f64,
    pub(super) sin: f64,
    /// 1 - cos.
    delta: f64,
}

/// `alpha^power` times a polynomial in `alpha^2`, its terms paired so that they do not wait for each other (Estrin 1960).
#[inline]
fn series(alpha: f64, power: i32, c: &[f64; 10]) -> f64 {
    let x = alpha * alpha;
    let (x2, x4) = (x * x, x * x * x * x);
    let low = (c[0] + c[1] * x) + x2 * (c[2] + c[3] * x);
    let middle = (c[4] + c[5] * x) + x2 * (c[6] + c[7] * x);
    alpha.powi(power) * (low + x4 * (middle + x4 * (c[8] + c[9] * x)))
}

impl Segment {
    pub(super) fn of_delta(delta: f64) -> Self {
        let delta = delta.clamp(0.0, 2.0);
        Self { alpha: 2.0 * (0.5 * delta).sqrt().asin(), sin: (delta * (2.0 - delta)).sqrt(), delta }
    }

    pub(super) fn cos(&self) -> f64 {
        1.0 - self.delta
    }

    pub(super) fn area(&self) -> f64 {
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

    pub(super) fn k0(&self) -> f64 {
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

    pub(super) fn e1(&self) -> f64 {
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

    pub(super) fn k2(&self) -> f64 {
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
    pub(super) fn moment(&self) -> f64 {
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
