//! Drops whose hidden effects are sized by their strength: one of the list with something smaller beside it.

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use super::draw::{between, log_between, sign, whole};
use super::key::{Hidden, Key};
use super::nuisances::{Nuisances, difference};
use super::rig::{Choice, Rig};
use crate::physics::bounce::{BounceWorld, Effects};

/// Listed effects that may have something beside them: all but the scale of the places, which the speed of each release imitates, and impacts that
/// go unheard, which have no size.
const LISTED: usize = 5;
/// The number of a clock that is wrong.
const CLOCK: usize = 4;
/// Effects that are not on the list.
const UNLISTED: usize = 3;
/// A small step of what a baseline has to fit.
const STEP: f64 = 1e-3;

/// Fifteen to forty drops of a ball, five to eight impacts each.
pub(super) fn dropped(rng: &mut ChaCha8Rng) -> BounceWorld {
    BounceWorld {
        runs: whole(rng, 15, 40),
        impacts: whole(rng, 5, 8),
        height_m: between(rng, 0.2, 0.6),
        height_known: whole(rng, 0, 1) == 1,
        restitution: between(rng, 0.65, 0.9),
        kappa: log_between(rng, 1e3, 3e4),
        noise: [log_between(rng, 1e-5, 1e-4), log_between(rng, 2e-3, 1e-2)],
        noise_known: whole(rng, 0, 3) > 0,
        ..BounceWorld::drops()
    }
}

/// Writes a listed effect into the key, by its number.
pub(super) fn describe(world: &BounceWorld, which: usize, key: &mut Key) {
    let e = &world.effects;
    match which {
        0 => key.add("air-drag", &[("k_per_m", e.drag_per_m)]),
        1 => {
            let at_one = ("e_at_1_m_s", world.restitution);
            key.add("velocity-dependent-restitution", &[("slope_s_m", e.slope_s_m), at_one]);
        }
        2 => key.add("table-tilt", &[("slope_x", e.table_slope[0]), ("slope_y", e.table_slope[1])]),
        3 => key.add("tangential-friction", &[("fraction", e.friction)]),
        4 => key.add("clock-rate", &[("rate", e.clock_rate)]),
        5 => key.add("position-scale", &[("scale", e.position_scale)]),
        _ => key.add("missed-impact", &[("fraction", e.unheard)]),
    }
}

/// Drops that are heard and seen, with what their effects look like before their sizes are known.
pub(super) struct Drops {
    world: BounceWorld,
    /// Of releases, rebounds and noise.
    seed: u64,
    /// Readings of a ball that nothing acts on, in sigmas.
    free: Vec<f64>,
    /// Which way listed effects act.
    signs: [f64; 2],
}

impl Drops {
    /// Durations of flights and how far they lead along x and y, of all runs, in sigmas: those of the noise with what rebounds scatter by.
    fn readings(&self, world: &BounceWorld) -> Vec<f64> {
        let [time, place] = self.world.noise;
        let mut readings = Vec::new();
        for drop in world.heard(self.seed) {
            for pair in drop.impacts.windows(2) {
                let [t, x, y] = std::array::from_fn(|i| pair[1].heard[i] - pair[0].heard[i]);
                let speed = 0.5 * crate::GRAVITY_M_S2 * t;
                readings.push(t / (2f64.sqrt() * time).hypot(t / world.kappa));
                let astray = (2f64.sqrt() * place).hypot(speed * t / world.kappa.sqrt());
                readings.extend([x / astray, y / astray]);
            }
        }
        readings
    }

    fn with(&self, effects: Effects) -> BounceWorld {
        let world = BounceWorld { effects, ..self.world };
        if effects.softer_side == 0.0 {
            return world;
        }
        // A softer side begins in the middle of where balls land: on a tilted table they would miss one that begins below their release.
        let even = BounceWorld { effects: Effects { softer_side: 0.0, ..effects }, ..world };
        let mut landed: Vec<f64> = even
            .heard(self.seed)
            .iter()
            .flat_map(|drop| &drop.impacts)
            .map(|impact| impact.heard[1])
            .collect();
        landed.sort_by(f64::total_cmp);
        BounceWorld { soft_from_m: landed[landed.len() / 2], ..world }
    }
}

impl Rig for Drops {
    const DOMAIN: &'static str = "bounce";

    type Effects = Effects;

