//! No file, however mutilated, panics or hangs: it is read, or refused in one line.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use missing_physics_import::{Request, import};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const FILES: [&str; 12] = [
    "../../../../recordings/throws.csv",
    "labview.txt",
    "savetxt.dat",
    "excel.tsv",
    "flight.npz",
    "flight.npy",
    "struct.npy",
    "flight.mat",
    "pandas.parquet",
    "lerobot/data/chunk-000/file-000.parquet",
    "bag.mcap",
    "drop.wav",
];

fn mutilate(bytes: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    for _ in 0..rng.random_range(1..5) {
        let n = bytes.len();
        if n == 0 {
            return;
        }
        let at = rng.random_range(0..n);
        let end = (at + rng.random_range(1..60)).min(n);
        match rng.random_range(0..7) {
            0 => bytes[at] = rng.random(),
            1 => bytes[at] ^= 1 << rng.random_range(0..8),
            2 => drop(bytes.drain(at..end)),
            3 => {
                let again = bytes[at..end].to_vec();
                drop(bytes.splice(at..at, again));
            }
            // Sizes and counts of all ones, and of none.
            4 => bytes[at..end.min(at + 8)].fill(0xff),
            5 => bytes[at..end.min(at + 8)].fill(0),
            _ => bytes.truncate(at),
        }
    }
}

fn caught(name: &str, seed: u64) -> Option<String> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut bytes =
        std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/files").join(name)).unwrap();
    mutilate(&mut bytes, &mut rng);
    let folder = tempfile::tempdir().unwrap();
    let path: PathBuf = folder.path().join(Path::new(name).file_name().unwrap());
    std::fs::write(&path, bytes).unwrap();
    let begin = Instant::now();
    let domain = if name.ends_with("wav") { "bounce" } else { "trajectory" };
    let request = Request { files: vec![path], domain: domain.into(), ..Request::default() };
    let said = match catch_unwind(AssertUnwindSafe(|| import(&request))) {
        Err(_) => return Some("panicked".into()),
        Ok(Ok(imported)) => imported.text,
        Ok(Err(refusal)) => {
            let line = refusal.to_string();
            let wordless = line.trim().is_empty() || line.contains('\n') || line.len() > 2000;
            return wordless.then(|| format!("said {line:?}"));
        }
    };
    if begin.elapsed() > Duration::from_secs(20) {
        return Some(format!("took {:.0} s", begin.elapsed().as_secs_f64()));
    }
    let moves = said.chars().any(|c| c.is_control() && c != '\n');
    moves.then(|| "said control characters".into())
}

#[test]
fn mutants_are_read_or_refused() {
    for name in FILES {
        for seed in 0..120 {
            assert_eq!(caught(name, seed), None, "{name} {seed}");
        }
    }
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_mutants_are_read_or_refused() {
    for name in FILES {
        for seed in 1000..6000 {
            assert_eq!(caught(name, seed), None, "{name} {seed}");
        }
    }
}
