//! No recording, however mutilated, panics, hangs or leaves half a report: every domain, and every kind of file that is read.
//!
//! The short test tries a few mutants of each, and every one in `mutilated.seeds` that was ever caught. The long one tries new ones
//! for a minute for each kind, writes what it catches into that file, and fails:
//! `cargo test --release -p missing-physics-cli --test mutilated -- --ignored`
//! Both try all kinds, or those that `MUTILATED=png,stl` names.
//! Readers alone are fuzzed by their coverage as well, by `.ci/fuzz`; what that found stands in `fuzz/seeds`.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

mod kinds;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

use kinds::fed::{Fed, TARGETS, kept as found, wordless};
use kinds::{Kind, kinds};
use missing_physics::engine::Options;
use missing_physics::observer::Silent;
use missing_physics_cli::commands::{DiagnoseArguments, diagnose};
use missing_physics_domains as domains;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What a careless hand, a broken program or a bad disk puts into a file.
const WORDS: [&str; 18] = [
    "nan",
    "inf",
    "-inf",
    "-1",
    "0",
    "1e309",
    "1e-320",
    "-0.0",
    "99999999999999999999",
    ",",
    "\n",
    "\"",
    "[",
    "{",
    "=",
    "\u{fffd}",
    "\0",
    "e",
];

fn mutilate(bytes: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    for _ in 0..rng.random_range(1..4) {
        let (n, how) = (bytes.len(), rng.random_range(0..7));
        let at = if n > 0 { rng.random_range(0..n) } else { return };
        let end = (at + rng.random_range(1..40)).min(n);
        let word = WORDS[rng.random_range(0..WORDS.len())];
        match how {
            0 => bytes[at] = rng.random(),
            1 => bytes[at] ^= 1 << rng.random_range(0..8),
            2 => drop(bytes.drain(at..end)),
            3 => {
                let again = bytes[at..end].to_vec();
                drop(bytes.splice(at..at, again));
            }
            4 => drop(bytes.splice(at..at, word.bytes())),
            5 => {
                // A whole number or word gives way to another.
                let plain = |b: &u8| b.is_ascii_alphanumeric() || b".-_+".contains(b);
                let length = bytes[at..].iter().take_while(|b| plain(b)).count();
                drop(bytes.splice(at..at + length, word.bytes()));
            }
            _ => bytes.truncate(at),
        }
    }
}

/// Why a mutant is a defect, if it is one.
fn caught(kind: &Kind, seed: u64) -> Option<String> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let folder = tempfile::tempdir().unwrap();
    let victim = kind.victims[rng.random_range(0..kind.victims.len())];
    for (at, (name, bytes)) in kind.files.iter().enumerate() {
        let mut bytes = bytes.clone();
        if at == victim {
            mutilate(&mut bytes, &mut rng);
        }
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    let begin = Instant::now();
    let what = catch_unwind(AssertUnwindSafe(|| answered(kind, folder.path())));
    if begin.elapsed() > Duration::from_secs(60) {
        return Some(format!("took {:.0} s", begin.elapsed().as_secs_f64()));
    }
    what.unwrap_or_else(|_| Some("panicked".into()))
}

fn answered(kind: &Kind, folder: &Path) -> Option<String> {
    if !kind.diagnosed {
        return domains::load(folder).err().and_then(|e| wordless(&e.to_string()));
    }
    let out = tempfile::tempdir().unwrap();
    let (json, html) = (out.path().join("a.json"), out.path().join("a.html"));
    let arguments = DiagnoseArguments {
        folder: folder.into(),
        json: Some(json.clone()),
        html: Some(html.clone()),
        options: Options { replicates: 19, ..Options::default() },
        threads: 1,
        ..DiagnoseArguments::default()
    };
    match diagnose(&arguments, &Silent) {
        Ok(said) => {
            said.write_files().unwrap();
            let whole = std::fs::read_to_string(json)
                .is_ok_and(|text| serde_json::from_str::<serde_json::Value>(&text).is_ok())
                && std::fs::read_to_string(html).is_ok_and(|page| page.trim_end().ends_with("</html>"))
                && !said.text.is_empty();
            (!whole).then(|| "left half a report".into())
        }
        Err(error) => {
            let left = std::fs::read_dir(out.path()).unwrap().count();
            wordless(&error.to_string()).or_else(|| (left > 0).then(|| format!("left {left} files")))
        }
    }
}

/// The kinds that `MUTILATED` names, separated by commas; all of them without it.
fn wanted() -> impl Iterator<Item = Kind> {
    let asked = std::env::var("MUTILATED").ok();
    let named =
        move |kind: &Kind| asked.as_ref().is_none_or(|names| names.split(',').any(|n| n == kind.name));
    kinds().into_iter().filter(named)
}

fn kept() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/mutilated.seeds")
}

#[test]
fn sound_recordings_are_read() {
    for kind in kinds().iter().filter(|k| k.name != "json-lines" && k.name != "grain-pour") {
        let folder = tempfile::tempdir().unwrap();
        kind.files.iter().for_each(|(name, bytes)| std::fs::write(folder.path().join(name), bytes).unwrap());
        // Templates of three rows are read, if not diagnosed: what is mutilated must be sound before.
        let read = domains::load(folder.path());
        let few = read.as_ref().err().is_some_and(|e| e.to_string().contains("rows"));
        assert!(read.is_ok() || few, "{}: {}", kind.name, read.err().unwrap());
    }
}

#[test]
fn mutants_are_read_or_refused() {
    let seeds = std::fs::read_to_string(kept()).unwrap();
    for kind in wanted() {
        let known = seeds.lines().filter_map(|line| line.strip_prefix(kind.name)?.trim().parse().ok());
        for seed in (0..10).chain(known) {
            assert_eq!(caught(&kind, seed), None, "{} {seed}", kind.name);
        }
    }
}

#[test]
fn what_the_fuzzer_found_is_read_or_refused() {
    for target in TARGETS {
        let fed = Fed::new(target);
        let found = std::fs::read_dir(found(target)).into_iter().flatten();
        let found = found.map(|entry| std::fs::read(entry.unwrap().path()).unwrap());
        fed.sound().chain(found).for_each(|bytes| fed.read(&bytes));
    }
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_mutants_for_a_minute_each() {
    use std::io::Write as _;
    let mut file = std::fs::OpenOptions::new().append(true).open(kept()).unwrap();
    let mut all = Vec::new();
    for kind in wanted() {
        let begin = Instant::now();
        let mut tried = 0;
        // Seeds of the day: every long run tries others.
        let day =
            std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_secs() / 86_400;
        while begin.elapsed() < Duration::from_secs(60) {
            let seed = (day << 32) + tried;
            if let Some(what) = caught(&kind, seed) {
                writeln!(file, "{} {seed}", kind.name).unwrap();
                all.push(format!("{} {seed}: {what}", kind.name));
            }
            tried += 1;
        }
        println!("{}: {tried} mutants", kind.name);
    }
    assert!(all.is_empty(), "{all:#?}");
}
