//! What stands on the pages is what the tool prints, reads and answers.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use missing_physics::model::{Scope, Spec};
use serde_json::Value;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn page(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap()
}

/// What the tool prints, called from the root of the workspace.
fn printed(arguments: &[&str]) -> String {
    let tool = env!("CARGO_BIN_EXE_missing-physics");
    let output = Command::new(tool).args(arguments).current_dir(root()).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// Each command of a page that is followed by a block of text prints that text; `shown` says how many there are.
#[track_caller]
fn shows_what_the_tool_prints(path: &str, shown: usize) {
    let page = page(path);
    let blocks: Vec<(&str, &str)> =
        page.split("```").skip(1).step_by(2).map(|block| block.split_once('\n').unwrap()).collect();
    let mut compared = 0;
    for pair in blocks.windows(2) {
        let [("sh", command), ("text", text)] = pair else { continue };
        let arguments = command.trim().strip_prefix("cargo run --release -- ").unwrap();
        assert_eq!(printed(&arguments.split_whitespace().collect::<Vec<_>>()), *text, "{path}: {command}");
        compared += 1;
    }
    assert_eq!(compared, shown, "{path}");
    // `.ci/pages` leaves these pages to this test: no command is without its text.
    let commands = page.lines().filter(|line| line.starts_with("cargo run --release -- ")).count();
    assert_eq!(commands, shown, "{path}");
}

#[test]
fn the_front_page_shows_what_the_tool_prints() {
    shows_what_the_tool_prints("README.md", 2);
}

#[test]
fn the_page_of_measured_recordings_shows_what_the_tool_prints() {
    shows_what_the_tool_prints("docs/evidence/real.md", 3);
}

/// The front page's picture is what `--svg` writes.
#[test]
fn the_picture_is_made_by_the_tool() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.svg");
    printed(&["diagnose", "recordings/dropped-ball", "--svg", path.to_str().unwrap()]);
    let made = std::fs::read_to_string(path).unwrap();
    assert!(made == page("docs/dropped-ball.svg"), "docs/dropped-ball.svg: diagnose with --svg again");
}

/// The words of a text that can be names: letters, digits, `_` and `-`.
fn words(text: &str) -> BTreeSet<&str> {
    text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_' && c != '-').collect()
}

/// The section of a heading of the second level.
fn section<'p>(page: &'p str, heading: &str) -> &'p str {
    let at = format!("\n## {heading}\n");
    let begin =
        page.find(&at).unwrap_or_else(|| panic!("docs/format.md has no section {heading}")) + at.len();
    let rest = &page[begin..];
    &rest[..rest.find("\n## ").unwrap_or(rest.len())]
}

/// Names of a model that an answer holds: mechanisms, their parameters, the baseline's shared ones.
fn answered(spec: &Spec) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    let mut freed: BTreeSet<usize> = spec.terms.iter().map(|t| t.parameter).collect();
    for mechanism in &spec.mechanisms {
        names.insert(mechanism.id.clone());
        names.extend(mechanism.parameters.iter().map(|&p| spec.parameters[p].name.clone()));
        names.extend(mechanism.derived.iter().map(|d| d.name.clone()));
        names.extend(mechanism.derived_per_run.iter().map(|d| d.name.clone()));
        freed.extend(mechanism.parameters.iter().chain(&mechanism.companions));
    }
    let baseline = spec.parameters.iter().enumerate().filter(|(i, _)| !freed.contains(i));
    names.extend(baseline.filter(|(_, p)| p.scope == Scope::Shared).map(|(_, p)| p.name.clone()));
    names
}

#[test]
fn the_format_has_every_domain_column_key_and_mechanism() {
    let page = page("docs/format.md");
    for domain in missing_physics_domains::all() {
        let known = words(section(&page, domain.id()));
        let template = domain.template();
        let mut wanted = answered(&domain.spec());
        let read = domain.reads().iter().flat_map(|(what, how)| [*what, *how]);
        // What has a unit is a name, other words are prose; a recording of `custom` names its own columns.
        for text in read.chain([template.header]).filter(|_| domain.id() != "custom") {
            wanted.extend(words(text).into_iter().filter(|w| w.contains('_')).map(str::to_owned));
        }
        let header = template.data.1.lines().next().unwrap();
        wanted.extend(words(header).into_iter().filter(|_| domain.id() != "custom").map(str::to_owned));
        for (what, _) in domain.reads() {
            wanted.extend(what.split(['[', ']']).skip(1).step_by(2).flat_map(words).map(str::to_owned));
            if what.starts_with("[[") || what.starts_with("[simulator]") {
                wanted.extend(words(what).into_iter().map(str::to_owned));
            }
        }
        // What all domains have in common stands above their sections.
        let common = ["noise", "rig"];
        let missing: Vec<&str> = wanted
            .iter()
            .map(String::as_str)
            .filter(|w| !w.is_empty() && !known.contains(w) && !common.contains(w))
            .collect();
        assert!(missing.is_empty(), "docs/format.md, {}: {missing:?}", domain.id());
        assert!(wanted.len() > 3);
    }
}

/// The names of the fields of an answer; what a channel or an action is called is no field.
fn fields(value: &Value, found: &mut BTreeSet<String>) {
    match value {
        Value::Array(list) => list.iter().for_each(|v| fields(v, found)),
        Value::Object(map) => {
            for (name, inner) in map {
                if !name.ends_with("_m") {
                    found.insert(name.clone());
                }
                // By the names of files.
                if name != "sha256" {
                    fields(inner, found);
                }
            }
        }
        _ => {}
    }
}

#[test]
fn the_format_has_every_field_of_an_answer() {
    let page = page("docs/format.md");
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (answer, model) = (path("answer.json"), path("model.json"));
    printed(&["diagnose", "recordings/dropped-ball", "--json", &answer, "--write-model", &model]);
    for (file, heading) in [(answer, "The answer"), (model, "The repaired model")] {
        let mut found = BTreeSet::new();
        fields(&serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap(), &mut found);
        let known = words(section(&page, heading));
        let missing: Vec<&String> = found.iter().filter(|f| !known.contains(f.as_str())).collect();
        assert!(found.len() > 9 && missing.is_empty(), "docs/format.md, {heading}: {missing:?}");
    }
}
