//! What acts on a ball in flight.

use num_dual::DualNum;

/// Position in m and velocity in m/s in a frame whose z points up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State<T> {
    /// Position in m.
    pub position: [T; 3],
    /// Velocity in m/s.
    pub velocity: [T; 3],
}

/// What acts on the ball, each as an acceleration: generic over `f64` and dual numbers, so that derivatives are exact.
///
/// `a = g + constant - (quadratic |u| + cubic |u|^2 + linear) u + lift x v - stiffness (p - anchor)`, `u = v - wind`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flight<T> {
    /// Gravity, downwards along -z, in m/s^2.
    pub gravity_m_s2: f64,
    /// Quadratic drag in 1/m, zero or more.
    pub quadratic_per_m: T,
    /// Linear drag in 1/s, zero or more.
    pub linear_per_s: T,
    /// Cubic drag in s/m^2.
    pub cubic_s_per_m2: T,
    /// Constant acceleration in m/s^2 (buoyancy is its z).
    pub constant_m_s2: [T; 3],
    /// Lift in 1/s: the acceleration is `lift x v`.
    pub lift_per_s: [T; 3],
    /// Velocity of the air in m/s.
    pub wind_m_s: [T; 3],
    /// Acceleration per distance from where the flight began, along each axis, in 1/s^2.
    pub stiffness_per_s2: [T; 3],
}

impl<T: DualNum<Primitive = f64, Real = f64> + Copy> Flight<T> {
    /// Free fall: gravity alone.
    pub fn ballistic(gravity_m_s2: f64) -> Self {
        let (zero, none) = (T::from(0.0), [T::from(0.0); 3]);
        Self {
            gravity_m_s2,
            quadratic_per_m: zero,
            linear_per_s: zero,
            cubic_s_per_m2: zero,
            constant_m_s2: none,
            lift_per_s: none,
            wind_m_s: none,
            stiffness_per_s2: none,
        }
    }

    /// Acceleration in m/s^2 at a state, the flight having begun at `origin`.
    pub fn acceleration(&self, state: &State<T>, origin: &[T; 3]) -> [T; 3] {
        let v = &state.velocity;
        let mut u = *v;
        for (u, w) in u.iter_mut().zip(&self.wind_m_s) {
            *u -= *w;
        }
        let square = u[0] * u[0] + u[1] * u[1] + u[2] * u[2];
        // The root's derivative is infinite at rest, where drag vanishes with its derivative.
        let speed = if square.re() > 0.0 { square.sqrt() } else { T::from(0.0) };
        let drag = self.quadratic_per_m * speed + self.cubic_s_per_m2 * square + self.linear_per_s;
        let l = &self.lift_per_s;
        let lift = [l[1] * v[2] - l[2] * v[1], l[2] * v[0] - l[0] * v[2], l[0] * v[1] - l[1] * v[0]];
        let mut a = self.constant_m_s2;
        for i in 0..3 {
            a[i] += lift[i] - drag * u[i] - self.stiffness_per_s2[i] * (state.position[i] - origin[i]);
        }
        a[2] -= T::from(self.gravity_m_s2);
        a
    }
}
