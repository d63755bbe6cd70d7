//! One particle: a ball, the sounds of a throw that it takes for misheard, and a Gaussian over place and velocity that follows from both.
//!
//! With the speed across the table `w` and along it `v` before an impact, e and kappa, directions scatter by small angles of variance
//! `1/kappa` forward and to the left. To first order
//!
//! `w' = e (w (1 - 1/kappa) - |v| forward)`, `v' = e (v (1 - 1/kappa) + w forward f + sqrt(v^2 + w^2) left l)`
//!
//! with f along the flight and l to its left, and the next flight lasts `2 w'/g`: heard durations say how far forward the ball was turned,
//! heard places are linear in the state.

use nalgebra::{Matrix2, Matrix4, Matrix4x2, Vector2, Vector4};
use std::f64::consts::{PI, TAU};

/// Log density that stands for none.
const NEVER: f64 = -1e4;

/// What all particles share.
#[derive(Debug, Clone, Copy)]
pub(super) struct Known {
    pub(super) gravity_m_s2: f64,
    /// Relative standard deviation of a speed after an impact, beyond restitution and scatter.
    pub(super) speed_sigma: f64,
    /// Standard deviation of a heard time, s.
    pub(super) time_sigma_s: f64,
    /// Median duration of the first flight, s, and the standard deviation of its logarithm.
    pub(super) first_flight: [f64; 2],
}

/// A ball on its way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Particle {
    pub(super) restitution: f64,
    pub(super) kappa: f64,
    /// Place of the last impact, m, and velocity along the table before it, m/s.
    pub(super) mean: Vector4<f64>,
    pub(super) covariance: Matrix4<f64>,
    /// When the last impact was, s.
    pub(super) t_s: f64,
    /// Speed across the table before the last impact, m/s; `None` before a flight was heard: the velocity is the one after it then.
    pub(super) down_m_s: Option<f64>,
    /// A bit for each sound that is taken for misheard, or for no impact.
    pub(super) misheard: u64,
}

impl Particle {
    fn velocity(&self) -> Vector2<f64> {
        self.mean.fixed_rows::<2>(2).into()
    }

    /// Unit vector of the flight; along x where the ball goes straight up.
    pub(super) fn forward(&self) -> Vector2<f64> {
        self.velocity().try_normalize(1e-9).unwrap_or_else(Vector2::x)
    }

    /// Flies to the next impact in a duration (s); the log density of that duration, per second.
    pub(super) fn fly(&mut self, duration_s: f64, known: &Known) -> f64 {
        let g = known.gravity_m_s2;
        self.t_s += duration_s;
        let Some(down) = self.down_m_s.replace(0.5 * g * duration_s) else {
            let [median, sigma] = known.first_flight;
            let off = (duration_s / median).ln() / sigma;
            self.spread(duration_s, 1.0, Vector2::zeros(), Matrix2::zeros());
            return -0.5 * (off * off + TAU.ln()) - (sigma * duration_s).ln();
        };
        let (e, scatter, f) = (self.restitution, 1.0 / self.kappa, self.forward());
        let speed = self.velocity().norm();
        // The square of the speed along the table as it is known.
        let along = speed * speed + self.covariance[(2, 2)] + self.covariance[(3, 3)];
        let lean = down * (1.0 - scatter) - 0.5 * g * duration_s / e;
        let clock = 0.5 * g * known.time_sigma_s / e;
        let loose = down * down * (known.speed_sigma.powi(2) + scatter * scatter) + clock * clock;
        let variance = along * scatter + loose;
        let gain = speed * scatter / variance;
        let left = scatter * (1.0 - gain * speed).max(0.0);
        let across = down * down;
        let l = Vector2::new(-f[1], f[0]);
        let noise = (f * f.transpose() * (across * left + speed * speed * known.speed_sigma.powi(2))
            + l * l.transpose() * ((along + across) * scatter))
            * (e * e);
        self.spread(duration_s, e * (1.0 - scatter), f * (e * down * gain * lean), noise);
        -0.5 * (lean * lean / variance + (TAU * variance).ln()) + (0.5 * g / e).ln()
    }

    /// Velocity times `kept`, plus `push` and noise; then the flight.
    fn spread(&mut self, duration_s: f64, kept: f64, push: Vector2<f64>, noise: Matrix2<f64>) {
        let mut step = Matrix4::identity();
        for k in 0..2 {
            step[(k, k + 2)] = kept * duration_s;
            step[(k + 2, k + 2)] = kept;
        }
        let mut enter = Matrix4x2::zeros();
        enter.fixed_view_mut::<2, 2>(0, 0).fill_diagonal(duration_s);
        enter.fixed_view_mut::<2, 2>(2, 0).fill_diagonal(1.0);
        self.mean = step * self.mean + enter * push;
        self.covariance = step * self.covariance * step.transpose() + enter * noise * enter.transpose();
    }

    /// Flies to an impact that was heard (s), with impacts in between that were not; the log density of the time, per second.
    pub(super) fn reach(&mut self, at_s: f64, unheard: u32, known: &Known) -> f64 {
        let total = at_s - self.t_s;
        let parts: f64 = (0..=unheard).map(|k| self.restitution.powi(k as i32)).sum();
        let mut part = total / parts;
        if !(part > 1e-3 && parts.is_finite()) {
            return NEVER;
        }
        let ln_density = self.fly(part, known) - parts.ln();
        for _ in 0..unheard {
            part *= self.restitution;
            self.fly(part, known);
        }
        // What rounding left.
        self.t_s = at_s;
        ln_density
    }

    /// Takes the place (m) where the last impact was heard with a standard deviation (m); its log density, per m^2.
    pub(super) fn place(&mut self, place_m: [f64; 2], sigma_m: f64) -> f64 {
        let off = Vector2::from(place_m) - self.mean.fixed_rows::<2>(0);
        let seen = self.covariance.fixed_view::<2, 2>(0, 0) + Matrix2::identity() * (sigma_m * sigma_m);
        let Some(inverse) = seen.try_inverse() else { return NEVER };
        let gain = self.covariance.fixed_columns::<2>(0) * inverse;
        self.mean += gain * off;
        let rows = self.covariance.fixed_rows::<2>(0).into_owned();
        self.covariance -= gain * rows;
        // Symmetric whatever the rounding.
        self.covariance = (self.covariance + self.covariance.transpose()) * 0.5;
        -0.5 * off.dot(&(inverse * off)) - 0.5 * seen.determinant().ln() - (2.0 * PI).ln()
    }
}
