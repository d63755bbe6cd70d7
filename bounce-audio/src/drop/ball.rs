//! What an impact does to a ball: restitution, friction and spin, and the scatter of its direction.

use super::direction::Scatter;
use super::{DropError, Moving, Vector, cross, dot, positive_or_zero, value};
use rand::Rng;

/// What happens along the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Grip {
    /// As in [Matl 2021], appendix B.3: restitution takes its part of the whole velocity, and a further part `lost`, in [0, 1], of the
    /// speed along the table goes. Spin neither matters nor changes.
    Whole {
        /// Part of the speed along the table that is lost beyond restitution.
        lost: f64,
    },
    /// A rough sphere: restitution takes its part of the speed across the table only. Friction acts against the slip of the ball's
    /// underside until it stops, or comes back with the part `recoil` of it (Cross 2002, doi:10.1119/1.1507792), but its impulse is
    /// at most `friction` times the normal one.
    Rough {
        /// Coulomb's coefficient, zero or more.
        friction: f64,
        /// What the slip comes back with, in [-1, 1]: 0 rolls, 1 is a superball.
        recoil: f64,
        /// The ball's radius, m.
        radius_m: f64,
        /// Moment of inertia over `m r^2`: 0.4 of a solid ball, 2/3 of a thin shell.
        inertia: f64,
    },
}

/// A ball on a table, as far as impacts go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Restitution at 1 m/s, in [0, 1].
    pub restitution: f64,
    /// How fast restitution falls with the speed of the impact, s/m: `e = restitution - slope (v - 1 m/s)`, kept within [0, 1].
    pub slope_s_m: f64,
    /// How directions scatter.
    pub scatter: Scatter,
    /// What happens along the table.
    pub grip: Grip,
}

impl Ball {
    /// The ball of [Matl 2021], section 4.3: constant restitution of the whole velocity and von Mises-Fisher scatter.
    ///
    /// # Errors
    /// [`DropError::Value`].
    pub fn new(restitution: f64, kappa: f64) -> Result<Self, DropError> {
        let scatter = Scatter::new(kappa)?;
        let ball = Self { restitution, slope_s_m: 0.0, scatter, grip: Grip::Whole { lost: 0.0 } };
        ball.check().map(|()| ball)
    }

    /// Whether all values are within their ranges.
    ///
    /// # Errors
    /// [`DropError::Value`] names the first that is not.
    pub fn check(&self) -> Result<(), DropError> {
        let share = |what, v: f64| value(what, v, "a number from 0 to 1", (0.0..=1.0).contains(&v));
        share("restitution", self.restitution)?;
        value("slope_s_m", self.slope_s_m, "a finite number", self.slope_s_m.is_finite())?;
        match self.grip {
            Grip::Whole { lost } => share("lost", lost),
            Grip::Rough { friction, recoil, radius_m, inertia } => {
                positive_or_zero("friction", friction)?;
                value("recoil", recoil, "a number from -1 to 1", (-1.0..=1.0).contains(&recoil))?;
                let above =
                    |what, v: f64| value(what, v, "a finite number above 0", v > 0.0 && v.is_finite());
                above("radius_m", radius_m)?;
                above("inertia", inertia)
            }
        }
        .map(|_| ())
    }

    /// Restitution of an impact at a speed, m/s.
    pub fn restitution_at(&self, speed_m_s: f64) -> f64 {
        (self.restitution - self.slope_s_m * (speed_m_s - 1.0)).clamp(0.0, 1.0)
    }

    /// Velocity and spin after an impact without scatter: the table's unit normal, and the ball that comes down on it.
    pub fn unperturbed(&self, normal: &Vector, before: &Moving) -> (Vector, Vector) {
        let v = &before.velocity_m_s;
        let across = dot(v, normal);
        let along: Vector = std::array::from_fn(|i| v[i] - across * normal[i]);
        match self.grip {
            Grip::Whole { lost } => {
                let e = self.restitution_at(dot(v, v).sqrt());
                let after = |i: usize| e * ((1.0 - lost) * along[i] - across * normal[i]);
                (std::array::from_fn(after), before.spin_rad_s)
            }
            Grip::Rough { friction, recoil, radius_m, inertia } => {
                let e = self.restitution_at(across.abs());
                let arm = normal.map(|n| -radius_m * n);
                let turned = cross(&before.spin_rad_s, &arm);
                let slip: Vector = std::array::from_fn(|i| along[i] + turned[i]);
                let speed = dot(&slip, &slip).sqrt();
                // Impulses a mass: what stops the slip, what friction can give.
                let stop = (1.0 + recoil) * inertia / (1.0 + inertia) * speed;
                let most = friction * (1.0 + e) * across.abs();
                let share = if speed > 0.0 { -stop.min(most) / speed } else { 0.0 };
                let kick = slip.map(|s| share * s);
                let twist = cross(&arm, &kick);
                let after = |i: usize| along[i] + kick[i] - e * across * normal[i];
                let spin = |i: usize| before.spin_rad_s[i] + twist[i] / (inertia * radius_m * radius_m);
                (std::array::from_fn(after), std::array::from_fn(spin))
            }
        }
    }

    /// Velocity and spin after an impact: direction scattered, speed kept. A direction into the table is taken for its mirror image.
    pub(super) fn bounce<R: Rng + ?Sized>(&self, normal: &Vector, before: &Moving, rng: &mut R) -> Moving {
        let (velocity, spin_rad_s) = self.unperturbed(normal, before);
        let speed = dot(&velocity, &velocity).sqrt();
        let mut after = Moving { velocity_m_s: velocity, spin_rad_s, ..*before };
        if speed > 0.0 && self.scatter.kappa().is_finite() {
            let mut x = self.scatter.draw(&velocity.map(|v| v / speed), rng);
            let into = dot(&x, normal).min(0.0);
            for i in 0..3 {
                x[i] -= 2.0 * into * normal[i];
            }
            after.velocity_m_s = x.map(|x| speed * x);
        }
        after
    }
}
