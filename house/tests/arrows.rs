//! Which crate may know which, and where every crate stands on the map.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use std::collections::BTreeMap;

use house::{packages, root};

/// Dependencies on crates of this workspace, by crate; those of tests, examples and benches only on demand.
fn arrows(of_tests_too: bool) -> BTreeMap<String, Vec<String>> {
    let packages = packages().unwrap().into_iter();
    packages
        .map(|mut p| {
            p.dependencies.extend(p.dev_dependencies.into_iter().filter(|_| of_tests_too));
            (p.name, p.dependencies)
        })
        .collect()
}

#[test]
fn dependency_arrows_point_down_and_chapters_never_see_each_other() {
    const SHARED: [&str; 4] = ["hw-traits", "hertz-contact", "bayes-sim", "joint-laws"];
    const CHAPTERS: [&str; 6] =
        ["liquid-haptics", "granular-infer", "bounce-audio", "softcell", "stretch", "dough-mbrl"];
    let arrows = arrows(false);
    assert!(arrows.contains_key("missing-physics") && arrows.contains_key("worlds"), "{arrows:?}");
    for (from, to) in &arrows {
        let allowed: Vec<&str> = match from.as_str() {
            "missing-physics" | "worlds" => vec![],
            name if SHARED.contains(&name) => vec![],
            "hw-drivers" => vec!["hw-traits"],
            "hw-record" => vec!["hw-drivers", "hw-traits"],
            name if CHAPTERS.contains(&name) => SHARED.to_vec(),
            "missing-physics-pours" => vec![],
            "missing-physics-report" => vec!["missing-physics"],
            "missing-physics-domains" => CHAPTERS
                .into_iter()
                .chain(SHARED)
                // What a domain shows of its own it hands over as the report's figures.
                .chain(["missing-physics", "missing-physics-pours", "missing-physics-report"])
                .collect(),
            "missing-physics-import" => vec!["missing-physics-domains"],
            // The proof draws the worlds.
            "missing-physics-prove" => {
                vec!["missing-physics", "missing-physics-domains", "missing-physics-report", "worlds"]
            }
            "missing-physics-cli" => vec![
                "missing-physics",
                "missing-physics-domains",
                "missing-physics-import",
                "missing-physics-prove",
                "missing-physics-report",
            ],
            "missing-physics-web" => vec![
                "missing-physics",
                "missing-physics-domains",
                "missing-physics-import",
                "missing-physics-report",
            ],
            // It reads everything as text; its tests make the bundled recordings again.
            "house" => vec![],
            // Examples look at everything, benches at the examples' helpers too; nothing else looks at either.
            "examples" => arrows.keys().map(String::as_str).filter(|n| *n != "benches").collect(),
            "benches" => arrows.keys().map(String::as_str).collect(),
            other => panic!("{other} has no place on the map: draw it in ARCHITECTURE.md and here"),
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

/// The map names every crate.
#[test]
fn every_crate_is_on_the_map() {
    let map = std::fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    for package in packages().unwrap() {
        let name = format!("`{}`", package.name);
        assert!(
            map.lines().any(|l| l.starts_with('|') && l.contains(&name)),
            "ARCHITECTURE.md does not name {name}"
        );
    }
}
