//! One flight in the files of other programs (`files/make.py` made them): whichever is imported, the recording is the same.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use std::path::{Path, PathBuf};

use missing_physics_import::file::read_bytes;
use missing_physics_import::{ImportError, Imported, Request, import, import_tables};

fn file(name: &str) -> PathBuf {
    let folder = if name == "throws.csv" { "../../recordings" } else { "tests/files" };
    Path::new(env!("CARGO_MANIFEST_DIR")).join(folder).join(name)
}

fn request(name: &str, domain: &str) -> Request {
    Request { files: vec![file(name)], domain: domain.into(), ..Request::default() }
}

fn flight(name: &str) -> Imported {
    import(&request(name, "trajectory")).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// The rows of a table by run: label, and numbers of the columns asked for.
fn rows(imported: &Imported, columns: &[&str]) -> Vec<(String, Vec<f64>)> {
    let (_, text) = imported.table.as_ref().unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let names = lines.next().unwrap();
    let at =
        |name: &&str| names.iter().position(|n| n == name).unwrap_or_else(|| panic!("{name}: {names:?}"));
    let places: Vec<usize> = columns.iter().map(at).collect();
    lines
        .map(|line| (line[0].to_owned(), places.iter().map(|p| line[*p].parse().unwrap()).collect()))
        .collect()
}

/// Heights of a run of the semicolon file, against which the others are held.
fn heights(run: &str) -> Vec<[f64; 2]> {
    let rows = rows(&flight("throws.csv"), &["t_s", "z_m"]);
    rows.into_iter().filter(|(label, _)| label == run).map(|(_, v)| [v[0], v[1]]).collect()
}

fn same(name: &str, got: &[Vec<f64>], wanted: &[[f64; 2]], time: f64, height: f64) {
    assert_eq!(got.len(), wanted.len(), "{name}");
    for (got, wanted) in got.iter().zip(wanted) {
        assert!(
            (got[0] - wanted[0]).abs() <= time && (got[1] - wanted[1]).abs() <= height,
            "{name}: {got:?}, {wanted:?}"
        );
    }
}

#[test]
fn semicolons_decimal_commas_and_units_of_headers_are_read() {
    let imported = flight("throws.csv");
    let rows = rows(&imported, &["t_s", "z_m"]);
    assert_eq!(rows.len(), 102);
    assert_eq!(rows.iter().filter(|(run, _)| run == "2").count(), 34);
    // `0,00;2004,1` in milliseconds and millimetres.
    let text = std::fs::read_to_string(file("throws.csv")).unwrap();
    let first = text.lines().nth(2).unwrap().split(';').nth(2).unwrap().replace(',', ".");
    // Written in twelve digits.
    assert!(rows[0].1[0] == 0.0 && (rows[0].1[1] - first.parse::<f64>().unwrap() / 1000.0).abs() < 1e-12);
    assert!((rows[33].1[0] - 0.55).abs() < 1e-12);
    for said in [
        "z_m = 0.001 × \"Höhe (mm)\"",
        "Temperatur (°C)",
        "not used",
        "run = \"Versuch\"",
        "3 runs, 102 rows",
    ] {
        assert!(imported.text.contains(said), "{said}: {}", imported.text);
    }
    assert!(imported.header.contains("#   z_m = 0.001 × \"Höhe (mm)\""), "{}", imported.header);
    assert!(imported.header.contains("# mass_kg"), "a template's mass is nobody's: {}", imported.header);
}

#[test]
fn every_format_holds_the_same_flight() {
    let all =
        |name: &str| rows(&flight(name), &["t_s", "z_m"]).into_iter().map(|(_, v)| v).collect::<Vec<_>>();
    for (name, run, time, height) in [
        ("savetxt.dat", "1", 1e-5, 1e-4),
        ("excel.tsv", "2", 6e-4, 1e-4),
        ("flight.npz", "2", 1e-5, 1e-4),
        ("struct.npy", "3", 1e-5, 1e-4),
        ("flight.mat", "1", 1e-5, 1e-4),
        ("pandas.parquet", "1", 1e-5, 1e-4),
        ("bag.mcap", "1", 1e-5, 1e-4),
    ] {
        same(name, &all(name), &heights(run), time, height);
    }
    // An array without names: its columns are settled.
    let maps = vec!["t_s=flight[0]".into(), "z_m=flight[1]".into()];
    let unnamed = import(&Request { maps, ..request("flight.npy", "trajectory") }).unwrap();
    let unnamed: Vec<_> = rows(&unnamed, &["t_s", "z_m"]).into_iter().map(|(_, v)| v).collect();
    same("flight.npy", &unnamed, &heights("3"), 1e-5, 1e-4);
}

#[test]
fn a_preamble_and_a_row_of_units_are_no_rows() {
    let imported = flight("labview.txt");
    let rows = rows(&imported, &["t_s", "z_m"]);
    // Three flights five seconds apart on one clock: cut where it pauses, each from zero.
    for (run, label) in ["1", "2", "3"].iter().enumerate() {
        let got: Vec<Vec<f64>> = rows.iter().filter(|(l, _)| l == label).map(|(_, v)| v.clone()).collect();
        same("labview.txt", &got, &heights(&(run + 1).to_string()), 2e-4, 2e-4);
    }
    for said in [
        "Windows-1252",
        "z_m = 0.01 × \"Höhe [cm]\"",
        "their first row is taken for zero",
        "cut where the time pauses",
    ] {
        assert!(imported.text.contains(said), "{said}: {}", imported.text);
    }
}

#[test]
fn a_data_set_of_lerobot_is_read_with_its_motors() {
    let request = Request {
        maps: vec!["z_m=observation.state[height.pos]".into()],
        ..request("lerobot", "trajectory")
    };
    let imported = import(&request).unwrap();
    let rows = rows(&imported, &["t_s", "z_m"]);
    for (episode, run) in [("0", "1"), ("1", "2"), ("2", "3")] {
        let got: Vec<Vec<f64>> = rows.iter().filter(|(l, _)| l == episode).map(|(_, v)| v.clone()).collect();
        same("lerobot", &got, &heights(run), 1e-5, 1e-4);
    }
    assert!(imported.text.contains("action[height.pos]"), "{}", imported.text);
    assert!(imported.text.contains("60 frames a second"), "{}", imported.text);
}

#[test]
fn joints_and_wrenches_of_a_bag_are_found_by_name() {
    // Of `custom`, any column: the elbow stands first in every second message, and the wrench comes three times as often.
    let maps = [
        "t_s=/joint_states time",
        "elbow_rad=/joint_states position[elbow]",
        "sim_elbow_rad=/joint_states position[shoulder]",
        "fz_n=/wrench wrench.force.z",
    ];
    let maps = maps.map(str::to_owned).to_vec();
    let imported = import(&Request { maps, ..request("bag.mcap", "custom") }).unwrap();
    let rows = rows(&imported, &["elbow_rad", "sim_elbow_rad", "fz_n"]);
    assert_eq!(rows.len(), 34);
    for (i, (_, v)) in rows.iter().enumerate() {
        let i = i as f64;
        let wanted = [-0.2 - 0.01 * i, 0.5 + 0.01 * i, i];
        assert!(v.iter().zip(wanted).all(|(got, wanted)| (got - wanted).abs() < 1e-9), "{v:?}, {wanted:?}");
    }
    for said in ["pictures, clouds and long arrays are not read", "read at the other's times", "rad/s", "N m"]
    {
        assert!(imported.text.contains(said), "{said}: {}", imported.text);
    }
}

#[test]
fn sound_is_taken_as_it_is_for_bounces() {
    let two = Request { files: vec![file("drop.wav"), file("drop.wav")], ..request("drop.wav", "bounce") };
    let imported = import(&two).unwrap();
    assert_eq!(imported.copies.iter().map(|(_, name)| name.as_str()).collect::<Vec<_>>(), ["1.wav", "2.wav"]);
    assert!(
        imported.table.is_none() && imported.header.contains("files = [\"1.wav\", \"2.wav\"]"),
        "{}",
        imported.header
    );
    assert!(!imported.header.contains("\ndata ="), "{}", imported.header);
    // As a signal it is a column like others.
    let maps = vec!["y=channel 1".into(), "sim_y=channel 1".into()];
    let signal = import(&Request { maps, ..request("drop.wav", "custom") }).unwrap();
    assert_eq!(rows(&signal, &["t_s", "y"]).len(), 5500);
}

#[test]
fn files_in_memory_are_imported_like_files_on_disk() {
    for name in
        ["throws.csv", "excel.tsv", "labview.txt", "savetxt.dat", "flight.npz", "flight.mat", "bag.mcap"]
    {
        let request = request(name, "trajectory");
        let path = &request.files[0];
        let tables = read_bytes(path, &std::fs::read(path).unwrap());
        let found = tables.and_then(|tables| import_tables(&request, tables));
        assert_eq!(found, import(&request), "{name}");
        if let Ok(Imported { mapped, .. }) = found {
            let height = mapped.iter().find(|m| m.target == "z_m").unwrap();
            assert!(height.title.is_some() && height.formula.contains('"'), "{name}: {height:?}");
        }
    }
    let sound = request("drop.wav", "bounce");
    let tables = read_bytes(&sound.files[0], &std::fs::read(&sound.files[0]).unwrap()).unwrap();
    assert_eq!(import_tables(&sound, tables), import(&sound));
    let parquet = read_bytes(Path::new("a.parquet"), b"PAR1");
    assert!(
        matches!(&parquet, Err(ImportError::Broken { why, .. }) if why.contains("from a file on disk")),
        "{parquet:?}"
    );
    let nothing = read_bytes(Path::new("a.csv"), b"t,z\n");
    assert!(matches!(nothing, Err(ImportError::Broken { .. })), "{nothing:?}");
}

/// Runs in columns of one sheet, in one of which a time was typed wrong: the row is left out and said, and what follows it stays in its run.
#[test]
fn a_time_that_was_typed_wrong_does_not_tear_a_run() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drops.csv");
    let mut text = String::from("run,t_s,z_m\n");
    for run in ["a", "b"] {
        for row in 0..12 {
            let t = f64::from(row) / 30.0;
            let written = if (run, row) == ("b", 8) { 1.089 } else { t };
            text.push_str(&format!("{run},{written:.4},{:.4}\n", 1.0 - 4.9 * t * t));
        }
    }
    std::fs::write(&path, text).unwrap();
    let asked = Request { files: vec![path], ..Request::default() };
    let imported = import(&Request { domain: "trajectory".into(), ..asked }).unwrap();
    let rows = rows(&imported, &["t_s", "z_m"]);
    let of = |label: &str| rows.iter().filter(|(l, _)| l == label).count();
    assert_eq!((of("a"), of("b"), rows.len()), (12, 11, 23), "{}", imported.text);
    assert!(imported.text.contains("1.089 between 0.2333 and 0.3"), "{}", imported.text);
}
