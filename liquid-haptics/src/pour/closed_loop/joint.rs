//! The measured tilts of the last second: readings of the wrench are older than they are.

use std::collections::VecDeque;

/// While the wrist turns faster (rad/s), or its rate has changed by more (rad/s), its own inertia is in the force.
pub(super) const STEADY_RAD_S: f64 = 0.15;
const EVEN_RAD_S: f64 = 0.06;
/// How long before a reading the wrist has to have been steady, s.
const STEADY_S: f64 = 0.05;
/// How many tilts are kept: a second and more at fifty a second.
const KEPT: usize = 64;

/// Tilts with their times, the newest last.
#[derive(Debug, Clone, Default)]
pub(super) struct Joint {
    tilts: VecDeque<[f64; 2]>,
}

impl Joint {
    pub(super) fn push(&mut self, t_s: f64, tilt_rad: f64) {
        if self.tilts.len() == KEPT {
            self.tilts.pop_front();
        }
        self.tilts.push_back([t_s, tilt_rad]);
    }

    /// The newest tilt, rad.
    pub(super) fn now_rad(&self) -> f64 {
        self.tilts.back().map_or(0.0, |[_, tilt]| *tilt)
    }

    /// The tilt at a time, straight between two; the first or the last one beyond them.
    pub(super) fn at(&self, t_s: f64) -> f64 {
        let k = self.tilts.partition_point(|[t, _]| *t <= t_s);
        match (k.checked_sub(1).and_then(|k| self.tilts.get(k)), self.tilts.get(k)) {
            (Some([a, x]), Some([b, y])) => x + (y - x) * (t_s - a) / (b - a),
            (Some([_, x]), None) | (None, Some([_, x])) => *x,
            (None, None) => 0.0,
        }
    }

    /// Whether the wrist has gone evenly and slowly from a little before a time on until now.
    pub(super) fn steady(&self, t_s: f64) -> bool {
        let mut rate_before: Option<f64> = None;
        for k in 1..self.tilts.len() {
            let ([a, x], [b, y]) = (self.tilts[k - 1], self.tilts[k]);
            if b < t_s - STEADY_S || b <= a {
                continue;
            }
            let rate = (y - x) / (b - a);
            if rate.abs() > STEADY_RAD_S
                || rate_before.is_some_and(|before| (rate - before).abs() > EVEN_RAD_S)
            {
                return false;
            }
            rate_before = Some(rate);
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A turn of 1 rad/s between two rests: the tilts between are straight, and a reading that was taken in it is not steady.
    #[test]
    fn a_turn_is_seen_at_the_time_of_the_reading() {
        let mut joint = Joint::default();
        assert!(joint.at(0.0) == 0.0 && joint.steady(0.0));
        for k in 0..60 {
            let t = 0.02 * f64::from(k);
            joint.push(t, (t - 0.4).clamp(0.0, 0.2));
        }
        assert!((joint.at(0.51) - 0.11).abs() < 1e-12);
        assert!(joint.at(5.0) == 0.2 && joint.now_rad() == 0.2 && joint.at(-1.0) == 0.0);
        assert!(!joint.steady(0.5) && !joint.steady(0.61) && joint.steady(0.7));
    }
}
