//! A diagnosis can be written by serde as it stands.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use crate::common::{Ball, World};
use missing_physics::engine::{Options, diagnose};
use missing_physics::observer::Silent;

#[test]
fn a_diagnosis_is_written_with_all_that_is_in_it() {
    let world = World { linear_drag: 0.5, ..World::NULL };
    let options = Options { replicates: 99, ..Options::default() };
    let answer = diagnose(&Ball::default(), &world.draw(3), &[], &options, &Silent).unwrap();
    let written = serde_json::to_value(&answer).unwrap();
    assert_eq!(written["verdict"], answer.verdict.word());
    assert_eq!(written["chosen"], serde_json::json!(answer.chosen));
    assert_eq!(written["noise"][0]["source"], "differences");
    assert_eq!(written["p_value"].as_f64(), Some(answer.p_value));
    assert_eq!(written["mechanisms"].as_array().map(Vec::len), Some(answer.mechanisms.len()));
    let value = answer.mechanisms[0].parameters[0].value;
    assert_eq!(written["mechanisms"][0]["parameters"][0]["value"].as_f64(), Some(value));
    assert_eq!(written["curves"][0]["measured"][0].as_array().map(Vec::len), Some(world.rows));
    assert_eq!(written["repaired"], serde_json::to_value(&answer.repaired).unwrap());
}
