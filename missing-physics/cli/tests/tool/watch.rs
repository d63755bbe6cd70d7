//! `watch`: a recording that grows, by a folder and by a pipe.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Falls of a ball from a height of each run's own, from a run on with a drag; the header's line first.
fn falls(runs: std::ops::Range<usize>, drag_from: usize, rng: &mut ChaCha8Rng) -> String {
    let mut rows = String::new();
    for run in runs {
        let start: f64 = StandardNormal.sample(rng);
        for i in 0..30 {
            let t = f64::from(i) / 30.0;
            let noise: f64 = StandardNormal.sample(rng);
            let fall = if run < drag_from {
                0.5 * 9.80665 * t * t
            } else {
                // Quadratic drag from rest: ln cosh(sqrt(g k) t) / k.
                ((9.80665f64 * 0.08).sqrt() * t).cosh().ln() / 0.08
            };
            writeln!(rows, "{run},{t},{}", 20.0 + start - fall + 0.002 * noise).unwrap();
        }
    }
    rows
}

fn folder(path: &Path, rows: &str) {
    let toml = include_str!("../../../../recordings/dropped-ball/recording.toml");
    std::fs::write(path.join("recording.toml"), toml).unwrap();
    std::fs::write(path.join("data.csv"), format!("run,t_s,z_m\n{rows}")).unwrap();
}

fn watch(path: &Path, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_missing-physics"));
    command
        .arg("watch")
        .arg(path)
        .args(["--settle", "0.3", "--end-after", "0.6", "--reference", "4"])
        .args(more);
    command
}

#[test]
fn a_folder_that_is_full_is_watched_to_its_end() {
    let folder_at = tempfile::tempdir().unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    folder(folder_at.path(), &falls(0..10, 7, &mut rng));
    let said = watch(folder_at.path(), &[]).output().unwrap();
    let text = String::from_utf8(said.stdout).unwrap();
    assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
    assert!(text.starts_with("the reference, 4 runs: The simulation explains"), "{text}");
    let quiet = text.lines().filter(|l| ["run 4:", "run 5:", "run 6:"].iter().any(|r| l.starts_with(r)));
    assert!(quiet.clone().count() == 3 && quiet.into_iter().all(|l| !l.contains("changed")), "{text}");
    assert!(text.lines().any(|l| l.starts_with("run 9:") && l.contains("from run 7 on")), "{text}");
    assert!(text.contains("runs since then, 3: The simulation does not explain"), "{text}");
}

#[test]
fn rows_that_come_through_a_pipe_are_kept_and_watched() {
    let folder_at = tempfile::tempdir().unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    folder(folder_at.path(), &falls(0..4, 9, &mut rng));
    let rows = falls(4..7, 9, &mut rng);
    let mut child =
        watch(folder_at.path(), &["--pipe"]).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let mut stdin = child.stdin.take().unwrap();
    stdin.write_all(format!("run,t_s,z_m\n{rows}").as_bytes()).unwrap();
    drop(stdin);
    let said = child.wait_with_output().unwrap();
    let text = String::from_utf8(said.stdout).unwrap();
    assert_eq!(text.lines().filter(|l| l.starts_with("run ")).count(), 3, "{text}");
    assert!(!text.contains("changed"), "{text}");
    let kept = std::fs::read_to_string(folder_at.path().join("data.csv")).unwrap();
    assert!(kept.ends_with(&rows) && kept.matches("run,").count() == 1);
}

#[test]
fn too_few_runs_and_a_folder_that_is_none_are_said() {
    let folder_at = tempfile::tempdir().unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    folder(folder_at.path(), &falls(0..3, 9, &mut rng));
    let said = watch(folder_at.path(), &[]).output().unwrap();
    assert!(String::from_utf8_lossy(&said.stdout).contains("3 runs came, the reference wants 4"));
    let none = watch(&folder_at.path().join("none"), &[]).output().unwrap();
    assert_eq!(none.status.code(), Some(2));
    assert!(!none.stderr.is_empty());
}
