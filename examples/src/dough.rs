//! Rolled doughs for examples and benches: exploration, rollouts of a policy, many at a time.

use dough_mbrl::dough::DoughError;
use dough_mbrl::fake::{DoughKind, Effects, FakeRig};
use dough_mbrl::goal::Goal;
use dough_mbrl::handling::RigError;
use dough_mbrl::policy::{Explore, Policy};
use dough_mbrl::roll::Roll;
use dough_mbrl::rollout::{End, Rolled, Rollout, RolloutError, Setup};
use hw_traits::ErrorKind;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// A dough is put aside once it is this long: further on it leaves the picture.
const LONGEST_M: f64 = 0.26;

/// Random rolls on fresh doughs, one list a dough; each is rolled at most so many times.
///
/// # Errors
/// [`RolloutError`].
pub fn explore(
    kind: DoughKind,
    effects: Effects,
    rolls: usize,
    each: usize,
    seed: u64,
) -> Result<Vec<Vec<Rolled>>, RolloutError> {
    let mut rig = FakeRig::new(kind, effects, seed);
    let setup = Setup::of(rig.camera_in_world());
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    // Random rolls look at no goal.
    let goal = Goal::cylinder(LONGEST_M, kind.volume_m3)?;
    let (mut doughs, mut left, mut long) = (vec![Vec::new()], rolls, false);
    while left > 0 {
        if long || doughs.last().is_some_and(|d| d.len() >= each) {
            rig.renew(kind);
            doughs.push(Vec::new());
        }
        match setup.step(&mut rig, &mut Explore, &goal, &mut rng) {
            Ok((rolled, after)) => {
                if let Some(last) = doughs.last_mut() {
                    last.push(rolled);
                }
                (long, left) = (after.length_m > LONGEST_M, left - 1);
            }
            // The last roll took it out of the picture: the next dough.
            Err(RolloutError::Rig(RigError::Dough(DoughError::CutOff { .. }))) => long = true,
            // Its fingers met the dough: another rig, and the next dough.
            Err(RolloutError::Rig(RigError::Device { kind: ErrorKind::Stopped, .. })) => {
                (rig, long) = (FakeRig::new(kind, effects, rng.random()), true);
            }
            Err(error) => return Err(error),
        }
    }
    Ok(doughs)
}

/// All rolls of some doughs.
pub fn rolls(doughs: &[Vec<Rolled>]) -> Vec<Roll> {
    doughs.iter().flatten().map(|r| r.roll).collect()
}

/// A policy made anew for each rollout.
pub type Make<'a> = &'a (dyn Fn(u64) -> Result<Box<dyn Policy>, RolloutError> + Sync);

/// Rollouts to a length, each of so many rolls at most on a rig of its own, in order.
///
/// # Errors
/// The first [`RolloutError`].
pub fn rollouts(
    kind: DoughKind,
    effects: Effects,
    length_m: f64,
    seeds: std::ops::Range<u64>,
    most_rolls: usize,
    make: Make<'_>,
) -> Result<Vec<Rollout>, RolloutError> {
    seeds
        .into_par_iter()
        .map(|seed| {
            let mut rig = FakeRig::new(kind, effects, seed);
            let setup = Setup { most_rolls, ..Setup::of(rig.camera_in_world()) };
            let goal = Goal::cylinder(length_m, kind.volume_m3)?;
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            setup.run(&mut rig, &mut *make(seed)?, &goal, kind.volume_m3, &mut rng)
        })
        .collect()
}

/// Mean and half of its 95 % interval (normal) of some values.
pub fn mean_and_half(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    (mean, 1.96 * (variance / n).sqrt())
}

/// Some rollouts, counted: none is left out.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    /// Rolls of each rollout until the goal was reached, the dough was lost, or no more were made.
    pub rolls: Vec<f64>,
    /// Doughs that were lost: rolled past the goal.
    pub lost: usize,
    /// Doughs that missed it otherwise: out of rolls, or stopped by the rig.
    pub other: usize,
}

impl Tally {
    /// Of some rollouts.
    pub fn of(rollouts: &[Rollout]) -> Self {
        let count = |ends: &[End]| rollouts.iter().filter(|r| ends.contains(&r.end)).count();
        Self {
            rolls: rollouts.iter().map(|r| r.rolls.len() as f64).collect(),
            lost: count(&[End::TooLong]),
            other: count(&[End::OutOfRolls, End::Stopped]),
        }
    }

    /// Adds others.
    pub fn add(&mut self, other: &Self) {
        self.rolls.extend(&other.rolls);
        self.lost += other.lost;
        self.other += other.other;
    }
}
