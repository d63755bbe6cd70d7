//! What stands on the pages, without a browser.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use missing_physics::engine::Options;
use missing_physics::observer::Silent;
use missing_physics_cli::commands::{DiagnoseArguments, diagnose_many};
use rand::SeedableRng as _;
use rand_distr::{Distribution as _, Normal};

/// Three drops of a ball that swings on its way, which no mechanism of the list does.
fn swinging(folder: &Path) {
    let header = "format = 1\ndomain = \"trajectory\"\ndata = \"data.csv\"\n[rig]\ngravity_m_s2 = 9.80665\n";
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let noise = Normal::new(0.0, 0.004).unwrap();
    let mut data = String::from("run,t_s,z_m\n");
    for run in 1..=3 {
        for row in 0..40 {
            let t = f64::from(row) / 30.0;
            let swing = 0.05 * (7.0 * t + 0.3 * f64::from(run)).sin();
            let z = 1.5 - 0.5 * 9.80665 * t * t + swing + noise.sample(&mut rng);
            writeln!(data, "{run},{t:.5},{z:.5}").unwrap();
        }
    }
    std::fs::create_dir_all(folder).unwrap();
    std::fs::write(folder.join("recording.toml"), header).unwrap();
    std::fs::write(folder.join("data.csv"), data).unwrap();
}

fn diagnosed(folders: &[PathBuf], out: &Path) -> Option<String> {
    let common = DiagnoseArguments {
        html: Some(out.into()),
        json: Some(out.into()),
        options: Options { replicates: 99, ..Options::default() },
        ..DiagnoseArguments::default()
    };
    let said = diagnose_many(folders, &common, &Silent).unwrap();
    said.write_files().unwrap();
    said.failure
}

#[test]
fn what_nothing_explains_has_no_shares_of_a_whole() {
    let folder = tempfile::tempdir().unwrap();
    let (ball, out) = (folder.path().join("ball"), folder.path().join("out"));
    swinging(&ball);
    assert_eq!(diagnosed(&[ball], &out), None);
    let page = std::fs::read_to_string(out.join("ball.html")).unwrap();
    assert!(page.contains("class=\"verdict unexplained\""));
    assert!(page.contains("What was tried") && !page.contains("class=\"bar"));
    // The picture comes first, then what, where and how much better; and all runs are there, in words as well.
    let order = ["<h1>", "id=\"explore\"", "What was tried", "Where it misses", "How much better", "<footer"];
    let places: Vec<usize> = order.iter().map(|part| page.find(part).unwrap()).collect();
    assert!(places.is_sorted(), "{places:?}");
    assert!(page.contains("All 3 runs") && page.contains("height (m)") && page.contains("time (s)"));
}

#[test]
fn several_recordings_have_a_page_over_them() {
    let folder = tempfile::tempdir().unwrap();
    let (ball, out) = (folder.path().join("a ball"), folder.path().join("out"));
    swinging(&ball);
    let failure = diagnosed(&[ball, folder.path().join("none")], &out);
    assert_eq!(failure.as_deref(), Some("1 of 2 recordings have no diagnosis"));
    let mut files: Vec<_> = std::fs::read_dir(&out).unwrap().map(|e| e.unwrap().file_name()).collect();
    files.sort();
    assert_eq!(files, ["a ball.html", "a ball.json", "index.html"]);
    let index = std::fs::read_to_string(out.join("index.html")).unwrap();
    assert!(index.contains("href=\"a%20ball.html\"") && index.contains("1 unexplained, 1 without a report"));
    assert!(index.contains("recording.toml: no such file"));
}

/// A ball seen by a camera that sways: an error of a run's length is no noise of a reading's, and the first line says what is taken for noise.
#[test]
fn an_error_that_wanders_is_said_in_the_first_line() {
    let folder = tempfile::tempdir().unwrap();
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(2);
    let noise = Normal::new(0.0, 1.0).unwrap();
    let mut data = String::from("run,t_s,z_m\n");
    for run in 1..=6 {
        let mut sways = 0.02 * noise.sample(&mut rng);
        for row in 0..80 {
            let t = f64::from(row) / 60.0;
            sways = 0.95 * sways + (1.0_f64 - 0.95 * 0.95).sqrt() * 0.02 * noise.sample(&mut rng);
            let z = 10.0 - 0.5 * 9.80665 * t * t + sways + 0.001 * noise.sample(&mut rng);
            writeln!(data, "{run},{t:.5},{z:.5}").unwrap();
        }
    }
    std::fs::write(folder.path().join("data.csv"), data).unwrap();
    let header = "format = 1\ndomain = \"trajectory\"\ndata = \"data.csv\"\n[rig]\ngravity_m_s2 = 9.80665\n";
    std::fs::write(folder.path().join("recording.toml"), header).unwrap();
    let tool = env!("CARGO_BIN_EXE_missing-physics");
    let output = std::process::Command::new(tool).arg("diagnose").arg(folder.path()).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let first = text.lines().next().unwrap();
    let beginning = "The simulation explains this recording, if an error of z_m of 0.0";
    assert!(first.starts_with(beginning) && first.contains(" is noise (p = "), "{first}");
}
