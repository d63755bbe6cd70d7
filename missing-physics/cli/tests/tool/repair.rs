//! A repaired model predicts the end of flights of which it has seen the beginning.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use std::path::{Path, PathBuf};
use std::process::Command;

use missing_physics_domains::repair::{Repair, RepairError};

fn recordings() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../recordings")
}

/// A copy of a bundled recording with some of its runs; the readings of the later part of each are left out.
fn part(name: &str, runs: &[&str], seen: f64, folder: &Path) -> Vec<Vec<String>> {
    let from = recordings().join(name);
    std::fs::create_dir_all(folder).unwrap();
    std::fs::copy(from.join("recording.toml"), folder.join("recording.toml")).unwrap();
    let csv = std::fs::read_to_string(from.join("data.csv")).unwrap();
    let (header, lines) = csv.split_once('\n').unwrap();
    let rows: Vec<Vec<String>> = lines
        .lines()
        .map(|l| l.split(',').map(str::to_owned).collect())
        .filter(|r: &Vec<String>| runs.contains(&r[0].as_str()))
        .collect();
    let mut text = format!("{header}\n");
    for run in runs {
        let own: Vec<&Vec<String>> = rows.iter().filter(|r| r[0] == *run).collect();
        for (i, row) in own.iter().enumerate() {
            let hidden = i as f64 >= seen * own.len() as f64;
            let line = if hidden { format!("{},{},,,", row[0], row[1]) } else { row.join(",") };
            text += &(line + "\n");
        }
    }
    std::fs::write(folder.join("data.csv"), text).unwrap();
    rows
}

fn model_of(folder: &Path, file: &Path) {
    let tool = env!("CARGO_BIN_EXE_missing-physics");
    let output =
        Command::new(tool).arg("diagnose").arg(folder).arg("--write-model").arg(file).output().unwrap();
    assert!(output.status.success(), "{output:?}");
}

/// Error (root mean square, m) and coverage of the 95 % intervals on the readings that were left out.
fn judged(model: &Path, folder: &Path, truth: &[Vec<String>]) -> (f64, f64) {
    let tool = env!("CARGO_BIN_EXE_missing-physics");
    let output = Command::new(tool).arg("predict").arg(model).arg(folder).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let table = String::from_utf8(output.stdout).unwrap();
    let mut lines = table.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let rows: Vec<Vec<&str>> = lines.map(|l| l.split(',').collect()).collect();
    assert_eq!(rows.len(), truth.len());
    let blank = std::fs::read_to_string(folder.join("data.csv")).unwrap();
    let (mut squares, mut inside, mut n) = (0.0, 0, 0);
    for ((row, truth), given) in rows.iter().zip(truth).zip(blank.lines().skip(1)) {
        if !given.ends_with(",,,") {
            continue;
        }
        for (c, channel) in ["x_m", "y_m", "z_m"].iter().enumerate() {
            let at = names.iter().position(|n| n == channel).unwrap();
            let number = |i: usize| row[i].parse::<f64>().unwrap();
            let measured: f64 = truth[2 + c].parse().unwrap();
            squares += (measured - number(at)).powi(2);
            inside += usize::from((number(at + 2)..=number(at + 3)).contains(&measured));
            n += 1;
        }
    }
    assert!(n > 100);
    ((squares / n as f64).sqrt(), inside as f64 / n as f64)
}

#[test]
fn the_end_of_a_flight_is_predicted_from_its_beginning() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    part("thrown-ball", &["1", "2", "3"], 1.0, &at("learned"));
    let truth = part("thrown-ball", &["4", "5"], 0.4, &at("next"));
    model_of(&at("learned"), &at("repaired.json"));
    model_of(&recordings().join("steel-ball"), &at("plain.json"));
    let repair = Repair::read(&at("repaired.json")).unwrap();
    assert!(repair.model.mechanisms.contains(&"quadratic-drag".to_owned()), "{:?}", repair.model.mechanisms);
    assert!(Repair::read(&at("plain.json")).unwrap().model.mechanisms.is_empty());

    let (error, coverage) = judged(&at("repaired.json"), &at("next"), &truth);
    let (plain, overconfident) = judged(&at("plain.json"), &at("next"), &truth);
    // Noise is 1 mm; what the beginning leaves open of a flight comes on top.
    assert!(error < 0.01 && coverage > 0.85, "{error} m, {coverage}");
    assert!(plain > 5.0 * error && overconfident < 0.5, "{plain} m, {overconfident}");
}

/// A model of a recording that is explained in part predicts with a note; one of an adequate recording without.
#[test]
fn a_model_says_what_its_diagnosis_left_open() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("model.json");
    let unexplained = Some("leaves a part of its recording unexplained");
    for (name, open) in [("measured/trajectory/desilva-tennis-ball", unexplained), ("steel-ball", None)] {
        let recording = recordings().join(name);
        model_of(&recording, &file);
        let tool = env!("CARGO_BIN_EXE_missing-physics");
        let output = Command::new(tool).arg("predict").arg(&file).arg(&recording).output().unwrap();
        let noted = String::from_utf8(output.stderr).unwrap();
        assert!(
            output.status.success() && open.map_or(noted.is_empty(), |open| noted.contains(open)),
            "{noted}"
        );
    }
}

#[test]
fn what_does_not_fit_is_refused_with_a_reason() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    model_of(&recordings().join("steel-ball"), &at("model.json"));
    let repair = Repair::read(&at("model.json")).unwrap();
    let said = |repair: &Repair, name: &Path| repair.predict(name).unwrap_err().to_string();

    let swing = recordings().join("swing");
    assert!(said(&repair, &swing).ends_with("of the domain custom, expected trajectory as in the model"));
    let dropped = said(&repair, &recordings().join("dropped-ball"));
    assert!(
        dropped.ends_with("the model knows the channels x_m, y_m, z_m, this simulation has z_m"),
        "{dropped}"
    );
    part("steel-ball", &["1", "2"], 0.0, &at("unseen"));
    let unseen = said(&repair, &at("unseen"));
    assert!(
        unseen.contains("run 1 has 0 measured values, expected at least 6 to tell how it began"),
        "{unseen}"
    );
    let mut damaged = repair.clone();
    damaged.model.noise[0].sigma = f64::NAN;
    assert!(said(&damaged, &recordings().join("steel-ball")).contains("the model is damaged: noise"));
    std::fs::write(at("cut.json"), &repair.to_json()[..100]).unwrap();
    assert!(matches!(Repair::read(&at("cut.json")), Err(RepairError::NotAModel { .. })));
}
