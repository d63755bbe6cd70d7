//! What becomes of commands on their way to the machine.

use super::effects::InputEffects;

/// The commands of a run, as a drive passes them on.
pub(super) struct Drive<'a> {
    /// When each command is given, s.
    knots: Vec<f64>,
    commands: &'a [f64],
    linear: bool,
    effects: &'a InputEffects,
    /// Where what follows with play stands at each knot.
    followers: Vec<f64>,
}

impl<'a> Drive<'a> {
    pub(super) fn new(knots: Vec<f64>, commands: &'a [f64], linear: bool, effects: &'a InputEffects) -> Self {
        let mut follower = 0.0;
        let followers = commands
            .iter()
            .map(|u| {
                follower = played(follower, effects.passed(*u), effects.gap);
                follower
            })
            .collect();
        Self { knots, commands, linear, effects, followers }
    }

    /// When what acts jumps or bends.
    pub(super) fn jumps(&self) -> impl Iterator<Item = f64> + '_ {
        let driven = !self.commands.is_empty();
        self.knots.iter().filter(move |_| driven).map(|t| t + self.effects.delay_s)
    }

    /// The number of the knot from which on what acts at a time was said.
    pub(super) fn segment(&self, t: f64) -> usize {
        let given = t - self.effects.delay_s;
        self.knots.partition_point(|knot| *knot <= given).saturating_sub(1)
    }

    /// What acts at a time within a segment, before any lag.
    pub(super) fn value(&self, segment: usize, t: f64) -> f64 {
        let Some(&command) = self.commands.get(segment) else { return 0.0 };
        let given = t - self.effects.delay_s;
        let raw = match (self.linear, self.commands.get(segment + 1)) {
            (true, Some(next)) if given > self.knots[0] => {
                let part = (given - self.knots[segment]) / (self.knots[segment + 1] - self.knots[segment]);
                command + part * (next - command)
            }
            _ => command,
        };
        let passed = self.effects.passed(raw);
        if self.effects.gap == 0.0 {
            return passed;
        }
        // Within a segment the command goes one way.
        played(self.followers[segment], passed, self.effects.gap)
    }
}

/// Where something with play stands that stood at `follower` when what leads it is at `leader`.
fn played(follower: f64, leader: f64, gap: f64) -> f64 {
    if gap > 0.0 { follower.max(leader - 0.5 * gap).min(leader + 0.5 * gap) } else { leader }
}
