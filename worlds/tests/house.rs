//! Rules of the whole workspace: which crate may know which, and what is bundled.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// What cargo knows of the workspace's packages.
fn packages() -> Vec<serde_json::Value> {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--format-version", "1", "--offline"])
        .current_dir(root())
        .output()
        .unwrap();
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    metadata["packages"].as_array().unwrap().clone()
}

/// Dependencies on crates of this workspace, by crate; those of tests, examples and benches only on demand.
fn arrows(of_tests_too: bool) -> BTreeMap<String, Vec<String>> {
    let packages = packages();
    let names: Vec<&str> = packages.iter().map(|p| p["name"].as_str().unwrap()).collect();
    packages
        .iter()
        .map(|p| {
            let dependencies = p["dependencies"].as_array().unwrap();
            let ours = dependencies
                .iter()
                .filter(|d| of_tests_too || d["kind"] != "dev")
                .filter_map(|d| d["name"].as_str())
                .filter(|n| names.contains(n));
            (p["name"].as_str().unwrap().to_owned(), ours.map(str::to_owned).collect())
        })
        .collect()
}

#[test]
fn dependency_arrows_point_down_and_chapters_never_see_each_other() {
    const SHARED: [&str; 3] = ["hw-traits", "hertz-contact", "bayes-sim"];
    const CHAPTERS: [&str; 6] =
        ["liquid-haptics", "granular-infer", "bounce-audio", "softcell", "stretch", "dough-mbrl"];
    let arrows = arrows(false);
    assert!(arrows.contains_key("missing-physics") && arrows.contains_key("worlds"), "{arrows:?}");
    for (from, to) in &arrows {
        let allowed: Vec<&str> = match from.as_str() {
            "missing-physics" | "worlds" => vec![],
            name if SHARED.contains(&name) => vec![],
            name if CHAPTERS.contains(&name) => SHARED.to_vec(),
            "missing-physics-pours" => vec![],
            "missing-physics-report" => vec!["missing-physics"],
            "missing-physics-domains" => CHAPTERS
                .into_iter()
                .chain(SHARED)
                .chain(["missing-physics", "missing-physics-pours"])
                .collect(),
            // The proof draws the worlds.
            "missing-physics-prove" => {
                vec!["missing-physics", "missing-physics-domains", "missing-physics-report", "worlds"]
            }
            "missing-physics-cli" => vec![
                "missing-physics",
                "missing-physics-domains",
                "missing-physics-prove",
                "missing-physics-report",
            ],
            // Examples look at everything, benches at the examples' helpers too; nothing else looks at either.
            "examples" => arrows.keys().map(String::as_str).filter(|n| *n != "benches").collect(),
            "benches" => arrows.keys().map(String::as_str).collect(),
            other => panic!("{other} has no place on the map: add it to DESIGN's arrows and here"),
        };
        for name in to {
            assert!(allowed.contains(&name.as_str()), "{from} may not depend on {name}");
        }
    }
}

/// What makes test data shares no code with what is tested, not even in its own tests.
#[test]
fn worlds_stand_apart() {
    let arrows = arrows(true);
    assert_eq!(arrows["worlds"], Vec::<String>::new());
    let users = arrows.iter().filter(|(_, to)| to.iter().any(|n| n == "worlds")).count();
    assert!(users > 0, "nobody uses the worlds: {arrows:?}");
}

/// In the tool only the proof looks at the worlds: no model that is put to the test can.
#[test]
fn models_under_test_do_not_see_the_worlds() {
    let mut files = vec![root().join("missing-physics")];
    let mut users = Vec::new();
    while let Some(path) = files.pop() {
        if path.is_dir() && path.file_name().is_some_and(|n| n != "tests") {
            files.extend(std::fs::read_dir(&path).unwrap().map(|e| e.unwrap().path()));
        } else if std::fs::read_to_string(&path).is_ok_and(|text| text.contains("worlds::")) {
            users.push(path);
        }
    }
    assert!(
        users.len() > 1 && users.iter().all(|p| p.to_str().unwrap().contains("/prove/src/")),
        "{users:?}"
    );
}

/// The gate runs the numbered examples of `examples/` by pattern, and every other one by name.
#[test]
fn the_gate_runs_every_example() {
    let gate = std::fs::read_to_string(root().join(".ci/run")).unwrap();
    assert!(gate.contains("for example in examples/[0-9]*; do"));
    let mut seen = 0;
    for package in packages() {
        for target in package["targets"].as_array().unwrap() {
            if !target["kind"].as_array().unwrap().iter().any(|k| k == "example") {
                continue;
            }
            let (package, name) = (package["name"].as_str().unwrap(), target["name"].as_str().unwrap());
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
fn source_files_fit_on_a_few_screens() {
    fn visit(folder: &Path, seen: &mut usize) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            if path.is_dir() && name != "target" && !name.starts_with('.') {
                visit(&path, seen);
            } else if name.ends_with(".rs") {
                let lines = std::fs::read_to_string(&path).unwrap().lines().count();
                assert!(lines <= 700, "{} has {lines} lines", path.display());
                *seen += 1;
            }
        }
    }
    let mut seen = 0;
    visit(&root(), &mut seen);
    assert!(seen > 20);
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
