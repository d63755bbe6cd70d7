//! Files are short, what is bundled is what is made, and the gate runs every example.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use house::{packages, root, sizes, sources};

/// The gate runs the numbered examples of `examples/` by pattern, and every other one by name.
#[test]
fn the_gate_runs_every_example() {
    let gate = std::fs::read_to_string(root().join(".ci/run")).unwrap();
    assert!(gate.contains("for example in examples/[0-9]*; do"));
    let mut seen = 0;
    for package in packages().unwrap() {
        for (_, name, _) in package.targets.iter().filter(|(kind, _, _)| kind == "example") {
            let package = &package.name;
            let numbered = package == "examples" && name.starts_with(|c: char| c.is_ascii_digit());
            let by_name = format!("stage example {name}");
            assert!(
                numbered || gate.lines().any(|l| l == by_name || l.starts_with(&format!("{by_name} "))),
                ".ci/run does not run the example {name} of {package}"
            );
            seen += 1;
        }
    }
    assert!(seen > 0);
}

#[test]
fn bundled_recordings_are_what_the_example_makes() {
    for recording in worlds::bundled::all() {
        let folder = root().join("recordings").join(recording.name);
        let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap_or_default();
        assert!(read("recording.toml") == recording.header, "{}: run the example `bundled`", recording.name);
        assert!(read("data.csv") == recording.data, "{}: run the example `bundled`", recording.name);
        assert!(read("README.md") == recording.readme, "{}: run the example `bundled`", recording.name);
    }
}

#[test]
fn source_files_fit_on_a_few_screens() {
    let files = sources(&root()).unwrap();
    for file in &files {
        let lines = std::fs::read_to_string(file).unwrap().lines().count();
        assert!(lines <= 700, "{} has {lines} lines", file.display());
    }
    assert!(files.len() > 20);
}

/// The map states the size of every package to a quarter; the message says how it is brought up to date.
#[test]
fn the_map_states_sizes_as_they_are() {
    let map = std::fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    for size in sizes().unwrap() {
        let row = size.row();
        let (name, lines) = (row.split(" | ").next().unwrap(), size.total()[1] as f64);
        let stated =
            map.lines().find(|l| l.starts_with(&format!("{name} | ")) && l.matches(" | ").count() == 3);
        let stated = stated.and_then(|l| l.split(" | ").nth(2)).and_then(|l| l.parse::<f64>().ok());
        assert!(
            stated.is_some_and(|stated| (stated / lines - 1.0).abs() < 0.25),
            "ARCHITECTURE.md says {stated:?} lines in {name}, there are {lines}: cargo run -p house -- --write"
        );
    }
}
