//! What is asked for is done, and what cannot be is said in one line.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use std::path::Path;

use missing_physics_import::file::read_bytes;
use missing_physics_import::{Imported, Request, import, import_tables, propose};

fn with(text: &str, domain: &str, change: impl FnOnce(&mut Request)) -> Result<Imported, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    std::fs::write(&path, text).unwrap();
    let mut request = Request { files: vec![path], domain: domain.into(), ..Request::default() };
    change(&mut request);
    import(&request).map_err(|e| e.to_string().replace(&folder.path().display().to_string(), ""))
}

fn table(imported: Result<Imported, String>) -> Vec<Vec<String>> {
    let (_, text) = imported.unwrap().table.unwrap();
    text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

fn maps(of: &[&str]) -> impl FnOnce(&mut Request) {
    let of: Vec<String> = of.iter().map(|m| (*m).to_owned()).collect();
    move |request| request.maps = of
}

const DEPTHS: &str = "time,depth (mm)\n0,100\n0.1,110\n0.2,150\n0.3,230\n0.4,330\n0.5,470\n";

#[test]
fn signs_factors_and_offsets_are_applied_in_si() {
    let rows = table(with(DEPTHS, "trajectory", maps(&["z_m=-depth (mm) + 1.2"])));
    assert_eq!(rows[0], ["run", "t_s", "z_m"]);
    assert_eq!(rows[1], ["1", "0", "1.1"]);
    assert_eq!(rows[6], ["1", "0.5", "0.73"]);
    let rows = table(with(DEPTHS, "trajectory", maps(&["z_m=depth * -2 - 0.5"])));
    assert_eq!(rows[1], ["1", "0", "-0.7"]);
    // A unit that the file lacks.
    let rows = table(with(DEPTHS, "trajectory", maps(&["z_m=depth", "t_s=time [ms]"])));
    assert_eq!(rows[2], ["1", "0.0001", "0.11"]);
    let said = with(DEPTHS, "trajectory", maps(&["z_m=-depth (mm) + 1.2"])).unwrap();
    assert!(said.text.contains("z_m = -0.001 × \"depth (mm)\" + 1.2"), "{}", said.text);
    assert!(said.text.contains("\"time\" has no unit: taken as s"), "{}", said.text);
}

#[test]
fn runs_are_cut_as_asked() {
    let labels = |change: fn(&mut Request)| -> Vec<String> {
        let text = "t;z;who\n0;2;a\n1;2;a\n2;2;b\n3;2;b\n10;2;b\n11;2;b\n12;2;a\n13;2;a\n";
        let rows = table(with(text, "custom", |r| {
            r.maps = vec!["z_m=z".into(), "sim_z_m=z".into(), "t_s=t".into()];
            change(r);
        }));
        rows[1..].iter().map(|row| row[0].clone()).collect()
    };
    assert_eq!(labels(|r| r.run = Some("who".into())), ["a", "a", "a", "a", "b", "b", "b", "b"]);
    assert_eq!(labels(|r| r.gap_s = Some(5.0)), ["1", "1", "1", "1", "2", "2", "2", "2"]);
    assert_eq!(labels(|r| r.every = Some(3)), ["1", "1", "1", "2", "2", "2"]);
    assert_eq!(labels(|_| {}).len(), 8);
}

#[test]
fn each_file_is_a_run_where_nothing_else_tells() {
    let folder = tempfile::tempdir().unwrap();
    let paths = ["slow", "fast"].map(|name| folder.path().join(format!("{name}.csv")));
    for path in &paths {
        std::fs::write(path, "t [s],z [m]\n0,2\n0.1,1.95\n0.2,1.8\n0.3,1.6\n").unwrap();
    }
    let request = Request { files: paths.to_vec(), domain: "trajectory".into(), ..Request::default() };
    let imported = import(&request).unwrap();
    assert!(imported.text.contains("2 runs, 8 rows: slow (4 rows), fast (4 rows)"), "{}", imported.text);
    std::fs::write(&paths[1], "t [s],height\n0,2\n").unwrap();
    let refused = import(&request).unwrap_err().to_string();
    assert!(refused.contains("fast.csv") && refused.contains("which the other files have"), "{refused}");
}

#[test]
fn values_of_the_header_are_set_with_their_units() {
    let wave = (0..40)
        .map(|i| format!("{},{}\n", 0.02 * f64::from(i), (0.4 * f64::from(i)).cos()))
        .collect::<String>();
    let wave = format!("t [s],Mz [N·mm]\n{wave}");
    let set = |settings: &'static [&'static str]| {
        with(&wave, "slosh", |r| r.settings = settings.iter().map(|s| (*s).to_owned()).collect())
    };
    let header =
        set(&["liquid_mass_kg=282 g", "volume_m3=308 ml", "noise.tau_z_nm=0.25 N mm"]).unwrap().header;
    for line in ["liquid_mass_kg = 0.282", "volume_m3 = 0.000308", "[noise]", "tau_z_nm = 0.00025"] {
        assert!(header.lines().any(|l| l.starts_with(line)), "{line}: {header}");
    }
    assert!(header.contains("0.162 }   # placeholder"), "{header}");
    let said = set(&["liquid_mass_kg=0.282"]).unwrap().text;
    assert!(said.contains("template's values for container, volume_m3"), "{said}");
    for (wrong, why) in [
        ("liquid_mass_kg=282 s", "measures something else"),
        ("liquid_mass_kg=much", "expected a value"),
        ("liquid mass=1", "expected a key"),
        ("x", "expected KEY=VALUE"),
    ] {
        let refused = with(&wave, "slosh", |r| r.settings = vec![wrong.into()]).unwrap_err();
        assert!(refused.contains(why), "{wrong}: {refused}");
    }
}

