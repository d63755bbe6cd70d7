//! What the page asks for, without a browser: the same answers as the command's, and words that help.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::path::Path;

use missing_physics::engine::Options;
use missing_physics::observer::Silent;
use missing_physics_cli::commands::{self, DiagnoseArguments};
use missing_physics_web::{Asked, Files, Wish, check, diagnose, domains, propose, samples};

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

fn files(of: &[(&str, &str)]) -> Files {
    let mut files = Files::default();
    of.iter().for_each(|(name, text)| files.add(name, *text));
    files
}

fn asked(name: &str) -> Asked {
    Asked { name: name.into(), seed: 1, alpha: 0.05 }
}

/// Of the recordings that come with the page text, JSON and report are the command's, but for the path that the command was given. (The
/// machine among them takes half a minute: the browser's test has it.)
#[test]
fn answers_are_the_commands() {
    let written = tempfile::tempdir().unwrap();
    for sample in samples().iter().filter(|s| s.files.len() > 1 && s.domain != "motion") {
        let folder = root().join(sample.name);
        let [json, html] = ["a.json", "a.html"].map(|name| written.path().join(name));
        let arguments = DiagnoseArguments {
            folder: folder.clone(),
            json: Some(json.clone()),
            html: Some(html.clone()),
            options: Options::with_alpha(0.05),
            ..DiagnoseArguments::default()
        };
        let said = commands::diagnose(&arguments, &Silent).unwrap();
        said.write_files().unwrap();
        let answer = diagnose(&asked(sample.name), &files(sample.files), &Silent).unwrap();
        assert_eq!(answer.text, said.text, "{}", sample.name);
        let path = folder.display().to_string();
        let of = |path: &Path| std::fs::read_to_string(path).unwrap();
        assert_eq!(answer.json, of(&json).replace(&path, sample.name), "{}", sample.name);
        assert_eq!(answer.html, of(&html).replace(&path, sample.name), "{}", sample.name);
    }
}

#[test]
fn every_domain_has_a_sound_template() {
    let known = domains();
    assert_eq!(known.len(), 6);
    for domain in &known {
        let checked = check("template", &files(&domain.template)).unwrap();
        assert_eq!(checked.domain, domain.id);
        assert!(!checked.runs.is_empty() && !checked.channels.is_empty(), "{}", domain.id);
    }
    let sample = |s: &&missing_physics_web::Sample| known.iter().any(|d| d.id == s.domain);
    assert_eq!(samples().iter().filter(sample).count(), 5);
}

const TABLE: &str =
    "t [ms];Höhe (mm);Wert\n0;2000;5\n20;1998;5\n40;1992;5\n60;1982;5\n80;1969;5\n100;1951;5\n";

#[test]
fn columns_are_proposed_settled_and_made_a_recording() {
    let lab = files(&[("wurf.csv", TABLE)]);
    let mut wish = Wish { domain: "trajectory".into(), ..Wish::default() };
    let proposed = propose(&wish, &lab).unwrap();
    let table = &proposed.tables[0];
    assert_eq!((table.file.as_str(), table.rows, table.columns.len()), ("wurf.csv", 6, 3));
    let height = &table.columns[1];
    assert_eq!((height.title.as_str(), height.unit.as_deref()), ("Höhe (mm)", Some("mm")));
    assert_eq!(height.first, ["2000", "1998", "1992"]);
    let taken: Vec<&str> = proposed.mapped.iter().map(|m| m.target.as_str()).collect();
    assert_eq!(taken, ["t_s", "z_m"]);
    let made = proposed.made.unwrap();
    let (name, rows) = made.table.unwrap();
    assert!(made.notes.iter().all(|note| !note.contains("--")), "{:?}", made.notes);
    let checked = check("wurf", &files(&[("recording.toml", &made.header), (&name, &rows)])).unwrap();
    assert_eq!((checked.runs.len(), checked.runs[0].rows), (1, 6));
    // What was settled holds, and what is missing is said with the columns there are.
    wish.maps = vec!["z_m=Wert [cm]".into(), "run=".into()];
    let rows = propose(&wish, &lab).unwrap().made.unwrap().table.unwrap().1;
    assert_eq!(rows.lines().nth(1), Some("1,0,0.05"));
    wish.maps = vec!["z_m=".into()];
    let proposed = propose(&wish, &lab).unwrap();
    assert_eq!(proposed.made, None);
    let why = "no column found for z_m: choose it among \"t [ms]\", \"Höhe (mm)\", \"Wert\"";
    assert_eq!(proposed.why.as_deref(), Some(why));
}

/// A machine's equations name its columns before the table is read.
#[test]
fn a_header_names_the_columns_of_a_machine() {
    let machine = domains().into_iter().find(|d| d.id == "motion").unwrap();
    let lab = files(&[("swing.csv", "Zeit [ms];Winkel [°]\n0;10\n20;9\n40;7\n60;4\n80;1\n")]);
    let header = Some(machine.template[0].1.to_owned());
    let maps = vec!["encoder_rad=Winkel".to_owned()];
    let wish = Wish { domain: "motion".into(), header, maps, ..Wish::default() };
    let proposed = propose(&wish, &lab).unwrap();
    assert_eq!(proposed.wanted, ["run", "t_s", "encoder_rad"]);
    let made = proposed.made.unwrap();
    let (name, rows) = made.table.unwrap();
    let checked = check("swing", &files(&[("recording.toml", &made.header), (&name, &rows)])).unwrap();
    assert_eq!(checked.channels.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(), ["t_s", "encoder_rad"]);
}

#[test]
fn errors_say_what_to_do_on_the_page() {
    let said = |name: &str, wish: Wish| propose(&wish, &files(&[(name, TABLE)])).unwrap_err().to_string();
    let plain = || Wish { domain: "trajectory".into(), ..Wish::default() };
    assert!(said("a.xlsx", plain()).contains("save the sheet as CSV"));
    assert!(said("a.docx", plain()).contains("unknown kind of file"));
    let maps = vec!["z_m=Tiefe".to_owned()];
    let text = said("a.csv", Wish { maps, ..plain() });
    assert!(text.starts_with("map \"z_m=Tiefe\": no such column") && !text.contains("--"), "{text}");
    let gap_s = Some(-1.0);
    let why = propose(&Wish { gap_s, ..plain() }, &files(&[("a.csv", TABLE)])).unwrap().why.unwrap();
    assert_eq!(why, "gap -1: expected a number above 0");
    let unknown = files(&[("recording.toml", "format = 1\ndomain = \"heat\"\ndata = \"data.csv\"\n")]);
    let text = check("a", &unknown).unwrap_err().to_string();
    assert!(text.ends_with("; other domains are diagnosed by the command"), "{text}");
    let nothing = check("a", &Files::default()).unwrap_err().to_string();
    assert_eq!(nothing, "a/recording.toml: no such file");
}