    fn draw(hidden: Hidden, rng: &mut ChaCha8Rng) -> (Self, Choice) {
        let world = dropped(rng);
        let (seed, signs) = (rng.random(), std::array::from_fn(|_| sign(rng)));
        let mut rig = Self { world, seed, free: Vec::new(), signs };
        rig.free = rig.readings(&world);
        let can = rig.candidates();
        let listed = (0..hidden.listed()).map(|_| can[whole(rng, 0, can.len() - 1)]).collect();
        (rig, Choice { listed, unlisted: whole(rng, 0, UNLISTED - 1) })
    }

    /// The restitution, and of each run how fast the ball leaves along x and y, and the height where it is not known.
    fn nuisances(&self) -> Nuisances {
        let mut nuisances = Nuisances::default();
        let changed = |world: BounceWorld| difference(&self.free, &self.readings(&world));
        nuisances.add(&changed(BounceWorld { restitution: self.world.restitution + STEP, ..self.world }));
        let higher = changed(BounceWorld { height_m: self.world.height_m * (1.0 + STEP), ..self.world });
        let of_run = 3 * (self.world.impacts - 1);
        for begin in (0..self.free.len()).step_by(of_run) {
            for kind in usize::from(self.world.height_known)..3 {
                let mut column = vec![0.0; self.free.len()];
                for flight in 0..self.world.impacts - 1 {
                    let at = begin + 3 * flight + kind;
                    // Of a speed along the table a rebound leaves as much as of that across it, and flights shorten by as much.
                    let along = self.world.restitution.powi(2 * flight as i32);
                    column[at] = if kind == 0 { higher[at] } else { along };
                }
                nuisances.add(&column);
            }
        }
        nuisances
    }

    fn response(&self, effects: Effects) -> Vec<f64> {
        difference(&self.free, &self.readings(&self.with(effects)))
    }

    fn candidates(&self) -> Vec<usize> {
        // A clock that is wrong is another height of each drop, unless the height is known.
        (0..LISTED).filter(|listed| *listed != CLOCK || self.world.height_known).collect()
    }

    fn size_bounds(&self, listed: usize) -> [f64; 2] {
        match listed {
            0 => [3e-3, 0.6],
            1 => [1e-3, 0.08],
            2 => [5e-4, 0.1],
            3 => [0.01, 0.5],
            _ => [1e-3, 0.06],
        }
    }

    fn apply(&self, e: &mut Effects, listed: usize, size: f64) {
        let [a, b] = self.signs.map(|sign| sign * size);
        match listed {
            0 => e.drag_per_m = size,
            1 => e.slope_s_m = size,
            2 => e.table_slope = [0.8 * a, 0.6 * b],
            3 => e.friction = size,
            _ => e.clock_rate = a,
        }
    }

    fn describe(&self, effects: &Effects, listed: usize, key: &mut Key) {
        describe(&self.with(*effects), listed, key);
    }

    fn unlisted_size_bounds(&self, which: usize) -> [f64; 2] {
        match which {
            0 => [1e-3, 0.15],
            1 => [1e-3, 0.1],
            _ => [1e-3, 0.05],
        }
    }

    fn unlisted(&self, beside: Effects, which: usize, sign: f64, size: f64) -> Effects {
        match which {
            0 => Effects { softer_side: size, ..beside },
            1 => Effects { warming: sign * size, ..beside },
            _ => Effects { curvature_s2_m2: sign * size, ..beside },
        }
    }

    fn describe_unlisted(&self, which: usize, key: &mut Key) {
        let what = [
            "a table that is softer on one side",
            "a ball whose restitution changes from drop to drop",
            "a restitution that bends with the speed",
        ];
        key.unlisted = Some(what[which.min(UNLISTED - 1)].into());
    }

    fn files(self, effects: Effects, _rng: &mut ChaCha8Rng) -> [String; 2] {
        self.with(effects).files(self.seed)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use rand::SeedableRng as _;

    use super::*;
    use crate::concealed::rig::tests::every_effect_shows;

    #[test]
    fn effects_show_beside_the_height_of_each_run() {
        let drawn = |seed| Drops::draw(Hidden::Leftover, &mut ChaCha8Rng::seed_from_u64(seed)).0;
        for known in [false, true] {
            let rig = (5..).map(drawn).find(|rig| rig.world.height_known == known).unwrap();
            every_effect_shows(&rig, UNLISTED, 10.0, [5.0, 10.0]);
        }
    }
}
