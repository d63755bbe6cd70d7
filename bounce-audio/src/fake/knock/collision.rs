//! The force between a ball and a table, by integration: contact with a loss (Kuwabara and Kono 1987, doi:10.1143/JJAP.26.1230) on a
//! plate that gives way (Zener 1941, doi:10.1103/PhysRev.59.669).
//!
//! `m x'' = -F`, `w' = F / Z`, `d = x - w`, `F = k (d^p + p A d^(p-1) d')`, never below zero: a solid ball has `p = 3/2`, the wall of a
//! hollow one `p = 1` (Reissner 1946, *J. Math. Phys.* 25, 279).

/// Steps of the integration over the time that the ball takes to come to a stop, about.
const STEPS: f64 = 120.0;
/// Steps at most: a ball that has not left by then stays.
const MOST: usize = 4000;

/// A ball against a table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Contact {
    /// The ball's mass, kg.
    pub(super) mass_kg: f64,
    /// Stiffness, N/m^p.
    pub(super) stiffness: f64,
    /// Power of the compression.
    pub(super) power: f64,
    /// Time of the contact's loss, s.
    pub(super) loss_s: f64,
    /// The plate's mechanical impedance, N s/m; infinite for a rigid floor.
    pub(super) impedance: f64,
}

/// What a collision did.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Collision {
    /// Mean force in each interval of the time that was asked for, N.
    pub(super) force_n: Vec<f64>,
    /// Speed away from the table, m/s.
    pub(super) rebound_m_s: f64,
    /// How long the force lasted, s.
    pub(super) duration_s: f64,
}

impl Contact {
    fn force(&self, state: &[f64; 3]) -> f64 {
        let [x, v, w] = *state;
        let d = x - w;
        if d <= 0.0 {
            return 0.0;
        }
        // d' = v - F/Z makes the force implicit; it is linear in F.
        let elastic = self.stiffness * d.powf(self.power);
        let damping = self.stiffness * self.power * self.loss_s * d.powf(self.power - 1.0);
        ((elastic + damping * v) / (1.0 + damping / self.impedance)).max(0.0)
    }

    /// The collision at a speed (m/s), its force averaged over intervals of a length (s).
    pub(super) fn collide(&self, speed_m_s: f64, interval_s: f64) -> Collision {
        let energy = 0.5 * self.mass_kg * speed_m_s * speed_m_s;
        let deepest = (energy * (self.power + 1.0) / self.stiffness).powf(1.0 / (self.power + 1.0));
        let dt = deepest / speed_m_s / STEPS;
        let slope = |s: &[f64; 3]| {
            let force = self.force(s);
            [s[1], -force / self.mass_kg, force / self.impedance]
        };
        let ahead =
            |s: &[f64; 3], by: f64, k: &[f64; 3]| -> [f64; 3] { std::array::from_fn(|i| s[i] + by * k[i]) };
        let mut state = [0.0, speed_m_s, 0.0];
        let (mut force_n, mut last) = (vec![0.0; 1], 0.0);
        for step in 0..MOST {
            let a = slope(&state);
            let b = slope(&ahead(&state, 0.5 * dt, &a));
            let c = slope(&ahead(&state, 0.5 * dt, &b));
            let d = slope(&ahead(&state, dt, &c));
            let gone = state[1];
            state = std::array::from_fn(|i| state[i] + dt / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
            let t = (step as f64 + 0.5) * dt;
            let at = (t / interval_s) as usize;
            if at >= force_n.len() {
                force_n.resize(at + 1, 0.0);
            }
            // The impulse is what the ball lost.
            let impulse = self.mass_kg * (gone - state[1]);
            force_n[at] += impulse / interval_s;
            if impulse > 0.0 {
                last = t;
            }
            if state[1] < 0.0 && self.force(&state) == 0.0 {
                break;
            }
        }
        Collision { force_n, rebound_m_s: (-state[1]).max(0.0), duration_s: last }
    }

    /// The same with the loss that gives a restitution at 1 m/s on a rigid floor.
    pub(super) fn with_restitution(self, restitution: f64) -> Self {
        let rigid = Self { impedance: f64::INFINITY, ..self };
        let deepest =
            (0.5 * self.mass_kg * (self.power + 1.0) / self.stiffness).powf(1.0 / (self.power + 1.0));
        let (mut low, mut high) = (0.0, 4.0 * deepest);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if (Self { loss_s: middle, ..rigid }).collide(1.0, 1.0).rebound_m_s > restitution {
                low = middle;
            } else {
                high = middle;
            }
        }
        Self { loss_s: 0.5 * (low + high), ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A steel ball of 10 mm on a rigid floor at 1 m/s: Hertz's time is 2.868 (m^2 / (R E*^2 v))^(1/5) (Johnson 1985, *Contact Mechanics*,
    /// equation 11.24).
    #[test]
    fn without_a_loss_it_is_hertz_s() {
        let (radius, modulus) = (5e-3, 230e9);
        let mass = 4.0 / 3.0 * std::f64::consts::PI * 1.25e-7 * 7810.0;
        let contact = Contact {
            mass_kg: mass,
            stiffness: 4.0 / 3.0 * modulus * f64::sqrt(radius),
            power: 1.5,
            loss_s: 0.0,
            impedance: f64::INFINITY,
        };
        let collision = contact.collide(1.0, 1e-6);
        let hertz = 2.868 * (mass * mass / (radius * modulus * modulus)).powf(0.2);
        approx::assert_relative_eq!(collision.duration_s, hertz, max_relative = 0.01);
        approx::assert_relative_eq!(collision.rebound_m_s, 1.0, max_relative = 1e-4);
        let impulse: f64 = collision.force_n.iter().sum::<f64>() * 1e-6;
        approx::assert_relative_eq!(impulse, 2.0 * mass, max_relative = 1e-4);
    }

    /// The loss that gives a restitution is found, a faster ball loses more to it, and a plate that gives way takes more.
    #[test]
    fn losses_of_contact_and_plate_add() {
        let contact =
            Contact { mass_kg: 5e-3, stiffness: 1e9, power: 1.5, loss_s: 0.0, impedance: f64::INFINITY };
        let lossy = contact.with_restitution(0.7);
        let left = |c: &Contact, v: f64| c.collide(v, 1e-6).rebound_m_s / v;
        approx::assert_relative_eq!(left(&lossy, 1.0), 0.7, max_relative = 1e-3);
        assert!(left(&lossy, 4.0) < left(&lossy, 1.0) - 0.02);
        let plate = Contact { impedance: 300.0, ..lossy };
        assert!(left(&plate, 1.0) < 0.68, "{}", left(&plate, 1.0));
    }
}
