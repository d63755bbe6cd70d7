//! An arm that is late, and has limits of speed and acceleration.

/// What the arm can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmLimits {
    /// From a command to the first motion, s.
    pub latency_s: f64,
    /// Speed, m/s.
    pub speed_m_s: f64,
    /// Acceleration, m/s^2.
    pub acceleration_m_s2: f64,
    /// Least and greatest coordinate along each axis, m.
    pub reach_m: [[f64; 2]; 3],
}

/// The paddle's motion: polynomials of fifth degree in time that end at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct PaddleArm {
    limits: ArmLimits,
    before: Motion,
    now: Motion,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Motion {
    from_s: f64,
    duration_s: f64,
    coefficients: [[f64; 6]; 3],
}

impl Motion {
    fn rest(at: [f64; 3]) -> Self {
        let still = |p| [p, 0.0, 0.0, 0.0, 0.0, 0.0];
        Self { from_s: f64::NEG_INFINITY, duration_s: 0.0, coefficients: at.map(still) }
    }

    /// From a state (place, velocity, acceleration an axis) to rest.
    fn to(state: [[f64; 3]; 3], goal: [f64; 3], from_s: f64, d: f64) -> Self {
        let axis = |k: usize| {
            let [p, v, a] = state[k];
            // With s = t/d: p + v d s + a d^2/2 s^2 + c3 s^3 + c4 s^4 + c5 s^5 ends at the goal with no speed and no acceleration.
            let (v, a) = (v * d, 0.5 * a * d * d);
            let (end, rate, bend) = (goal[k] - p - v - a, -v - 2.0 * a, -2.0 * a);
            let c3 = 10.0 * end - 4.0 * rate + 0.5 * bend;
            let c4 = -15.0 * end + 7.0 * rate - bend;
            let c5 = 6.0 * end - 3.0 * rate + 0.5 * bend;
            [p, v, a, c3, c4, c5]
        };
        Self { from_s, duration_s: d, coefficients: [axis(0), axis(1), axis(2)] }
    }

    /// Place, velocity and acceleration of each axis.
    fn at(&self, t_s: f64) -> [[f64; 3]; 3] {
        let d = self.duration_s;
        if d == 0.0 {
            return self.coefficients.map(|c| [c[0], 0.0, 0.0]);
        }
        let s = ((t_s - self.from_s) / d).clamp(0.0, 1.0);
        self.coefficients.map(|c| {
            let horner = |w: [f64; 6]| c.iter().zip(w).rev().fold(0.0, |sum, (c, w)| sum * s + c * w);
            let place = horner([1.0; 6]);
            let rate = (1..6).rev().fold(0.0, |sum, k| sum * s + k as f64 * c[k]);
            let bend = (2..6).rev().fold(0.0, |sum, k| sum * s + (k * (k - 1)) as f64 * c[k]);
            [place, rate / d, bend / (d * d)]
        })
    }
}

impl PaddleArm {
    /// At rest at a place, m.
    pub fn new(limits: ArmLimits, at_m: [f64; 3]) -> Self {
        let rest = Motion::rest(at_m);
        Self { limits, before: rest, now: rest }
    }

    fn motion(&self, t_s: f64) -> &Motion {
        if t_s < self.now.from_s { &self.before } else { &self.now }
    }

    /// Place and velocity at a time.
    pub fn at(&self, t_s: f64) -> ([f64; 3], [f64; 3]) {
        let state = self.motion(t_s).at(t_s);
        (state.map(|s| s[0]), state.map(|s| s[1]))
    }

    /// Whether it stands still from a time on.
    pub fn is_still(&self, t_s: f64) -> bool {
        t_s >= self.now.from_s + self.now.duration_s
    }

    /// Whether a place is within reach.
    pub fn reaches(&self, goal_m: [f64; 3]) -> bool {
        (0..3).all(|k| (self.limits.reach_m[k][0]..=self.limits.reach_m[k][1]).contains(&goal_m[k]))
    }

    /// Commands a place at time `t_s` to be reached within `deadline_s`; `false`, and nothing changes, where its limits do not let it.
    pub fn command(&mut self, t_s: f64, goal_m: [f64; 3], deadline_s: f64) -> bool {
        let from_s = t_s + self.limits.latency_s;
        let duration = deadline_s - self.limits.latency_s;
        if !(duration > 1e-3) {
            return false;
        }
        let running = *self.motion(t_s);
        let next = Motion::to(self.motion(from_s).at(from_s), goal_m, from_s, duration);
        let norm = |state: &[[f64; 3]; 3], k: usize| state.iter().map(|s| s[k] * s[k]).sum::<f64>().sqrt();
        for i in 0..=32 {
            let state = next.at(from_s + duration * f64::from(i) / 32.0);
            // Rounding of a motion that is at its limit already does not count.
            if norm(&state, 1) > 1.001 * self.limits.speed_m_s
                || norm(&state, 2) > 1.001 * self.limits.acceleration_m_s2
            {
                return false;
            }
        }
        (self.before, self.now) = (running, next);
        true
    }
}