#[test]
fn what_cannot_be_is_said_in_one_line() {
    let cases: Vec<(&str, &str, Vec<&str>, &str)> = vec![
        (DEPTHS, "flight", vec![], "unknown domain"),
        (
            DEPTHS,
            "trajectory",
            vec![],
            "no column found for z_m: say which by --map z_m=\"NAME\"; there are: \"time\", \"depth (mm)\"",
        ),
        (DEPTHS, "trajectory", vec!["z_m=height"], "no such column; there are"),
        (DEPTHS, "trajectory", vec!["height=depth"], "the domain has no column \"height\""),
        (DEPTHS, "trajectory", vec!["z_m"], "expected COLUMN_OF_THE_DOMAIN"),
        (DEPTHS, "trajectory", vec!["t_s=depth (mm)"], "its unit \"mm\" measures something else than t_s"),
        (DEPTHS, "trajectory", vec!["z_m=depth", "z_m=time"], "mapped twice"),
        (DEPTHS, "custom", vec!["y_m=depth"], "sim_angle_rad"),
        (DEPTHS, "motion-of-the-stars", vec![], "unknown domain"),
        ("", "trajectory", vec![], "no line with a value"),
        ("# nothing\n", "trajectory", vec![], "no line with a value"),
        ("t [s],z [m]\n", "trajectory", vec![], "no row of 2 cells"),
        (
            "t [s],z [m]\n0,\n1,\n",
            "trajectory",
            vec![],
            "no row holds a number in every column that is used (t_s, z_m)",
        ),
        ("t [s],z [m]\n0,1\n0,1\n0,1\n0,1\n", "trajectory", vec![], "--rate HZ"),
        ("t [s],z [m]\nNaN,1\n,2\nNaN,3\n1,\n", "trajectory", vec![], "no row holds a number"),
    ];
    for (text, domain, of, why) in cases {
        let refused = with(text, domain, maps(&of)).unwrap_err();
        assert!(refused.contains(why) && !refused.contains('\n'), "{text:?} {of:?}: {refused}");
    }
    let missing =
        Request { files: vec!["none.csv".into()], domain: "trajectory".into(), ..Request::default() };
    assert_eq!(import(&missing).unwrap_err().to_string(), "none.csv: no such file");
    for (name, why) in [
        ("a.xlsx", "save the sheet as CSV"),
        ("a.bag", "mcap convert"),
        ("a.db3", "ros2 bag convert"),
        ("a.exe", "unknown kind"),
    ] {
        let request = Request { files: vec![name.into()], ..missing.clone() };
        let refused = import(&request).unwrap_err().to_string();
        assert!(refused.contains(why), "{refused}");
    }
}

#[test]
fn another_recordings_header_is_taken_over() {
    let folder = tempfile::tempdir().unwrap();
    let header = "format = 1\ndomain = \"custom\"\ndata = \"rows.csv\"\n[[input]]\nname = \"t_s\"\nunit = \"s\"\n[[channel]]\n\
        name = \"angle_rad\"\nunit = \"rad\"\n[simulator]\ncommand = [\"true\"]\n";
    std::fs::write(folder.path().join("recording.toml"), header).unwrap();
    let text = "Zeit in ms\tWinkel / °\n0\t180\n20\t90\n40\t45\n";
    let like = |r: &mut Request| {
        r.like = Some(folder.path().into());
        r.maps = vec!["angle_rad=Winkel".into()];
    };
    let imported = with(text, "custom", like).unwrap();
    assert_eq!(imported.header, header);
    let (name, table) = imported.table.unwrap();
    assert_eq!((name.as_str(), table.lines().nth(1)), ("rows.csv", Some("1,0,3.14159265359")));
    // The same from memory, where the header is a text.
    let (maps, header) = (vec!["angle_rad=Winkel".into()], Some(header.to_owned()));
    let request = Request { domain: "custom".into(), maps, header, ..Request::default() };
    let tables = read_bytes(Path::new("a.csv"), text.as_bytes()).unwrap();
    let again = import_tables(&request, tables).unwrap();
    assert_eq!((again.header, again.table.unwrap().1), (imported.header, table));
    let refused = with(text, "slosh", |r| r.like = Some(folder.path().into())).unwrap_err();
    assert!(refused.contains("a recording of the domain \"custom\", not of slosh"), "{refused}");
}

/// What is missing is no reason to propose nothing, and what was settled stays.
#[test]
fn what_would_be_taken_is_said_before_all_is_there() {
    let tables =
        read_bytes(Path::new("a.csv"), b"Zeit [ms];H\xc3\xb6he (mm);Wert\n0;2000;1\n10;1999;2\n").unwrap();
    let mut request = Request { domain: "trajectory".into(), ..Request::default() };
    let of = |request: &Request| -> Vec<String> {
        let mapped = propose(request, &tables).unwrap().mapped;
        mapped.into_iter().map(|m| format!("{} = {}", m.target, m.formula)).collect()
    };
    assert_eq!(of(&request), ["t_s = 0.001 × \"Zeit [ms]\"", "z_m = 0.001 × \"Höhe (mm)\""]);
    request.maps = vec!["t_s=".into(), "z_m=-Wert [cm]".into()];
    assert_eq!(of(&request), ["z_m = -0.01 × \"Wert\""]);
    let wanted = propose(&request, &tables).unwrap().wanted;
    assert_eq!(wanted[..5], ["run", "t_s", "x_m", "y_m", "z_m"]);
    request.maps = vec!["height=Wert".into()];
    assert!(propose(&request, &tables).unwrap_err().to_string().contains("no column \"height\""));
}
