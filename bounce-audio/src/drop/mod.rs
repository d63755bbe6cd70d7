//! Drops: a ball that falls on a table, level or tilted, and bounces with chance in its directions ([Matl 2021], section 4.3).
//!
//! Between impacts the ball flies free of drag, so that every flight is a parabola in closed form. Position is the ball's centre less its
//! radius along the table's normal: where it touches, and a plane through the origin is the table.

mod ball;
mod direction;
mod many;

pub use ball::{Ball, Grip};
pub use direction::Scatter;
pub use many::{Trace, drops, each};

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use thiserror::Error;

/// Three components; z up.
pub type Vector = [f64; 3];

/// Speed across the table below which a ball has stopped bouncing, m/s.
const AT_REST_M_S: f64 = 1e-4;

/// Why there is no drop.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum DropError {
    /// A value is out of its range.
    #[error("{what} is {got}, expected {expected}")]
    Value {
        /// Which one.
        what: &'static str,
        /// What is taken.
        expected: &'static str,
        /// The value stated.
        got: f64,
    },
    /// The ball starts below the table.
    #[error("the ball starts {below_m} m below the table, expected on it or above")]
    Below {
        /// How far below, m.
        below_m: f64,
    },
}

pub(crate) fn value(
    what: &'static str,
    got: f64,
    expected: &'static str,
    ok: bool,
) -> Result<f64, DropError> {
    if ok { Ok(got) } else { Err(DropError::Value { what, expected, got }) }
}

fn positive_or_zero(what: &'static str, got: f64) -> Result<f64, DropError> {
    value(what, got, "a finite number of 0 or more", got >= 0.0 && got.is_finite())
}

fn dot(a: &Vector, b: &Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: &Vector, b: &Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// A ball at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moving {
    /// Time, s.
    pub t_s: f64,
    /// Where it would touch the table, m.
    pub position_m: Vector,
    /// Velocity, m/s.
    pub velocity_m_s: Vector,
    /// Angular velocity, rad/s.
    pub spin_rad_s: Vector,
}

/// An impact: when and where.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bounce {
    /// Time since the ball was let go, s.
    pub t_s: f64,
    /// Place on the table, m.
    pub position_m: Vector,
}

/// How a ball is let go: from a place, its velocity and spin Gaussian about a mean and about none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Release {
    /// Where it would touch the table, m.
    pub position_m: Vector,
    /// Mean velocity, m/s.
    pub velocity_m_s: Vector,
    /// Standard deviation of each component of the velocity, m/s.
    pub velocity_sigma_m_s: f64,
    /// Standard deviation of each component of the spin, rad/s.
    pub spin_sigma_rad_s: f64,
}

impl Release {
    /// From rest at a height above the origin, let go with a little chance: 0.02 m/s and 1 rad/s ([Matl 2021] gives no numbers).
    pub fn at(height_m: f64) -> Self {
        Self {
            position_m: [0.0, 0.0, height_m],
            velocity_m_s: [0.0; 3],
            velocity_sigma_m_s: 0.02,
            spin_sigma_rad_s: 1.0,
        }
    }

    /// Lets a ball go.
    pub fn draw<R: Rng + ?Sized>(&self, rng: &mut R) -> Moving {
        let mut about = |mean: &Vector, sigma: f64| -> Vector {
            std::array::from_fn(|i| mean[i] + sigma * rng.sample::<f64, _>(StandardNormal))
        };
        Moving {
            t_s: 0.0,
            position_m: self.position_m,
            velocity_m_s: about(&self.velocity_m_s, self.velocity_sigma_m_s),
            spin_rad_s: about(&[0.0; 3], self.spin_sigma_rad_s),
        }
    }
}

/// A flat table through the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Table {
    normal: Vector,
}

impl Table {
    /// A level table.
    pub const LEVEL: Self = Self { normal: [0.0, 0.0, 1.0] };

