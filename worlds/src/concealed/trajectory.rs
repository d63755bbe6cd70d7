//! The domain `trajectory`: flights with concealed effects.

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

use super::draw::{between, choose, log_between, sign, whole};
use super::flights::{Flights, HEADER, describe, filmed};
use super::key::{Concealed, Hidden, Key, Place};
use super::maker::Maker;
use super::rig::RigMaker;
use crate::physics::flight::{Drawn, DrawnRun, Effects, FlightWorld, Gust, Knock, Mast, Push};

/// Makes worlds of the domain `trajectory`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Trajectory;

/// Listed effects that a camera can see in space.
const LISTED: usize = 8;

impl Maker for Trajectory {
    fn domain(&self) -> &'static str {
        "trajectory"
    }

    fn kind(&self, hidden: Hidden) -> Hidden {
        hidden
    }

    fn conceal(&self, hidden: Hidden, seed: u64) -> Concealed {
        if matches!(hidden, Hidden::Leftover | Hidden::Imitated) {
            return RigMaker::<Flights>::NEW.conceal(hidden, seed);
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut key = Key::new(hidden);
        let mut world = filmed(&mut rng);
        let effects = &mut world.effects;
        for which in choose(&mut rng, LISTED, hidden.listed()) {
            listed(effects, which, &mut key, &mut rng);
        }
        if hidden == Hidden::Local {
            local(&mut world, &mut key, &mut rng);
        } else if hidden.unlisted() {
            unlisted(effects, &mut key, &mut rng);
        }
        let drawn = world.draw(seed ^ 0x5eed);
        if world.effects.push.at_height {
            key.place = key.place.map(|jet| in_runs_that_come_there(jet, &drawn));
        }
        Concealed::table(HEADER.into(), drawn.csv(6), key)
    }

    fn without_leftover(&self, hidden: Hidden, seed: u64) -> Option<Concealed> {
        RigMaker::<Flights>::NEW.without_leftover(hidden, seed)
    }
}

fn listed(e: &mut Effects, which: usize, key: &mut Key, rng: &mut ChaCha8Rng) {
    let described = match which {
        0 => {
            e.quadratic_per_m = log_between(rng, 0.002, 0.1);
            0
        }
        1 => {
            e.linear_per_s = log_between(rng, 0.01, 0.4);
            1
        }
        2 => {
            e.lift_m_s2 = sign(rng) * log_between(rng, 0.01, 0.4);
            2
        }
        3 => {
            let size = log_between(rng, 0.01, 0.3);
            e.magnus_per_s = [0.6 * sign(rng) * size, 0.7 * sign(rng) * size, 0.4 * sign(rng) * size];
            3
        }
        4 => {
            wind(e, key, rng);
            return;
        }
        5 => {
            e.camera_scale = sign(rng) * log_between(rng, 0.002, 0.06);
            4
        }
        6 => {
            let size = log_between(rng, 0.002, 0.06);
            e.camera_tilt_rad = [0.8 * sign(rng) * size, 0.6 * sign(rng) * size];
            5
        }
        _ => {
            e.clock_rate = sign(rng) * log_between(rng, 0.001, 0.03);
            6
        }
    };
    describe(e, described, key);
}

/// Moving air acts through drag, which then is at work as well: it comes with the wind, unless a linear drag is there that would pass for the whole
/// of it.
fn wind(e: &mut Effects, key: &mut Key, rng: &mut ChaCha8Rng) {
    e.quadratic_per_m = e.quadratic_per_m.max(log_between(rng, 0.02, 0.1));
    key.remove("quadratic-drag");
    if key.mechanisms.iter().any(|m| m == "linear-drag") {
        describe(e, 0, key);
    } else {
        key.beside = vec!["quadratic-drag".into()];
    }
    let size = log_between(rng, 0.3, 4.0);
    let angle = between(rng, 0.0, std::f64::consts::TAU);
    e.wind_m_s = [size * angle.cos(), size * angle.sin()];
    key.add("wind", &[("wind_x_m_s", e.wind_m_s[0]), ("wind_y_m_s", e.wind_m_s[1])]);
}

