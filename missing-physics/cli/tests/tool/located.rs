//! A dough that the band answers less once it is longer than a length: the answer says from which length on.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use missing_physics::engine::{Options, diagnose};
use missing_physics::observer::Silent;
use worlds::concealed::{Concealed, Hidden, makers};

/// Wanted nearer than this part of the lengths that there are.
const CLOSE: f64 = 0.1;

/// Worlds in which a place is concealed, in the order of their seeds.
fn local() -> impl Iterator<Item = Concealed> {
    let doughs = makers().iter().find(|maker| maker.domain() == "dough-roll").unwrap();
    (1..).map(|seed| doughs.conceal(Hidden::Unlisted, seed)).filter(|w| w.key.place.is_some())
}

#[test]
fn a_dough_too_long_for_the_band_is_found_by_its_length() {
    assert_found(&local().next().unwrap());
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_doughs_too_long_for_the_band_are_found_by_their_lengths() {
    local().take(3).for_each(|world| assert_found(&world));
}

fn assert_found(world: &Concealed) {
    let folder = tempfile::tempdir().unwrap();
    for (name, contents) in &world.files {
        std::fs::write(folder.path().join(name), contents).unwrap();
    }
    let (_, loaded) = missing_physics_domains::load(folder.path()).unwrap();
    let options = Options { replicates: 49, ..Options::default() };
    let recording = &loaded.recording;
    let answer = diagnose(&*loaded.model, recording, &loaded.experiments, &options, &Silent).unwrap();
    let (place, hidden) = (answer.location.first().unwrap(), world.key.place.as_ref().unwrap());
    let along = recording.variables.iter().position(|v| Some(&v.name) == place.variable.as_ref()).unwrap();
    let values = || recording.runs.iter().flat_map(|run| &run.inputs[along]).copied();
    let extent = values().fold(0.0, f64::max) - values().fold(f64::INFINITY, f64::min);
    assert_eq!(place.variable.as_ref(), Some(&hidden.variable));
    let from = place.from.unwrap();
    assert!((from - hidden.from).abs() < CLOSE * extent, "{from} m, and not {} m", hidden.from);
}
