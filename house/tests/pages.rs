//! Links on pages lead somewhere, and the book is whole.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

use house::{packages, root};
use pulldown_cmark::{Event, LinkType, Options, Parser, Tag, TagEnd};

/// A page: where its links lead, and the anchors of its headings.
#[derive(Debug, Default)]
struct Page {
    links: Vec<String>,
    anchors: BTreeSet<String>,
}

/// The anchor that a heading gets: lower case, spaces as hyphens, without punctuation.
fn anchor(heading: &str) -> String {
    let kept = heading.chars().filter(|c| c.is_alphanumeric() || [' ', '-', '_'].contains(c));
    kept.collect::<String>().to_lowercase().replace(' ', "-")
}

fn read(text: &str) -> Page {
    let (mut page, mut heading) = (Page::default(), None);
    for event in Parser::new_ext(text, Options::ENABLE_TABLES) {
        match event {
            Event::Start(Tag::Link { link_type: LinkType::Autolink | LinkType::Email, .. }) => {}
            Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                page.links.push(dest_url.into_string());
            }
            Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
            Event::End(TagEnd::Heading(_)) => {
                page.anchors.extend(heading.take().map(|h: String| anchor(&h)));
            }
            Event::Text(text) | Event::Code(text) => {
                if let Some(heading) = &mut heading {
                    heading.push_str(&text);
                }
            }
            _ => {}
        }
    }
    page
}

/// A path without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => {
                out.pop();
            }
            other => out.push(other),
        }
    }
    out
}

/// All pages of the workspace, by path from its root.
fn pages() -> BTreeMap<PathBuf, Page> {
    fn visit(folder: &Path, found: &mut BTreeMap<PathBuf, Page>) {
        for entry in std::fs::read_dir(root().join(folder)).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            let path = folder.join(&name);
            if root().join(&path).is_dir() && name != "target" && !name.starts_with('.') {
                visit(&path, found);
            } else if name.ends_with(".md") {
                found.insert(path.clone(), read(&std::fs::read_to_string(root().join(path)).unwrap()));
            }
        }
    }
    let mut found = BTreeMap::new();
    visit(Path::new(""), &mut found);
    found
}

/// A link that leads to a file: the file, and the anchor in it. A link of `rustdoc` (`mod@hear`) or to another host does not.
fn target(from: &Path, link: &str) -> Option<(PathBuf, Option<String>)> {
    if link.contains("://") || link.contains('@') || link.contains("::") {
        return None;
    }
    let (file, anchor) = link.split_once('#').map_or((link, None), |(file, anchor)| (file, Some(anchor)));
    let path = match file {
        "" => from.to_owned(),
        file => plain(&from.parent().unwrap().join(file)),
    };
    Some((path, anchor.map(str::to_owned)))
}

#[test]
fn links_lead_somewhere() {
    let pages = pages();
    let mut seen = 0;
    for (from, page) in &pages {
        for link in &page.links {
            let Some((path, anchor)) = target(from, link) else { continue };
            assert!(root().join(&path).exists(), "{}: {link} leads nowhere", from.display());
            if let Some(anchor) = anchor {
                let known = pages.get(&path).is_some_and(|p| p.anchors.contains(&anchor));
                assert!(known, "{}: {link} leads to no heading", from.display());
            }
            seen += 1;
        }
    }
    assert!(seen > 50);
}

/// Every page of the book is in its summary and leads to other pages of the book alone: built, it stands by itself.
#[test]
fn the_book_is_whole() {
    let (pages, book) = (pages(), Path::new("docs"));
    let summary = book.join("SUMMARY.md");
    let listed: BTreeSet<PathBuf> =
        pages[&summary].links.iter().filter_map(|l| Some(target(&summary, l)?.0)).collect();
    for (path, page) in pages.iter().filter(|(path, _)| path.starts_with(book)) {
        assert!(listed.contains(path) || *path == summary, "{} is not in SUMMARY.md", path.display());
        // The book makes `index.html` of such a page, and its links to the page lead nowhere.
        assert!(!path.ends_with("README.md"), "{}: call it index.md", path.display());
        for link in &page.links {
            let inside = target(path, link).is_none_or(|(to, _)| to.starts_with(book));
            assert!(inside, "{}: {link} leads out of the book", path.display());
        }
    }
    assert!(listed.len() > 10);
}

#[test]
fn links_and_anchors_are_found() {
    let page = read(
        "# The `eq.` 2.1: *walls*\n\n[a](b.md#c) ![d](e.svg) <https://x.org> `[f](g)`\n\n```\n[h](i)\n```\n",
    );
    assert_eq!(page.links, ["b.md#c", "e.svg"]);
    assert_eq!(page.anchors.into_iter().collect::<Vec<_>>(), ["the-eq-21-walls"]);
    let from = Path::new("docs/a/b.md");
    assert_eq!(target(from, "../c.md#d"), Some(("docs/c.md".into(), Some("d".into()))));
    assert_eq!(target(from, "mod@hear"), None);
}

/// Each test, example and bench that a command on a page names is there.
#[test]
fn commands_name_what_is_there() {
    let packages = packages().unwrap();
    let has = |package: Option<&str>, kind: &str, name: &str| {
        let mut of = packages.iter().filter(|p| package.is_none_or(|named| p.name == named));
        of.any(|p| p.targets.iter().any(|(k, n, _)| k == kind && n == name))
    };
    let mut seen = 0;
    for path in pages().keys() {
        let text = std::fs::read_to_string(root().join(path)).unwrap();
        for command in text.split("cargo ").skip(1) {
            let words: Vec<&str> = command.split(['`', '\n']).next().unwrap().split_whitespace().collect();
            let after =
                |flag: &str| words.iter().position(|w| *w == flag).and_then(|at| words.get(at + 1)).copied();
            let package = after("-p");
            for (flag, kind) in [("--test", "test"), ("--example", "example"), ("--bench", "bench")] {
                let Some(name) = after(flag) else { continue };
                assert!(has(package, kind, name), "{}: cargo {}", path.display(), words.join(" "));
                seen += 1;
            }
        }
    }
    assert!(seen > 20);
}
