//! Meeting a ball that is only heard: where the paddle should be, and when ([Matl 2021], section 4.3, appendices B.3 and B.4).
//!
//! The ball comes towards a plane x = const in which a paddle moves; each impact on the table is heard with its place. A [`Tracker`] turns
//! impacts into goals, [`play`] puts microphones, tracker and arm together on any rig.

mod aim;
mod deterministic;
mod drive;
mod error;
mod filter;
mod next;
mod particle;
mod settings;
mod stochastic;
mod thin;

pub use deterministic::Deterministic;
pub use drive::{PlayError, Played, Player, play};
pub use error::TrackError;
pub use filter::ParticleFilter;
pub use next::{NextBounce, NextSettings, Step};
pub use settings::{FilterSettings, HearingError};
pub use stochastic::{Stochastic, StochasticSettings};

use rand::Rng;

/// Time for the goal after the first impact, s: about a flight.
const FIRST_S: f64 = 0.3;

/// Where the paddle can be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Workspace {
    /// The plane x = this that the paddle moves in, m.
    pub plane_x_m: f64,
    /// Least and greatest y of the paddle, m.
    pub y_m: [f64; 2],
    /// Least and greatest z of the paddle, m; the table is at 0.
    pub z_m: [f64; 2],
    /// The height at which it waits, m.
    pub rest_z_m: f64,
    /// Gravity, m/s^2.
    pub gravity_m_s2: f64,
}

/// An impact as it was heard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// When, s.
    pub t_s: f64,
    /// Where on the table, m.
    pub place_m: [f64; 2],
}

/// Where the paddle should be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// Along the plane, m.
    pub y_m: f64,
    /// Height, m.
    pub z_m: f64,
    /// By when, s.
    pub at_s: f64,
}

/// Turns impacts into goals.
pub trait Tracker {
    /// Forgets the throw before.
    fn begin(&mut self);

    /// Takes an impact, with where the paddle is now (y and z, m); a goal, or `None` to leave the last one as it is.
    fn heard(&mut self, impact: &Seen, paddle_m: [f64; 2], rng: &mut dyn Rng) -> Option<Goal>;
}

impl Workspace {
    /// The goal nearest to the wanted one that the paddle can go to.
    fn within(&self, y_m: f64, z_m: f64, at_s: f64) -> Goal {
        let [y, z] = [self.y_m, self.z_m];
        Goal { y_m: y_m.clamp(y[0], y[1]), z_m: z_m.clamp(z[0], z[1]), at_s }
    }

    /// When (s from the impact) and where (y and z, m) a ball that flies from a place (m) to the next impact goes through the plane;
    /// `None` if it lands before.
    fn crossing(&self, from_m: [f64; 2], flight: &Flight) -> Option<(f64, [f64; 2])> {
        let [dx, dy] = flight.along_m;
        let gap = self.plane_x_m - from_m[0];
        if !(dx > 0.0 && gap >= 0.0 && gap < dx) {
            return None;
        }
        let t = gap / dx * flight.duration_s;
        // It leaves with g T / 2 upwards.
        let z = 0.5 * self.gravity_m_s2 * t * (flight.duration_s - t);
        Some((t, [from_m[1] + gap / dx * dy, z]))
    }
}

/// From one impact to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Flight {
    duration_s: f64,
    along_m: [f64; 2],
}

impl Flight {
    fn between(a: &Seen, b: &Seen) -> Self {
        let along_m = [b.place_m[0] - a.place_m[0], b.place_m[1] - a.place_m[1]];
        Self { duration_s: b.t_s - a.t_s, along_m }
    }

    fn length_m(&self) -> f64 {
        self.along_m[0].hypot(self.along_m[1])
    }
}
