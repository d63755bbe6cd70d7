//! A pendulum that swings freely, seen by an encoder.

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

use crate::GRAVITY_M_S2;
use crate::noise::Noise;

/// Friction of the pendulum, as angular accelerations.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Friction {
    /// Viscous: `-2 c w`, c in 1/s.
    pub viscous_per_s: f64,
    /// Drag: `-q |w| w`, q in 1/rad.
    pub quadratic: f64,
    /// Dry, in the bearing: `-f sign(w)`, f in rad/s^2.
    pub dry_rad_s2: f64,
}

/// A pendulum that is let go once in each run.
#[derive(Debug, Clone, PartialEq)]
pub struct PendulumWorld {
    /// Reduced length, m.
    pub length_m: f64,
    /// Its friction.
    pub friction: Friction,
    /// Angle from which the pendulum is released in each run, rad.
    pub released_rad: Vec<f64>,
    /// Rows of a run.
    pub rows: usize,
    /// Readings a second.
    pub rate_hz: f64,
    /// Noise of the encoder.
    pub noise: Noise,
}

/// Steps of the integrator between two rows.
const STEPS: usize = 50;

impl PendulumWorld {
    /// The angles of one run without noise: velocity Verlet, dry friction by its exact stop within a step.
    fn swing(&self, released_rad: f64) -> Vec<f64> {
        let step = 1.0 / self.rate_hz / STEPS as f64;
        let f = &self.friction;
        let smooth = |angle: f64, w: f64| {
            -GRAVITY_M_S2 / self.length_m * angle.sin() - (2.0 * f.viscous_per_s + f.quadratic * w.abs()) * w
        };
        let (mut angle, mut w) = (released_rad, 0.0);
        let mut angles = Vec::with_capacity(self.rows);
        for _ in 0..self.rows {
            angles.push(angle);
            for _ in 0..STEPS {
                let pull = smooth(angle, w);
                let half = w + 0.5 * step * pull;
                angle += step * half;
                let pushed = half + 0.5 * step * smooth(angle, half);
                let brake = f.dry_rad_s2 * step;
                w = if pushed.abs() > brake { pushed - brake * pushed.signum() } else { 0.0 };
            }
        }
        angles
    }

    /// The recording as a CSV: `run, t_s, angle_rad`.
    pub fn csv(&self, seed: u64) -> String {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut text = String::from("run,t_s,angle_rad\n");
        for (run, released) in self.released_rad.iter().enumerate() {
            let mut angles = self.swing(*released);
            self.noise.apply(&mut angles, &mut rng);
            for (row, angle) in angles.iter().enumerate() {
                let t = row as f64 / self.rate_hz;
                text.push_str(&format!("{},{t:.4},{angle:.5}\n", run + 1));
            }
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn world(friction: Friction) -> PendulumWorld {
        let noise = Noise::white(0.0);
        PendulumWorld { length_m: 0.5, friction, released_rad: vec![0.4], rows: 400, rate_hz: 50.0, noise }
    }

    #[test]
    fn without_friction_the_period_is_that_of_the_elliptic_integral() {
        let angles = world(Friction::default()).swing(0.4);
        // T = 2 pi sqrt(l/g) (1 + a^2/16 + 11 a^4/3072), a = 0.4.
        let period = std::f64::consts::TAU
            * (0.5f64 / GRAVITY_M_S2).sqrt()
            * (1.0 + 0.4f64.powi(2) / 16.0 + 11.0 * 0.4f64.powi(4) / 3072.0);
        let down = |k: usize| angles[k] > 0.0 && angles[k + 1] <= 0.0;
        let crossings: Vec<f64> = (0..angles.len() - 1)
            .filter(|&k| down(k))
            .map(|k| (k as f64 + angles[k] / (angles[k] - angles[k + 1])) / 50.0)
            .collect();
        let measured = (crossings[crossings.len() - 1] - crossings[0]) / (crossings.len() - 1) as f64;
        approx::assert_relative_eq!(measured, period, max_relative = 1e-4);
        assert!(angles.iter().all(|a| a.abs() <= 0.4 + 1e-9));
    }

    #[test]
    fn each_friction_shrinks_the_swing_by_its_own_law() {
        let largest = |friction: Friction| {
            let angles = world(friction).swing(0.4);
            angles[350..].iter().fold(0.0, |m: f64, a| m.max(a.abs()))
        };
        // Viscous: exp(-c t) at about 7.5 s; dry: 2 f l/g a half swing, here some 10.5 of them.
        let viscous = largest(Friction { viscous_per_s: 0.1, ..Friction::default() });
        assert!((viscous / 0.4 - (-0.75f64).exp()).abs() < 0.03, "{viscous}");
        let dry = largest(Friction { dry_rad_s2: 0.1, ..Friction::default() });
        assert!((0.4 - dry - 10.5 * 2.0 * 0.1 * 0.5 / GRAVITY_M_S2).abs() < 0.01, "{dry}");
    }
}