    /// A table that falls by an angle (rad, below a right one) towards a direction in the plane, an angle from x (rad).
    ///
    /// # Errors
    /// [`DropError::Value`].
    pub fn tilted(angle_rad: f64, towards_rad: f64) -> Result<Self, DropError> {
        let right = std::f64::consts::FRAC_PI_2;
        value("angle_rad", angle_rad, "an angle below a right one", angle_rad.abs() < right)?;
        value("towards_rad", towards_rad, "a finite number", towards_rad.is_finite())?;
        let ((sin, cos), (side, ahead)) = (angle_rad.sin_cos(), towards_rad.sin_cos());
        Ok(Self { normal: [sin * ahead, sin * side, cos] })
    }

    /// The table's unit normal, upwards.
    pub fn normal(&self) -> &Vector {
        &self.normal
    }

    /// Distance of a place from it, m; above it is positive.
    pub fn height_m(&self, place_m: &Vector) -> f64 {
        dot(&self.normal, place_m)
    }
}

/// A ball, a table and gravity: everything that a drop needs but its release and its chance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DropModel {
    ball: Ball,
    table: Table,
    gravity_m_s2: f64,
}

impl DropModel {
    /// A ball on a table under gravity (m/s^2, above zero).
    ///
    /// # Errors
    /// [`DropError::Value`].
    pub fn new(ball: Ball, table: Table, gravity_m_s2: f64) -> Result<Self, DropError> {
        ball.check()?;
        let ok = gravity_m_s2 > 0.0 && gravity_m_s2.is_finite();
        value("gravity_m_s2", gravity_m_s2, "a finite number above 0", ok)?;
        Ok(Self { ball, table, gravity_m_s2 })
    }

    /// The ball.
    pub fn ball(&self) -> &Ball {
        &self.ball
    }

    /// The table.
    pub fn table(&self) -> &Table {
        &self.table
    }

    /// Gravity, m/s^2.
    pub fn gravity_m_s2(&self) -> f64 {
        self.gravity_m_s2
    }

    /// A ball that flies on, some time later.
    pub fn later(&self, ball: &Moving, duration_s: f64) -> Moving {
        let mut then = *ball;
        then.t_s += duration_s;
        for i in 0..3 {
            then.position_m[i] += ball.velocity_m_s[i] * duration_s;
        }
        then.position_m[2] -= 0.5 * self.gravity_m_s2 * duration_s * duration_s;
        then.velocity_m_s[2] -= self.gravity_m_s2 * duration_s;
        then
    }

    /// The ball just before it comes down on the table.
    ///
    /// # Errors
    /// [`DropError::Below`] for a ball that is below it already, by more than rounding.
    pub fn landing(&self, ball: &Moving) -> Result<Moving, DropError> {
        let (h, v) = (self.table.height_m(&ball.position_m), dot(&self.table.normal, &ball.velocity_m_s));
        if !(h > -1e-9) {
            return Err(DropError::Below { below_m: -h });
        }
        let g = self.gravity_m_s2 * self.table.normal[2];
        let root = (v * v + 2.0 * g * h.max(0.0)).sqrt();
        // The later root, in the form that does not cancel.
        let t = if v >= 0.0 { (v + root) / g } else { 2.0 * h.max(0.0) / (root - v) };
        Ok(self.later(ball, t))
    }

    /// The ball just after an impact.
    pub fn bounce<R: Rng + ?Sized>(&self, before: &Moving, rng: &mut R) -> Moving {
        self.ball.bounce(&self.table.normal, before, rng)
    }

    /// Lets a ball go on, writes its impacts, and returns how many there were: fewer than there is room for only where it comes to rest.
    ///
    /// # Errors
    /// [`DropError::Below`].
    pub fn run<R: Rng + ?Sized>(
        &self,
        start: &Moving,
        rng: &mut R,
        out: &mut [Bounce],
    ) -> Result<usize, DropError> {
        let mut ball = *start;
        for (n, bounce) in out.iter_mut().enumerate() {
            let landed = self.landing(&ball)?;
            *bounce = Bounce { t_s: landed.t_s, position_m: landed.position_m };
            ball = self.bounce(&landed, rng);
            if dot(&self.table.normal, &ball.velocity_m_s) < AT_REST_M_S {
                return Ok(n + 1);
            }
        }
        Ok(out.len())
    }
}
