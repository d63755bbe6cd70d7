//! What is published can be: what a registry asks of it, the first lines of its README, and the licences of what it needs.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use std::collections::BTreeMap;
use std::fs::read_to_string;
use std::path::Path;

use house::{metadata, root};
use serde_json::Value;

fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

/// All packages of the workspace, by name, and whether they are published.
fn members() -> BTreeMap<String, (Value, bool)> {
    let all = metadata(&["--no-deps", "--offline"]).unwrap();
    let member = |p: &Value| (text(&p["name"]).to_owned(), (p.clone(), p["publish"].is_null()));
    let members: BTreeMap<_, _> = list(&all["packages"]).iter().map(member).collect();
    let unpublished: Vec<&str> =
        members.iter().filter(|(_, (_, published))| !published).map(|(name, _)| name.as_str()).collect();
    assert_eq!(unpublished, ["benches", "examples", "house", "missing-physics-web"]);
    members
}

/// Limits of crates.io (`cargo publish` fails beyond them), and slugs of its list of categories.
#[test]
fn manifests_say_what_a_registry_asks() {
    const CATEGORIES: [&str; 11] = [
        "algorithms",
        "command-line-utilities",
        "computer-vision",
        "development-tools::testing",
        "hardware-support",
        "mathematics",
        "multimedia::audio",
        "science",
        "science::robotics",
        "simulation",
        "visualization",
    ];
    for (name, (package, published)) in members() {
        if !published {
            continue;
        }
        for field in ["description", "license", "readme", "rust_version"] {
            assert!(!text(&package[field]).is_empty(), "{name} has no {field}");
        }
        let keywords = list(&package["keywords"]);
        assert!((1..=5).contains(&keywords.len()), "{name}: {keywords:?}");
        for keyword in keywords.iter().map(text) {
            let plain = keyword.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-');
            assert!(plain && keyword.len() <= 20, "{name}: the keyword {keyword}");
        }
        let categories = list(&package["categories"]);
        assert!((1..=5).contains(&categories.len()), "{name}: {categories:?}");
        for category in categories.iter().map(text) {
            assert!(CATEGORIES.contains(&category), "{name}: the category {category}");
        }
    }
}

/// A dependency of a published crate on a crate beside it has a version, and is published too. (Of a test's, only those that have a
/// version are published with the crate.)
#[test]
fn published_crates_need_published_ones() {
    let members = members();
    let mut seen = 0;
    for (name, (package, _)) in members.iter().filter(|(_, (_, published))| *published) {
        for needed in list(&package["dependencies"]).iter().filter(|d| d["path"].is_string()) {
            let (to, wanted) = (text(&needed["name"]), text(&needed["req"]));
            if needed["kind"] == "dev" && wanted == "*" {
                continue;
            }
            let (there, published) = &members[to];
            assert!(*published, "{name} needs {to}, which is not published");
            assert_eq!(wanted, format!("^{}", text(&there["version"])), "{name} needs {to}");
            seen += 1;
        }
    }
    assert!(seen > 0);
}

/// `.ci/run --long` lints every crate with its default features alone, and those that have any without.
#[test]
fn the_gate_lints_crates_without_their_default_features() {
    let gate = read_to_string(root().join(".ci/run")).unwrap();
    let lint = gate.lines().find(|line| line.contains("--no-default-features -p")).unwrap();
    let linted: Vec<&str> = lint.split(" -p ").skip(1).filter_map(|rest| rest.split(' ').next()).collect();
    for (name, (package, _)) in members() {
        let defaults = !list(&package["features"]["default"]).is_empty();
        assert!(!defaults || linted.contains(&name.as_str()), "{name} is not linted without its defaults");
    }
}

/// The fenced blocks of a page: what stands beside the fence, and their lines.
fn blocks(page: &str) -> Vec<(&str, Vec<&str>)> {
    let mut blocks: Vec<(&str, Vec<&str>)> = Vec::new();
    let mut open = false;
    for line in page.lines() {
        match line.strip_prefix("```") {
            Some(kind) if !open => blocks.push((kind, Vec::new())),
            None if open => blocks.last_mut().unwrap().1.push(line),
            _ => {}
        }
        open ^= line.starts_with("```");
    }
    blocks
}

