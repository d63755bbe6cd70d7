//! Files of a crate do not import each other in a loop.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::collections::BTreeSet;
use std::path::Path;

use house::{circles, modules, packages};

#[test]
fn no_files_import_each_other_in_a_loop() {
    let (mut seen, mut found) = (0, BTreeSet::new());
    for package in packages().unwrap() {
        for (_, _, file) in &package.targets {
            let modules = modules(file).unwrap();
            seen += modules.len();
            found.extend(circles(&modules).iter().map(ToString::to_string));
        }
    }
    assert!(seen > 100, "{seen} modules");
    assert!(found.is_empty(), "{}", Vec::from_iter(found).join("\n"));
}

/// The circles of a made-up crate, each as its files' names.
fn circles_of(files: &[(&str, &str)]) -> Vec<Vec<String>> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let file = folder.path().join(name);
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        std::fs::write(file, text).unwrap();
    }
    let modules = modules(&folder.path().join("lib.rs")).unwrap();
    let name = |file: &&Path| file.strip_prefix(folder.path()).unwrap().display().to_string();
    circles(&modules).iter().map(|c| c.files.iter().map(name).collect()).collect()
}

#[test]
fn a_circle_is_found_however_it_is_written() {
    let lib = ("lib.rs", "mod a; mod b;");
    let a = ("a.rs", "use crate::b::{self, inner::{Thing as Other, *}}; pub struct A(Other);");
    for back in [
        "use crate::a::A;",
        "use super::a::*; fn f(_: A) {}",
        "fn f() { let _: crate::a::A; }",
        "fn f() { use super::a::A; }",
        "fn f() { assert!(super::a::A::new().is_some()); }",
        "use super::a; fn f() -> a::A { todo!() }",
        "impl crate::a::A { fn f() {} }",
    ] {
        let b = format!("pub mod inner {{ pub struct Thing; }} {back}");
        assert_eq!(circles_of(&[lib, a, ("b.rs", &b)]), [["a.rs", "b.rs"]], "{back}");
    }
}

#[test]
fn a_circle_through_names_that_were_handed_on_is_found() {
    let found = circles_of(&[
        ("lib.rs", "mod room; mod other; pub use room::A;"),
        ("room/mod.rs", "mod a; mod b; pub use a::*; pub(crate) use b::{B as Renamed};"),
        ("room/a.rs", "pub struct A(crate::room::Renamed);"),
        ("room/b.rs", "pub struct B(crate::other::C);"),
        ("other.rs", "use crate::A; pub struct C(A);"),
    ]);
    assert_eq!(found, [["other.rs", "room/a.rs", "room/b.rs"]]);
}

#[test]
fn what_ties_no_files_is_no_circle() {
    let alone = [
        // Handing on, declaring, and what a module does with its own children.
        ("lib.rs", "mod room; mod ground; pub use room::{A, run}; pub fn all() { room::run() }"),
        (
            "room/mod.rs",
            "mod a; mod ground; pub use a::A; pub struct B; use a::f; pub fn run() { f(); a::g() }",
        ),
        (
            "room/a.rs",
            "use super::B; use super::ground::ground as under; pub struct A(B); pub fn f() { under() } pub fn g() {}",
        ),
        // A file and a local of the same name; a word in a text.
        ("room/ground.rs", "pub fn ground() { let a = 1; println!(\"crate::room::a::A {a}\"); }"),
        // Tests look where they like.
        (
            "ground.rs",
            "#[cfg(test)] mod tests { use crate::room::A; } #[cfg(test)] use crate::room::run; pub struct G;",
        ),
    ];
    assert_eq!(circles_of(&alone), Vec::<Vec<String>>::new());
}
