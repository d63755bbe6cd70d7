//! A test that needs data, an interpreter or minutes is left out until it is asked for, and says why; none passes without testing.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use house::{root, sources};

/// How the name of a test that is left out begins, by which the gate asks for it, and the reason that stands in its `ignore`.
const KINDS: [(&str, &str); 7] = [
    ("shared_long_", "needs ../shared, long: .ci/run --long"),
    ("shared_", "needs ../shared"),
    ("long_", "long: .ci/run --long"),
    ("python_", "needs python3"),
    ("browser_page_", "needs chromium and the page that .ci/web builds, long: .ci/run --long"),
    ("browser_", "needs chromium, long: .ci/run --long"),
    ("", "by hand: "),
];

#[test]
fn tests_that_are_left_out_are_named_as_the_gate_asks_for_them() {
    let gate = std::fs::read_to_string(root().join(".ci/run")).unwrap();
    let mut seen = 0;
    for file in sources(&root()).unwrap().iter().filter(|f| !f.ends_with(file!())) {
        let text = std::fs::read_to_string(file).unwrap();
        let file = file.display();
        assert!(!text.contains("NOT TESTED") && !text.contains("#[ignore]"), "{file}");
        for part in text.split("#[ignore = \"").skip(1) {
            let (reason, rest) = part.split_once('"').unwrap();
            let test = rest.split_once("fn ").unwrap().1.split_once('(').unwrap().0;
            let (beginning, wanted) = KINDS.iter().find(|k| test.starts_with(k.0)).unwrap();
            let named = reason == *wanted || beginning.is_empty() && reason.starts_with(wanted);
            assert!(named, "{file}: {test} is left out for {reason:?}, its name is one for {wanted:?}");
            assert!(gate.contains(beginning), ".ci/run does not ask for {beginning}");
            seen += 1;
        }
    }
    assert!(seen > 10, "{seen}");
}