fn unlisted(e: &mut Effects, key: &mut Key, rng: &mut ChaCha8Rng) {
    match whole(rng, 0, 4) {
        0 => {
            e.mast =
                Mast { amplitude_m: log_between(rng, 0.003, 0.02), frequency_hz: between(rng, 2.0, 8.0) };
            key.unlisted = Some("a mast that swings".into());
        }
        1 => {
            e.cord_per_s2 = log_between(rng, 0.2, 2.0);
            key.unlisted = Some("a cord that pulls back".into());
        }
        2 => {
            let begin = between(rng, 0.1, 0.35);
            let end = begin + between(rng, 0.1, 0.25);
            e.quadratic_per_m = 0.05;
            // The change of the speed stays when the gust is over: the key states no place in the readings.
            e.gust = Gust { velocity_m_s: [0.0, log_between(rng, 4.0, 15.0), 0.0], window_s: [begin, end] };
            key.unlisted = Some("a gust in still air, with drag".into());
        }
        3 => {
            e.spins_per_s = log_between(rng, 0.03, 0.3);
            key.unlisted = Some("balls that spin each in its own way".into());
        }
        _ => {
            e.knock =
                Knock { height_m: sign(rng) * log_between(rng, 0.005, 0.03), at_s: between(rng, 0.2, 0.5) };
            key.unlisted = Some("a camera that is knocked".into());
            key.place = Some(Place::new("t_s", e.knock.at_s, f64::INFINITY));
        }
    }
}

/// A push for a while, in all runs or from one on, or at some heights.
fn local(world: &mut FlightWorld, key: &mut Key, rng: &mut ChaCha8Rng) {
    let size = log_between(rng, 1.5, 8.0);
    let (turn, up) = (between(rng, 0.0, std::f64::consts::TAU), between(rng, -0.7, 0.7));
    let level = (1.0_f64 - up * up).sqrt();
    let acceleration_m_s2 = [size * level * turn.cos(), size * level * turn.sin(), size * up];
    let push = Push { acceleration_m_s2, ..Push::default() };
    let begin = between(rng, 0.1, 0.35);
    let for_a_while = [begin, begin + between(rng, 0.08, 0.2)];
    let (what, push, place) = match whole(rng, 0, 2) {
        0 => ("a push", Push { between: for_a_while, ..push }, Place::new("t_s", begin, for_a_while[1])),
        1 => {
            world.runs = world.runs.max(5);
            let from_run = whole(rng, 1, world.runs - 2);
            let runs = (from_run..world.runs).map(|run| (run + 1).to_string());
            let place = Place::new("t_s", begin, for_a_while[1]).in_runs(runs);
            ("a push from one run on", Push { between: for_a_while, from_run, ..push }, place)
        }
        _ => {
            let low = between(rng, 1.8, 2.2);
            let heights = [low, low + between(rng, 0.4, 0.8)];
            let push = Push { between: heights, at_height: true, ..push };
            ("a jet of air at some heights", push, Place::new("z_m", low, heights[1]))
        }
    };
    world.effects.push = push;
    key.unlisted = Some(what.into());
    key.place = Some(place);
}

/// A place along the height, in the runs that were seen there.
fn in_runs_that_come_there(place: Place, drawn: &Drawn) -> Place {
    let within = |z: &f64| *z > place.from && *z < place.to;
    let comes_there = |run: &DrawnRun| run.channels.last().is_some_and(|heights| heights.iter().any(within));
    let runs: Vec<_> = drawn.runs.iter().map(|run| (run.label.clone(), comes_there(run))).collect();
    place.in_the_runs(runs)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    /// Balls that stay below a jet of air do not feel it.
    #[test]
    fn a_jet_is_in_the_runs_that_come_there() {
        let mut named = 0;
        for seed in 0..60 {
            let concealed = Trajectory.conceal(Hidden::Local, seed);
            let place = concealed.key.place.unwrap();
            if place.variable == "z_m" {
                assert!(place.runs.len() < 8, "{place:?}");
                named += usize::from(!place.runs.is_empty());
            }
        }
        assert!(named > 8, "{named}");
    }

    /// A wind brings its drag along, whatever was drawn before it; beside a linear drag the key names both.
    #[test]
    fn the_key_says_the_drag_beside_a_wind() {
        let keys = (0..600).map(|seed| Trajectory.conceal(Hidden::Two, seed).key);
        let winds: Vec<Key> = keys.filter(|k| k.mechanisms.iter().any(|m| m == "wind")).collect();
        let named = |k: &Key, id: &str| k.mechanisms.iter().any(|m| m == id);
        for key in &winds {
            let drag = key.parameters.iter().find(|p| p.mechanism == "quadratic-drag");
            assert_eq!(named(key, "quadratic-drag"), named(key, "linear-drag"), "{key:?}");
            assert_eq!(key.beside.is_empty(), named(key, "linear-drag"), "{key:?}");
            assert!(drag.is_none_or(|p| p.value >= 0.02), "{key:?}");
        }
        assert!(winds.len() > 60 && winds.iter().filter(|k| k.beside.is_empty()).count() > 5);
    }
}
