//! Where and when impacts are expected, each from the flight before it.

use bounce_audio::impact::{Hop, Velocity, reflected, speed, speed_after_drop};

use super::drop::Drop;
use super::effects::Effects;

/// An impact that is expected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Expected {
    pub(super) t_s: f64,
    pub(super) place_m: [f64; 2],
    /// The impact that was heard last before it.
    pub(super) after: usize,
    /// The impact that was heard there; none where it went unheard.
    pub(super) heard: Option<usize>,
}

impl Drop {
    /// The impacts that follow each one that was heard, by how the ball came to it.
    pub(super) fn expected(&self, effects: &Effects) -> Vec<Expected> {
        let mut expected = Vec::new();
        for impact in 0..self.times_s.len().saturating_sub(1) {
            let Some(mut comes) = self.comes_to(impact, effects) else { continue };
            let unheard = self.between(impact, effects);
            let mut t_s = self.times_s[impact];
            let mut place_m = self.places_m.get(impact).copied().unwrap_or_default();
            for k in 0..=unheard {
                let leaves = left(&comes, place_m, effects);
                let Some((hop, lands)) = flown(&leaves, effects) else { break };
                t_s += hop.duration_s * (1.0 + effects.clock_rate);
                let scale = 1.0 + effects.position_scale;
                (0..2).for_each(|axis| place_m[axis] += scale * hop.displacement_m[axis]);
                let heard = (k == unheard).then_some(impact + 1);
                expected.push(Expected { t_s, place_m, after: impact, heard });
                comes = lands;
            }
        }
        expected
    }

    /// Velocity with which the ball comes to an impact, as it was heard; nothing for the first where its fall is not known.
    fn comes_to(&self, impact: usize, effects: &Effects) -> Option<Velocity> {
        if impact > 0 {
            return Some(self.lands(impact - 1, effects));
        }
        let fell = speed_after_drop(self.height_m?, effects.gravity_m_s2, effects.drag_per_m);
        let [x, y] = self.comes(effects);
        let unheard = self.unheard.first().copied().unwrap_or(0);
        let speed = fell * effects.restitution.powi(unheard as i32);
        Some([speed * x, speed * y, -speed])
    }
}

/// Velocity after an impact.
fn left(comes: &Velocity, place_m: [f64; 2], effects: &Effects) -> Velocity {
    let kept = effects.log_restitution(place_m, speed(comes)).exp();
    reflected(comes, effects.table, effects.friction).map(|v| kept * v)
}

/// The flight of a ball that leaves the table at a velocity, and the velocity at which it lands; nothing where it does not rise.
fn flown(leaves: &Velocity, effects: &Effects) -> Option<(Hop, Velocity)> {
    const ROUNDS: usize = 20;
    let (gravity, [along, across]) = (effects.gravity_m_s2, effects.table);
    let rise = |[x, y]: [f64; 2]| along * x + across * y;
    let mut duration_s = 2.0 * (leaves[2] - rise([leaves[0], leaves[1]])) / gravity;
    if !(duration_s > 0.0) {
        return None;
    }
    let mut far = [leaves[0] * duration_s, leaves[1] * duration_s];
    let mut lands = [0.0; 3];
    for _ in 0..ROUNDS {
        let hop = Hop { displacement_m: [far[0], far[1], rise(far)], duration_s };
        let (launch, landing) = hop.velocities(gravity, effects.drag_per_m);
        lands = landing;
        // A flight that begins too slow is too short, and leads too near.
        duration_s += 2.0 * (leaves[2] - launch[2]) / gravity;
        (0..2).for_each(|k| far[k] += (leaves[k] - launch[k]) * duration_s);
    }
    let hop = Hop { displacement_m: [far[0], far[1], rise(far)], duration_s };
    (duration_s > 0.0 && far.iter().all(|v| v.is_finite())).then_some((hop, lands))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    /// A ball that follows the effects to the letter is heard where and when it is expected, with drag and on a tilted table; an impact
    /// that is taken away is expected in its place.
    #[test]
    fn a_ball_that_follows_the_effects_is_where_it_is_expected() {
        let effects = Effects {
            drag_per_m: 0.02,
            table: [0.01, -0.02],
            friction: 0.05,
            unheard: 1.0,
            ..Effects::none(9.81, 0.8)
        };
        let mut drop = Drop { times_s: vec![0.3], places_m: vec![[0.1, 0.2]], ..Drop::default() };
        let mut comes = [0.2, -0.1, -1.5];
        for impact in 0..6 {
            let (hop, lands) = flown(&left(&comes, drop.places_m[impact], &effects), &effects).unwrap();
            drop.times_s.push(drop.times_s[impact] + hop.duration_s);
            let place = drop.places_m[impact];
            drop.places_m.push([place[0] + hop.displacement_m[0], place[1] + hop.displacement_m[1]]);
            comes = lands;
        }
        let whole = drop.clone();
        let near = |e: &Expected, impact: usize| {
            let ([x, y], [a, b]) = (e.place_m, whole.places_m[impact]);
            assert!((e.t_s - whole.times_s[impact]).abs() < 1e-6, "{e:?}");
            assert!((x - a).hypot(y - b) < 1e-6, "{e:?}");
        };
        let expected = drop.expected(&effects);
        assert_eq!(expected.iter().map(|e| e.heard).collect::<Vec<_>>(), [2, 3, 4, 5, 6].map(Some));
        expected.iter().for_each(|e| near(e, e.heard.unwrap()));
        drop.times_s.remove(4);
        drop.places_m.remove(4);
        drop.unheard = vec![0, 0, 0, 0, 1, 0];
        drop.known = vec![0; 6];
        let expected = drop.expected(&effects);
        assert_eq!(
            expected.iter().map(|e| e.heard).collect::<Vec<_>>(),
            [Some(2), Some(3), None, Some(4), Some(5)]
        );
        near(&expected[2], 4);
    }
}
