//! The linear motion of a damped mode in closed form.

/// The linear motion over a time: position and speed after it from those before.
#[derive(Debug, Clone, Copy)]
pub(super) struct Propagator([f64; 4]);

impl Propagator {
    /// A mode of the angular frequency `w` (rad/s) without damping and a damping ratio, over `h` (s).
    pub(super) fn new(w: f64, ratio: f64, h: f64) -> Self {
        let damped = w * (1.0 - ratio * ratio).sqrt();
        let (sin, cos) = (damped * h).sin_cos();
        let (fade, tilt) = ((-ratio * w * h).exp(), ratio * w / damped);
        Self([
            fade * (cos + tilt * sin),
            fade * sin / damped,
            -fade * w * w / damped * sin,
            fade * (cos - tilt * sin),
        ])
    }

    pub(super) fn apply(&self, x: f64, v: f64) -> (f64, f64) {
        let m = &self.0;
        (m[0] * x + m[1] * v, m[2] * x + m[3] * v)
    }
}

/// Steps per radian of a mode within which its motion is a [`Series`].
pub(super) const STEPS_PER_RADIAN: f64 = 8.0;

/// A motion within a step, as a polynomial in the share of the step that has passed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Series([f64; 10]);

impl Series {
    /// The linear motion from a position and a speed, over a step of `h` (s); where `w h` is at most `1 / STEPS_PER_RADIAN`, the first
    /// term left out is below 1e-15 of the amplitude.
    pub(super) fn new(w: f64, ratio: f64, h: f64, [x, v]: [f64; 2]) -> Self {
        let (pull, drag) = (w * w * h * h, 2.0 * ratio * w * h);
        let mut terms = [x, v * h, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        for k in 0..8 {
            let n = (k + 1) as f64;
            terms[k + 2] = -(pull * terms[k] + drag * n * terms[k + 1]) / (n * (n + 1.0));
        }
        Self(terms)
    }

    /// With the polynomial of the fifth degree added whose value and slope are zero at the beginning, with this second derivative there,
    /// and this value, slope and second derivative at the end.
    pub(super) fn departing(mut self, begin: f64, [value, slope, second]: [f64; 3]) -> Self {
        let quadratic = 0.5 * begin;
        let (d0, d1, d2) = (value - quadratic, slope - begin, second - begin);
        self.0[2] += quadratic;
        self.0[3] += 10.0 * d0 - 4.0 * d1 + 0.5 * d2;
        self.0[4] += -15.0 * d0 + 7.0 * d1 - d2;
        self.0[5] += 6.0 * d0 - 3.0 * d1 + 0.5 * d2;
        self
    }

    /// The position where this share of the step, in [0, 1], has passed.
    pub(super) fn at(&self, share: f64) -> f64 {
        // Even and odd terms apart: two short chains of multiplications in place of a long one.
        let c = &self.0;
        let square = share * share;
        let even = (((c[8] * square + c[6]) * square + c[4]) * square + c[2]) * square + c[0];
        let odd = (((c[9] * square + c[7]) * square + c[5]) * square + c[3]) * square + c[1];
        odd * share + even
    }
}
