//! A proof: the same whatever the number of threads, whole after it was cut off, and of worlds that its arguments tell.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use missing_physics_prove::{ProveArguments, prove_world};

fn prove(folder: &Path, worlds: &str, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_missing-physics"));
    command.args(["prove", "--domain", "indentation", "--worlds", worlds, "--out"]).arg(folder).args(more);
    command
}

fn ran(mut command: Command) -> Output {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{output:?}");
    output
}

#[test]
fn a_proof_that_was_killed_goes_on_to_the_same_score() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, cut) = (folder.path().join("whole"), folder.path().join("cut"));
    let said = String::from_utf8(ran(prove(&whole, "3", &["--threads", "2"])).stdout).unwrap();
    assert!(said.contains("false alarms at 5 %") && said.contains("answers sealed as"), "{said}");

    let mut child = prove(&cut, "3", &["--threads", "1"]).spawn().unwrap();
    let begin = Instant::now();
    // Killed as soon as one world is done.
    while !cut.join("indentation/0000/outcome.json").exists() && begin.elapsed() < Duration::from_secs(120) {
        std::thread::sleep(Duration::from_millis(20));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!cut.join("score.json").exists() && !cut.join("keys.jsonl").exists());
    // A file that the kill left half written is no outcome.
    std::fs::create_dir_all(cut.join("indentation/0002")).unwrap();
    std::fs::write(cut.join("indentation/0002/outcome.json"), "{\"verdict\": \"adeq").unwrap();
    ran(prove(&cut, "3", &["--threads", "1"]));
    for file in ["score.json", "keys.jsonl", "plan.json", "indentation/0001/answer.json"] {
        let read = |proof: &Path| std::fs::read_to_string(proof.join(file)).unwrap();
        assert_eq!(read(&whole), read(&cut), "{file}");
    }

    // Other arguments are another proof.
    let other = prove(&whole, "3", &["--seed", "2"]).output().unwrap();
    assert_eq!(other.status.code(), Some(2));
    assert!(String::from_utf8(other.stderr).unwrap().contains("another proof"));
}

/// Worlds of another kind do not stand in for those that were asked for.
#[test]
fn a_kind_that_a_domain_has_not_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let asked = ["prove", "--domain", "bounce", "--kind", "imitated", "--worlds", "1", "--out"];
    let tool = env!("CARGO_BIN_EXE_missing-physics");
    let output = Command::new(tool).args(asked).arg(folder.path().join("proof")).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8(output.stderr).unwrap();
    let expected =
        "no worlds of the kind imitated in the domain bounce, expected one of the domains: trajectory, slosh";
    assert!(said.contains(expected), "{said}");
    assert!(!folder.path().join("proof").exists());
}

#[test]
fn no_worlds_and_no_runs_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let tool = env!("CARGO_BIN_EXE_missing-physics");
    for (option, expected) in
        [("--worlds", "0 worlds prove nothing"), ("--runs", "0 runs of each world prove nothing")]
    {
        let proof = folder.path().join("proof");
        let output = Command::new(tool)
            .args(["prove", "--domain", "slosh", option, "0", "--out"])
            .arg(&proof)
            .output()
            .unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && said.contains(expected), "{said}");
        assert!(!proof.exists());
    }
}

#[test]
fn a_domain_without_worlds_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let tool = env!("CARGO_BIN_EXE_missing-physics");
    let output =
        Command::new(tool).args(["prove", "--domain", "tides", "--out"]).arg(folder.path()).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        said.contains("no worlds of the domain \"tides\", expected one of: trajectory, bounce"),
        "{said}"
    );
}

/// Mechanisms that are named in one of the hundred worlds of a seed.
fn named(domain: &str, seed: u64, world: &str) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let (domain, path) = (Some(domain.to_owned()), folder.path().to_owned());
    prove_world(&ProveArguments { domain, seed, folder: path, ..ProveArguments::default() }, world).unwrap();
    let answer = std::fs::read_to_string(folder.path().join(world).join("answer.json")).unwrap();
    let answer: serde_json::Value = serde_json::from_str(&answer).unwrap();
    answer["chosen"].as_array().unwrap().iter().map(|id| id.as_str().unwrap().to_owned()).collect()
}

/// A lag shorter than the rows are apart frees the first row of each run and moves nothing else: that the data say nothing of how long it
/// is was evidence for it.
#[test]
fn a_lag_within_a_row_is_not_named_beside_friction() {
    assert_eq!(named("slosh", 1401, "slosh/0064"), ["contact-line-friction"]);
}
