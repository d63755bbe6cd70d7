//! The domain `bounce`, from times and places: bouncing balls with concealed effects.

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

use super::draw::{between, choose, log_between, sign, whole};
use super::drops::{Drops, describe, dropped};
use super::key::{Concealed, Hidden, Key, Place};
use super::maker::Maker;
use super::rig::RigMaker;
use crate::physics::bounce::{BounceWorld, Effects, Recorded, Softer};

/// Makes worlds of the domain `bounce` from times and places of impacts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounce;

pub(crate) const LISTED: usize = 7;

impl Maker for Bounce {
    fn domain(&self) -> &'static str {
        "bounce"
    }

    /// What the list imitates by a half is seldom found among drops: most of a softer side or of a changing ball is left.
    fn kind(&self, hidden: Hidden) -> Hidden {
        if hidden == Hidden::Imitated { hidden.without_leftovers() } else { hidden }
    }

    fn conceal(&self, hidden: Hidden, seed: u64) -> Concealed {
        let hidden = self.kind(hidden);
        if hidden == Hidden::Leftover {
            return RigMaker::<Drops>::NEW.conceal(hidden, seed);
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut key = Key::new(hidden);
        let mut world = dropped(&mut rng);
        for which in choose(&mut rng, LISTED, hidden.listed()) {
            listed(&mut world, which, &mut key, &mut rng);
        }
        if hidden == Hidden::Local {
            local(&mut world, whole(&mut rng, 0, 3), &mut key, &mut rng);
        } else if hidden.unlisted() {
            let softer_side = log_between(&mut rng, 0.02, 0.15);
            if whole(&mut rng, 0, 1) == 0 {
                world.effects.softer_side = softer_side;
                key.unlisted = Some("a table that is softer on one side".into());
            } else {
                world.effects.bowl_per_m = log_between(&mut rng, 0.1, 1.0);
                key.unlisted = Some("a table that is a shallow bowl".into());
            }
        }
        let mut seed = seed ^ 0x5eed;
        let mut made = world.recorded(seed);
        // Drops in which all was heard hide no unheard impact.
        while made.unheard.is_empty() && world.effects.unheard > 0.0 {
            seed = seed.wrapping_add(1);
            made = world.recorded(seed);
        }
        let Recorded { files: [header, data], unheard, softer } = made;
        key.state_missed(unheard.len(), world.runs);
        if let Some(place) = key.place.as_mut().filter(|place| place.variable == "x_m") {
            place.runs = softer.iter().map(usize::to_string).collect();
        }
        if hidden == Hidden::Local && world.effects.unheard > 0.0 {
            key.events = unheard.iter().map(|[run, impact]| (run.to_string(), *impact as f64)).collect();
        }
        Concealed::table(header, data, key)
    }

    fn without_leftover(&self, hidden: Hidden, seed: u64) -> Option<Concealed> {
        RigMaker::<Drops>::NEW.without_leftover(hidden, seed)
    }
}

/// A restitution that is lower on a stripe of the table, from a drop on, or at some speeds; or a few impacts that go unheard.
pub(crate) fn local(world: &mut BounceWorld, which: usize, key: &mut Key, rng: &mut ChaCha8Rng) {
    let by = log_between(rng, 0.03, 0.15);
    let all = [f64::NEG_INFINITY, f64::INFINITY];
    let of_run = |run: usize| (run + 1).to_string();
    let (what, softer, place) = match which {
        0 => {
            // As wide as a third of where balls land.
            let low = between(rng, -0.01, 0.02);
            let x_m = [low, low + between(rng, 0.02, 0.04)];
            let place = Place::new("x_m", x_m[0], x_m[1]);
            ("a softer stripe of the table", Softer { by, x_m, ..Softer::default() }, Some(place))
        }
        1 => {
            let from_run = whole(rng, world.runs / 5, 4 * world.runs / 5);
            let runs = (from_run..world.runs).map(of_run);
            let place = Place::new("run", all[0], all[1]).in_runs(runs);
            ("a softer ball from one drop on", Softer { by, from_run, ..Softer::default() }, Some(place))
        }
        2 => {
            let fastest = (2.0 * crate::GRAVITY_M_S2 * world.height_m).sqrt() * world.restitution;
            let low = fastest * between(rng, 0.45, 0.6);
            let speed_m_s = [low, low + fastest * between(rng, 0.2, 0.35)];
            let place = Place::new("speed_m_s", low, speed_m_s[1]);
            (
                "a restitution that dips at some speeds",
                Softer { by, speed_m_s, ..Softer::default() },
                Some(place),
            )
        }
        _ => {
            world.effects.unheard = between(rng, 0.06, 0.2);
            ("impacts that went unheard", Softer::default(), None)
        }
    };
    world.effects.softer = softer;
    key.unlisted = Some(what.into());
    key.place = place;
}

/// Puts a listed effect to work, by its number among [`LISTED`], and writes it into the key.
pub(crate) fn listed(world: &mut BounceWorld, which: usize, key: &mut Key, rng: &mut ChaCha8Rng) {
    let e: &mut Effects = &mut world.effects;
    match which {
        0 => e.drag_per_m = log_between(rng, 0.01, 0.4),
        1 => e.slope_s_m = log_between(rng, 0.003, 0.05),
        2 => {
            let size = log_between(rng, 0.002, 0.06);
            e.table_slope = [0.8 * sign(rng) * size, 0.6 * sign(rng) * size];
        }
        3 => e.friction = log_between(rng, 0.03, 0.4),
        4 => e.clock_rate = sign(rng) * log_between(rng, 0.003, 0.04),
        5 => e.position_scale = sign(rng) * log_between(rng, 0.01, 0.1),
        _ => e.unheard = between(rng, 0.1, 0.4),
    }
    describe(world, which, key);
}
