//! What `new` writes passes `check`, and its answer is what its first lines say.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use std::process::Command;

use serde_json::{Value, json};

fn run(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_missing-physics")).args(arguments).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", text(output.stderr));
    text(output.stdout)
}

fn answer(domain: &str) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(domain);
    let path = path.to_str().unwrap();
    run(&["new", domain, path]);
    let said = run(&["check", path]);
    assert!(said.contains("a sound recording") && !said.contains("hint: "), "{said}");
    serde_json::from_str(&run(&["diagnose", path, "--json", "-"])).unwrap()
}

#[test]
fn templates_in_which_nothing_is_hidden_are_adequate() {
    for domain in ["slosh", "indentation", "liquid-tilt"] {
        let answer = answer(domain);
        assert_eq!(answer["verdict"], "adequate", "{domain}: {}", answer["p_value"]);
    }
}

#[test]
fn every_template_is_a_sound_recording() {
    for domain in missing_physics_domains::all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new");
        run(&["new", domain.id(), path.to_str().unwrap()]);
        let said = run(&["check", path.to_str().unwrap()]);
        assert!(said.contains("a sound recording"), "{said}");
    }
}

#[test]
fn what_the_template_of_a_machine_hides_is_named() {
    assert_eq!(answer("motion")["chosen"], json!(["coulomb-friction"]));
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_what_the_template_of_pours_hides_is_named() {
    assert_eq!(answer("grain-pour")["chosen"], json!(["depth-offset"]));
}