/// The versions that a table `[dependencies]` asks for, by name.
fn wanted(manifest: &str) -> BTreeMap<String, String> {
    let manifest: toml::Table = manifest.parse().unwrap();
    let entry = |(name, entry): (&String, &toml::Value)| {
        let version = entry.get("version").unwrap_or(entry);
        (name.clone(), version.as_str().unwrap_or_default().to_owned())
    };
    manifest["dependencies"].as_table().unwrap().iter().map(entry).collect()
}

/// A README begins with title, purpose, the lines of `[dependencies]` in the versions that the workspace has, and a program; it links
/// to nothing that a package leaves behind.
#[test]
fn readmes_begin_with_how_to_begin() {
    let root_manifest = read_to_string(root().join("Cargo.toml")).unwrap();
    let ours = wanted(&root_manifest.replace("[workspace.dependencies]", "[dependencies]"));
    let mut shown = BTreeMap::new();
    for (name, (package, published)) in members() {
        if !published {
            continue;
        }
        let folder = Path::new(text(&package["manifest_path"])).parent().unwrap().to_owned();
        let page = read_to_string(folder.join("README.md")).unwrap();
        assert!(page.starts_with(&format!("# {name}\n\n")), "{name}: the title");
        assert!(!page.contains("](..") && !page.contains("](/"), "{name}: a link out of the package");
        let blocks = blocks(&page);
        let (kind, lines) = &blocks[0];
        assert!(*kind == "toml" && lines[0] == "[dependencies]", "{name}: {lines:?}");
        let begin = page.lines().position(|line| line == "```toml").unwrap();
        assert!(begin <= 5, "{name}: [dependencies] stands in line {begin}");
        assert!(["", "no_run", "console"].contains(&blocks[1].0), "{name}: a program comes first");
        let wanted = wanted(&lines.join("\n"));
        assert!(wanted.contains_key(&name), "{name}: {wanted:?}");
        for (needed, version) in wanted {
            assert_eq!(ours.get(&needed), Some(&version), "{name}: {needed}");
            shown.insert(needed, version);
        }
    }
    // The program outside the workspace asks for the crates as the READMEs do.
    let outside = wanted(&read_to_string(root().join("tests/downstream/Cargo.toml")).unwrap());
    assert!(outside.len() >= 3, "{outside:?}");
    for (name, version) in &outside {
        assert_eq!(shown.get(name), Some(version), "tests/downstream: {name}");
    }
}

/// `cargo deny check licenses sources` without cargo-deny, for this machine's platform.
#[test]
fn dependencies_have_a_licence_that_is_allowed() {
    let denied: toml::Table = read_to_string(root().join("deny.toml")).unwrap().parse().unwrap();
    let strings = |value: &toml::Value| -> Vec<String> {
        value.as_array().unwrap().iter().map(|v| v.as_str().unwrap().to_owned()).collect()
    };
    let allowed = strings(&denied["licenses"]["allow"]);
    let sources = strings(&denied["sources"]["allow-registry"]);
    let allowed: Vec<spdx::Licensee> = allowed.iter().map(|l| spdx::Licensee::parse(l).unwrap()).collect();
    let all = metadata(&["--locked", "--filter-platform", "host-tuple"]).unwrap();
    let packages = list(&all["packages"]);
    assert!(packages.len() > 50);
    for package in packages {
        let (name, licence) = (text(&package["name"]), text(&package["license"]));
        let terms = spdx::Expression::parse_mode(licence, spdx::ParseMode::LAX)
            .unwrap_or_else(|e| panic!("{name} is licensed by {licence:?}: {e}"));
        let holds = terms.evaluate(|needed| allowed.iter().any(|ours| ours.satisfies(needed)));
        assert!(holds, "{name} is licensed by {licence}, which deny.toml does not allow");
        let source = package["source"].as_str().map(|s| s.trim_start_matches("registry+").to_owned());
        assert!(source.iter().all(|s| sources.contains(s)), "{name} comes from {source:?}");
    }
}
