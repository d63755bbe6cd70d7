//! What `import` writes passes `check`, and mistakes of unit are seen.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use std::path::{Path, PathBuf};
use std::process::Command;

fn run(arguments: &[&str]) -> (bool, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_missing-physics")).args(arguments).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.success(), text(output.stdout), text(output.stderr))
}

fn file(name: &str) -> String {
    let folder = if name == "throws.csv" { "../../recordings" } else { "../import/tests/files" };
    let path: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder).join(name);
    path.to_str().unwrap().to_owned()
}

#[test]
fn what_is_imported_is_a_sound_recording() {
    let folder = tempfile::tempdir().unwrap();
    for (name, domain, more) in [
        ("throws.csv", "trajectory", vec![]),
        ("labview.txt", "trajectory", vec![]),
        ("excel.tsv", "trajectory", vec![]),
        ("flight.mat", "trajectory", vec![]),
        ("flight.npz", "trajectory", vec![]),
        ("pandas.parquet", "trajectory", vec![]),
        ("bag.mcap", "trajectory", vec![]),
        ("lerobot", "trajectory", vec!["--map", "z_m=observation.state[height.pos]"]),
        ("drop.wav", "bounce", vec![]),
    ] {
        let out = folder.path().join(name).to_str().unwrap().to_owned();
        let path = file(name);
        let arguments: Vec<&str> =
            ["import", &path, "--domain", domain, "--out", &out].into_iter().chain(more).collect();
        let (done, said, why) = run(&arguments);
        assert!(done, "{name}: {why}");
        assert!(
            said.contains("a sound recording of the domain")
                && said.contains("next: missing-physics diagnose"),
            "{said}"
        );
        assert!(!said.contains("hint: "), "{name}: {said}");
        // A picture of what was measured, of some lines.
        assert!(domain == "bounce" || said.contains("z_m, row after row"), "{said}");
        assert!(said.chars().filter(|c| ('\u{2801}'..='\u{28ff}').contains(c)).count() > 10, "{said}");
        let (checked, _, why) = run(&["check", &out]);
        assert!(checked, "{name}: {why}");
    }
}

/// The flight hides quadratic drag (`files/make.py`).
#[test]
fn what_is_imported_can_be_diagnosed() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("rec").to_str().unwrap().to_owned();
    let set = ["--set", "mass_kg=57.7 g", "--set", "diameter_m=65.5 mm"];
    let path = file("throws.csv");
    let arguments: Vec<&str> =
        ["import", &path, "--domain", "trajectory", "--out", &out].into_iter().chain(set).collect();
    assert!(run(&arguments).0);
    let (done, said, why) = run(&["check", &out]);
    assert!(done && said.contains("z_m: ") && said.contains(" m\n"), "{said}{why}");
    let header = std::fs::read_to_string(folder.path().join("rec/recording.toml")).unwrap();
    assert!(header.contains("\nmass_kg = 0.0577") && header.contains("\ndiameter_m = 0.0655"), "{header}");
    // Again into the same folder it does not go.
    let (done, _, why) = run(&arguments);
    assert!(!done && why.contains("expected a new or empty folder"), "{why}");
}

#[test]
fn mistakes_of_unit_and_sign_get_a_hint() {
    let folder = tempfile::tempdir().unwrap();
    for (k, (map, hint)) in [
        ("z_m=-Höhe (mm) + 2.1", "turn the sign of z_m"),
        ("t_s=Zeit [ms] * 1000", "is t_s in milliseconds?"),
        ("z_m=Höhe (mm) * 1000", "is z_m in millimetres?"),
    ]
    .into_iter()
    .enumerate()
    {
        let out = folder.path().join(k.to_string()).to_str().unwrap().to_owned();
        let (done, said, why) =
            run(&["import", &file("throws.csv"), "--domain", "trajectory", "--map", map, "--out", &out]);
        assert!(done && said.contains(hint), "{map}: {said}{why}");
        // One is diagnosed: far from all that a flight may be, fits take their time.
        if k > 0 {
            continue;
        }
        let (_, report, _) = run(&["diagnose", &out]);
        let report = report.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(report.contains(hint), "{map}: {report}");
    }
}

#[test]
fn what_is_not_known_is_marked_until_it_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().join("wave.csv");
    let wave: String = (0..100)
        .map(|i| f64::from(i) * 0.02)
        .map(|t| format!("{t};{}\n", 16.0 * (-0.5 * t).exp() * (21.6 * t).cos()))
        .collect();
    std::fs::write(&csv, format!("t [s];Mz [N mm]\n{wave}")).unwrap();
    let out = folder.path().join("rec").to_str().unwrap().to_owned();
    let (done, said, why) = run(&["import", csv.to_str().unwrap(), "--domain", "slosh", "--out", &out]);
    assert!(done, "{why}");
    let hint = "template's values for container, liquid_mass_kg, volume_m3";
    assert!(said.matches(hint).count() == 2, "said by import and by check: {said}");
    let path = folder.path().join("rec/recording.toml");
    let header = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, header.replace("# placeholder", "# measured")).unwrap();
    assert!(!run(&["check", &out]).1.contains(hint));
}

#[test]
fn nothing_is_left_of_what_is_not_sound() {
    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().join("short.csv");
    std::fs::write(&csv, "t [s];z [m]\n0;2\n0,1;1,95\n").unwrap();
    let out = folder.path().join("rec").to_str().unwrap().to_owned();
    let (done, said, why) = run(&["import", csv.to_str().unwrap(), "--domain", "trajectory", "--out", &out]);
    assert!(!done && why.contains("expected at least 4") && why.lines().count() == 1, "{why}");
    assert!(said.contains("z_m = \"z [m]\""), "what was taken for what: {said}");
    assert!(!Path::new(&out).exists());
    // Without a folder nothing is written, without a domain the columns are listed.
    let (done, said, _) = run(&["import", &file("throws.csv"), "--domain", "trajectory"]);
    assert!(done && said.contains("nothing is written"), "{said}");
    let (done, said, _) = run(&["import", &file("bag.mcap")]);
    assert!(
        done && said.contains("--domain trajectory | ") && said.contains("/wrench wrench.force.z"),
        "{said}"
    );
}
