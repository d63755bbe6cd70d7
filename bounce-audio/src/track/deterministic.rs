//! Algorithm 1: the ball goes straight on, each flight e as long and e^2 as far as the one before.

use super::{FIRST_S, Flight, Goal, Seen, Tracker, Workspace};
use rand::Rng;

/// The baseline of [Matl 2021], appendix B.3 (equations B.11 to B.16), without chance.
#[derive(Debug, Clone, PartialEq)]
pub struct Deterministic {
    restitution: f64,
    workspace: Workspace,
    last: Option<Seen>,
}

impl Deterministic {
    /// For a ball of a restitution, kept within [0, 1].
    pub fn new(restitution: f64, workspace: Workspace) -> Self {
        Self { restitution: restitution.clamp(0.0, 1.0), workspace, last: None }
    }
}

impl Tracker for Deterministic {
    fn begin(&mut self) {
        self.last = None;
    }

    fn heard(&mut self, impact: &Seen, _: [f64; 2], _: &mut dyn Rng) -> Option<Goal> {
        let w = &self.workspace;
        let last = self.last.replace(*impact);
        let Some(last) = last else {
            return Some(w.within(impact.place_m[1], w.rest_z_m, impact.t_s + FIRST_S));
        };
        let before = Flight::between(&last, impact);
        if !(before.duration_s > 0.0 && before.along_m[0] > 0.0 && impact.place_m[0] < w.plane_x_m) {
            return None;
        }
        let e = self.restitution;
        let next = Flight { duration_s: e * before.duration_s, along_m: before.along_m.map(|d| e * e * d) };
        if let Some((t, [y, z])) = w.crossing(impact.place_m, &next) {
            return Some(w.within(y, z, impact.t_s + t));
        }
        let slope = before.along_m[1] / before.along_m[0];
        let y = impact.place_m[1] + slope * (w.plane_x_m - impact.place_m[0]);
        Some(w.within(y, w.rest_z_m, impact.t_s + next.duration_s))
    }
}
