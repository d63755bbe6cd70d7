//! The first mode as an oscillator in the world's horizontal direction, driven by how the container is moved.

/// Steps of the integrator, s, at most.
const STEP_S: f64 = 5e-4;
/// A wave breaks where the sloshing mass has moved this share of the radius.
const BREAKS: f64 = 0.5;

/// The equivalent mechanical oscillator of the first mode (Dodge 2000, ch. 3; Abramson 1966, NASA SP-106, ch. 6).
#[derive(Debug, Clone)]
pub(super) struct Slosh {
    omega: f64,
    gamma: f64,
    /// Mass that swings, kg.
    pub(super) mass_kg: f64,
    limit_m: f64,
    /// The swinging mass's displacement from where a level surface has it, m, and its speed, m/s.
    state: [f64; 2],
}

impl Slosh {
    /// The mode of an upright cylinder of a radius and a level (m) with a mass (kg) of a kinematic viscosity (m^2/s) in it.
    pub(super) fn new(radius: f64, level: f64, mass: f64, viscosity: f64, gravity: f64) -> Self {
        let depth = level / radius;
        let (k, x) = (1.8412 * depth, 1.84 * depth);
        // Mikishev and Dorozhkin's damping, as [Matl 2021], eq. 2.4, should read.
        #[allow(clippy::approx_constant, reason = "the law's fitted coefficient, not 1/pi")]
        let shallow = 0.318 / x.sinh() * (1.0 + (1.0 - depth) / x.cosh());
        let deep = 0.79 * (viscosity / (radius * (radius * gravity).sqrt())).sqrt();
        let share = if depth > 0.0 { k.tanh() / (2.199 * depth) } else { 0.0 };
        Self {
            omega: (1.8412 * gravity / radius * k.tanh()).sqrt(),
            gamma: (deep * (1.0 + if x < 300.0 { shallow } else { 0.0 })).min(0.99),
            mass_kg: mass * share,
            limit_m: BREAKS * radius,
            state: [0.0; 2],
        }
    }

    fn pull(&self, [x, v]: [f64; 2]) -> f64 {
        -self.omega * self.omega * x - 2.0 * self.gamma * self.omega * v
    }

    /// Goes on by a time (s) in which the container is moved with a horizontal acceleration (m/s^2).
    pub(super) fn advance(&mut self, duration_s: f64, acceleration_m_s2: f64) {
        if self.mass_kg == 0.0 || !(duration_s > 0.0) {
            return;
        }
        let steps = (duration_s / STEP_S).ceil().max(1.0);
        let h = duration_s / steps;
        for _ in 0..steps as usize {
            let [x, v] = self.state;
            // Velocity at half steps, the damping taken at their middle.
            let half = v + 0.5 * h * (self.pull([x, v]) - acceleration_m_s2);
            let x = x + h * half;
            let pull = -self.omega * self.omega * x - acceleration_m_s2;
            let v = (half + 0.5 * h * pull) / (1.0 + self.gamma * self.omega * h);
            self.state = if x.abs() > self.limit_m { [self.limit_m.copysign(x), 0.0] } else { [x, v] };
        }
    }

    /// Displacement of the swinging mass, m, and the force with which it pushes the container, N.
    pub(super) fn felt(&self) -> [f64; 2] {
        [self.state[0], -self.mass_kg * self.pull(self.state)]
    }
}
