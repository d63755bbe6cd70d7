//! The linear motion of a damped mode in closed form.

/// Spacings of rows that differ by less, relatively, are the same but for rounding.
pub(super) const EVEN: f64 = 1e-11;

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
