//! Where a concealed cause acts: from which length on the band answers a dough less, which impacts went unheard, where a table is softer.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use missing_physics::data::Recording;
use missing_physics::diagnosis::Diagnosis;
use missing_physics::engine::{Options, diagnose};
use missing_physics::observer::Silent;
use worlds::concealed::{Concealed, Hidden, makers};

/// Wanted nearer than this part of the lengths that there are.
const CLOSE: f64 = 0.1;

/// The world of a domain with this seed.
fn world_of(domain: &str, hidden: Hidden, seed: u64) -> Concealed {
    makers().iter().find(|maker| maker.domain() == domain).unwrap().conceal(hidden, seed)
}

/// Seeds of doughs in which a place is concealed, the first there are.
const LOCAL: [u64; 3] = [4, 5, 8];

#[test]
fn a_dough_too_long_for_the_band_is_found_by_its_length() {
    lengths_are_found(&LOCAL[..1]);
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_doughs_too_long_for_the_band_are_found_by_their_lengths() {
    lengths_are_found(&LOCAL[1..]);
}

/// What was recorded in a world, and the answer.
fn diagnosed(world: &Concealed) -> (Recording, Diagnosis) {
    let folder = tempfile::tempdir().unwrap();
    for (name, contents) in &world.files {
        std::fs::write(folder.path().join(name), contents).unwrap();
    }
    let (_, loaded) = missing_physics_domains::load(folder.path()).unwrap();
    let options = Options { replicates: 49, ..Options::default() };
    let answer = diagnose(&*loaded.model, &loaded.recording, &loaded.experiments, &options, &Silent).unwrap();
    (loaded.recording, answer)
}

fn lengths_are_found(seeds: &[u64]) {
    seeds.iter().for_each(|seed| assert_found(&world_of("dough-roll", Hidden::Unlisted, *seed)));
}

fn assert_found(world: &Concealed) {
    let (recording, answer) = diagnosed(world);
    let (place, hidden) = (answer.location.first().unwrap(), world.key.place.as_ref().unwrap());
    let along = recording.variables.iter().position(|v| Some(&v.name) == place.variable.as_ref()).unwrap();
    let values = || recording.runs.iter().flat_map(|run| &run.inputs[along]).copied();
    let extent = values().fold(0.0, f64::max) - values().fold(f64::INFINITY, f64::min);
    assert_eq!(place.variable.as_ref(), Some(&hidden.variable));
    let from = place.from.unwrap();
    assert!((from - hidden.from).abs() < CLOSE * extent, "{from} m, and not {} m", hidden.from);
}

/// A hull that rolls, and capsizes under what is near its law: the law is said, and tested beside what it does not capsize under.
#[test]
fn a_law_under_which_a_hull_nearly_capsizes_is_said() {
    let world = world_of("motion", Hidden::Imitated, 17_210_609_811_643_631_418);
    let (_, answer) = diagnosed(&world);
    assert!(answer.chosen.is_empty());
    let law = answer.law.unwrap();
    assert!(law.p_value.is_some(), "{law:?}");
}

/// Each at the impact before it or the one after it, and nothing else.
#[test]
fn impacts_that_went_unheard_are_found_one_by_one() {
    let world = world_of("bounce", Hidden::Local, 3);
    assert!(world.key.events.len() > 2);
    let (_, answer) = diagnosed(&world);
    let found: Vec<(&String, f64)> =
        answer.location.iter().map(|place| (&place.runs[0], place.from.unwrap())).collect();
    assert_eq!(found.len(), world.key.events.len(), "{found:?} {:?}", world.key.events);
    for (run, impact) in &world.key.events {
        let there = |(r, at): &(&String, f64)| *r == run && (*at == *impact || *at == impact + 1.0);
        assert!(found.iter().any(there), "{found:?} {:?}", world.key.events);
    }
    let unheard = |place: &missing_physics::diagnosis::Location| place.as_if.as_ref().unwrap().what.clone();
    assert!(answer.location.iter().all(|place| unheard(place) == "impacts that were not heard"));
}

/// Seeds of tables with such a stripe, the first there are.
const STRIPES: [u64; 3] = [1, 5, 8];

/// Places are heard to some millimetres, the stripe is two to four centimetres wide.
#[test]
fn a_softer_stripe_of_the_table_is_found_where_it_is() {
    softer_stripes_are_found(&STRIPES[..1]);
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_softer_stripes_of_tables_are_found_where_they_are() {
    softer_stripes_are_found(&STRIPES[1..]);
}

fn softer_stripes_are_found(seeds: &[u64]) {
    const WITHIN_M: f64 = 0.01;
    for world in seeds.iter().map(|seed| world_of("bounce", Hidden::Local, *seed)) {
        let hidden = world.key.place.as_ref().unwrap();
        assert_eq!(hidden.variable, "x_m");
        let (_, answer) = diagnosed(&world);
        let place = answer.location.first().unwrap();
        assert_eq!(place.variable.as_deref(), Some("x_m"));
        let off = |found: Option<f64>, true_m: f64| (found.unwrap() - true_m).abs();
        let off = off(place.from, hidden.from).max(off(place.to, hidden.to));
        assert!(off < WITHIN_M, "{place:?} {hidden:?}");
        assert_eq!(place.as_if.as_ref().unwrap().what, "another restitution");
    }
}

/// Seeds of hulls whose way has a bump of more than 15 sigmas, the first there are.
const HULLS: [u64; 3] = [74, 123, 131];

/// A hull's baseline can be scaled: beside an amount of what was measured it would leave nothing, of whatever was measured.
#[test]
fn a_bump_on_the_way_of_a_hull_is_found_where_it_is() {
    bumps_on_the_way_of_hulls_are_found(&HULLS[..1]);
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_bumps_on_the_way_of_hulls_are_found_where_they_are() {
    bumps_on_the_way_of_hulls_are_found(&HULLS[1..]);
}

fn bumps_on_the_way_of_hulls_are_found(seeds: &[u64]) {
    const PLAIN: f64 = 15.0;
    for world in seeds.iter().map(|seed| world_of("motion", Hidden::Local, *seed)) {
        let hidden = world.key.place.as_ref().unwrap();
        assert_eq!(hidden.variable, "inclinometer_rad");
        assert!(world.key.strength.unwrap() > PLAIN);
        let (_, answer) = diagnosed(&world);
        let place = answer.location.first().unwrap();
        assert_eq!(place.variable.as_deref(), Some("inclinometer_rad"));
        let (from, to) = (place.from.unwrap(), place.to.unwrap());
        let both = to.min(hidden.to) - from.max(hidden.from);
        assert!(both > 0.5 * (to.max(hidden.to) - from.min(hidden.from)), "{place:?} {hidden:?}");
        assert_eq!(place.as_if.as_ref().unwrap().what, "a force");
    }
}
