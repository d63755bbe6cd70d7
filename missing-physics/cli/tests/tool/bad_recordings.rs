//! Every way in which a recording can be wrong ends with one line that says file, row, column, what and what is expected.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use std::process::Command;

use missing_physics_domains as domains;
use proptest::prelude::*;

const HEADER: &str = "format = 1\ndomain = \"trajectory\"\ndata = \"data.csv\"\n";
const COLUMNS: &str = "run, t_s, x_m, y_m, z_m, accel_z_m_s2, spin_x_rad_s, spin_y_rad_s, spin_z_rad_s";

fn good() -> String {
    let mut csv = String::from("run,t_s,z_m\n");
    for run in ["a", "b"] {
        for i in 0..8 {
            let t = f64::from(i) * 0.1;
            csv.push_str(&format!("{run},{t:.1},{:.3}\n", 3.0 - 4.9 * t * t));
        }
    }
    csv
}

fn folder(header: &str, csv: &[u8]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("recording.toml"), header).unwrap();
    std::fs::write(folder.path().join("data.csv"), csv).unwrap();
    folder
}

/// What the reader says, without the folder's name; "fine" where it reads.
fn said(header: &str, csv: &[u8]) -> String {
    let folder = folder(header, csv);
    match domains::load(folder.path()) {
        Ok(_) => "fine".into(),
        Err(error) => error.to_string().replace(&format!("{}/", folder.path().display()), ""),
    }
}

#[test]
fn every_rule_of_the_header_has_its_line() {
    let known: Vec<&str> = missing_physics_domains::all().iter().map(|d| d.id()).collect();
    let one = format!("expected one of: {}", known.join(", "));
    let cases: Vec<(String, String)> = vec![
        (HEADER.into(), "fine".into()),
        ("format = 2\n".into(), "key format is 2, expected 1".into()),
        ("domain = \"trajectory\"\n".into(), "key format is missing, expected 1".into()),
        ("format = 1\n".into(), format!("key domain is missing, {one}")),
        ("format = 1\ndomain = 3\n".into(), format!("key domain is 3, {one}")),
        ("format = 1\ndomain = \"flight\"\n".into(), format!("key domain is \"flight\", {one}")),
        (
            "format = 1\ndomain = \"grain-pour\"\n".into(),
            "key rig.grain_count is missing, expected a number from 50 to 5000".into(),
        ),
        (
            "format = 1\ndomain = \"trajectory\"\n".into(),
            "key data is missing, expected the name of a CSV file".into(),
        ),
        (
            HEADER.replace("data.csv", "../data.csv"),
            "key data is \"../data.csv\", expected a file in the recording's folder".into(),
        ),
        (
            HEADER.replace("data.csv", "/etc/passwd"),
            "key data is \"/etc/passwd\", expected a file in the recording's folder".into(),
        ),
        (
            format!("{HEADER}mass = 3\n"),
            "unknown key mass, expected one of: data, domain, format, noise, noise.z_m, rig, rig.air_density_kg_m3, \
             rig.diameter_m, rig.gravity_m_s2, rig.mass_kg"
                .into(),
        ),
        (
            format!("{HEADER}[rig]\nmass_kg = -1\n"),
            "key rig.mass_kg is -1, expected a number from 0.000000001 to 1000000".into(),
        ),
        (
            format!("{HEADER}[rig]\nmass_kg = \"heavy\"\n"),
            "key rig.mass_kg is \"heavy\", expected a number from 0.000000001 to 1000000".into(),
        ),
        (
            format!("{HEADER}[rig]\ngravity_m_s2 = nan\n"),
            "key rig.gravity_m_s2 is nan, expected a number from 0 to 100".into(),
        ),
        (format!("{HEADER}rig = 3\n"), "key rig is 3, expected a section".into()),
    ];
    for (header, expected) in cases {
        let got = said(&header, good().as_bytes());
        assert_eq!(got.strip_prefix("recording.toml: ").unwrap_or(&got), expected);
    }
    assert_eq!(said("format = \n", b"").split(':').next(), Some("recording.toml, row 1"));
    let away = HEADER.replace("data.csv", "none.csv");
    assert_eq!(said(&away, b""), "none.csv: no such file");
}

#[test]
fn every_rule_of_the_table_has_its_line() {
    let csv = good();
    let with = |from: &str, to: &str| csv.replacen(from, to, 1);
    let cell = "a,0.1,2.951";
    let cases: Vec<(String, String)> = vec![
        (format!("\u{feff}{}", csv.replace('\n', "\r\n")), "fine".into()),
        (with("a,0.1,", "\"a\",0.1,"), "fine".into()),
        (
            String::new(),
            format!(": the file has 0 rows, expected a first row with column names, such as {COLUMNS}"),
        ),
        ("run,t_s,z_m\n".into(), ": the file has 0 rows, expected runs of at least 4 rows".into()),
        (with("z_m", "z_mm"), ", row 1: unknown column \"z_mm\", expected z_m (height in metres)".into()),
        (with("t_s", "time"), format!(", row 1: unknown column \"time\", expected one of: {COLUMNS}")),
        (with("run,t_s,z_m", "run,z_m,z_m"), ", row 1: column z_m stands twice, expected once".into()),
        (
            with("run,t_s,z_m", "run,x_m,z_m"),
            ", row 1: column t_s is missing, expected time in seconds".into(),
        ),
        (
            with("run,t_s,z_m", "x_m,t_s,z_m"),
            ", row 2, column x_m: \"a\", expected a number: position in metres".into(),
        ),
        (
            with("run,t_s,z_m", "run,t_s,x_m"),
            ", row 1: column z_m is missing, expected height in metres (or accel_z_m_s2)".into(),
        ),
        (
            with(cell, "a,0.1,high"),
            ", row 3, column z_m: \"high\", expected a number: height in metres".into(),
        ),
        (
            with(cell, "a,0.1,"),
            ", row 3, column z_m: an empty cell, expected a number: height in metres".into(),
        ),
        (with(cell, "a,0.1,NaN"), ", row 3, column z_m: \"NaN\", expected a number: height in metres".into()),
        (with(cell, "a,0.1,inf"), ", row 3, column z_m: \"inf\", expected a number: height in metres".into()),
        (
            with(cell, "a,0.1,1e300"),
            ", row 3, column z_m: \"1e300\", expected height in metres of at most 1e12".into(),
        ),
        (with(cell, ",0.1,2.951"), ", row 3, column run: an empty cell, expected a label".into()),
        (with(cell, "a,0.1"), ", row 3: 2 cells, expected 3".into()),
        (
            with("a,0.2,", "a,0.1,"),
            ", row 4, column t_s: 0.1, expected more than 0.1, the time before it".into(),
        ),
        (
            with("a,0.2,", "a,0.05,"),
            ", row 4, column t_s: 0.05, expected more than 0.1, the time before it".into(),
        ),
        (with("b,0.7,", "c,0.7,"), ": run \"c\" has 1 rows, expected at least 4".into()),
        (
            with("run,t_s,z_m", "run,t_s,spin_x_rad_s").replace("z_m", "z"),
            ", row 1: column z_m is missing, expected height in metres (or accel_z_m_s2)".into(),
        ),
    ];
    for (csv, expected) in cases {
        let got = said(HEADER, csv.as_bytes());
        assert_eq!(got.strip_prefix("data.csv").unwrap_or(&got), expected);
    }
    assert_eq!(said(HEADER, b"run,t_s,z_m\na,0,\xff\n"), "data.csv: byte 16 is not UTF-8 text");
}

#[test]
fn bounces_and_doughs_have_rules_of_their_own() {
    let bounce = "format = 1\ndomain = \"bounce\"\ndata = \"data.csv\"\n";
    let dough = "format = 1\ndomain = \"dough-roll\"\ndata = \"data.csv\"\n";
    let rolls =
        "run,step,length_m,width_m,height_m,throw_m,depth_m,next_length_m,next_width_m,next_height_m\n";
    let roll = |run: &str, step: u32, length: &str| {
        format!("{run},{step},{length},0.04,0.04,0.08,0.02,0.05,0.038,0.037\n")
    };
    let cases: Vec<(&str, String, &str)> = vec![
        (bounce, "run,bounce,t_s\na,1,0.1\na,2,0.5\na,3,0.8\n".into(), "fine"),
        (bounce, "run,bounce,t_s\na,1,0.1\na,2,0.5\n".into(), ": run \"a\" has 2 rows, expected at least 3"),
        (
            bounce,
            "run,bounce,t_s\na,1,0.1\na,2.5,0.5\na,3,0.8\n".into(),
            ", row 3, column bounce: 2.5, expected a whole number above 1, the one before it",
        ),
        (
            bounce,
            "run,bounce,t_s\na,1,0.1\na,1,0.5\na,3,0.8\n".into(),
            ", row 3, column bounce: 1, expected a whole number above 1, the one before it",
        ),
        (
            bounce,
            "run,bounce,t_s,x_m\na,1,0.1,0\na,2,0.5,0\na,3,0.8,0\n".into(),
            ", row 1: column y_m is missing, expected the other coordinate of each place",
        ),
        (
            bounce,
            "run,bounce,t_s\na,1,0.5\na,2,0.1\na,3,0.8\n".into(),
            ", row 3, column t_s: 0.1, expected more than 0.5, the time before it",
        ),
        (
            dough,
            format!("{rolls}{}{}", roll("a", 1, "0"), roll("b", 1, "0.05")),
            ", row 2, column length_m: 0, expected above 0",
        ),
        (
            dough,
            format!("{rolls}{}{}", roll("a", 2, "0.05"), roll("a", 2, "0.05")),
            ", row 3, column step: 2, expected more than 2, the one before it",
        ),
        (
            dough,
            format!("{rolls}{}", roll("a", 1, "0.05")),
            ": the file has 1 rows, expected at least 2 runs, or rig.training: the first half of the runs is learned from",
        ),
        (
            dough,
            format!("{rolls}{}{}", roll("a", 1, "0.05"), roll("b", 1, "0.05")),
            ": the training has 1 rows, expected rolls that determine the dynamics: 1 rolls are too few for 21 coefficients: at least 42 are needed",
        ),
    ];
    for (header, csv, expected) in cases {
        let got = said(header, csv.as_bytes());
        assert_eq!(got.strip_prefix("data.csv").unwrap_or(&got), expected);
    }
}

#[test]
fn rows_of_different_runs_may_be_mixed() {
    let csv = good();
    let lines: Vec<&str> = csv.lines().collect();
    let mut mixed = vec![lines[0]];
    for i in 0..8 {
        mixed.extend([lines[1 + i], lines[9 + i]]);
    }
    let read = |csv: &str| domains::load(folder(HEADER, csv.as_bytes()).path()).unwrap().1.recording;
    assert_eq!(read(&mixed.join("\n")), read(&csv));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// However a good recording is mutilated, it is read or refused with one line.
    #[test]
    fn a_mutilated_recording_is_read_or_refused_with_one_line(
        cuts in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..4u8), 1..6),
        in_header in any::<bool>(),
    ) {
        let (mut header, mut csv) = (HEADER.as_bytes().to_vec(), good().into_bytes());
        let target = if in_header { &mut header } else { &mut csv };
        for (at, byte, how) in cuts {
            if target.is_empty() { break; }
            let at = at.index(target.len());
            match how {
                0 => target[at] = byte,
                1 => target.insert(at, byte),
                2 => { target.remove(at); }
                _ => target.truncate(at),
            }
        }
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("recording.toml"), &header).unwrap();
        std::fs::write(folder.path().join("data.csv"), &csv).unwrap();
        if let Err(error) = domains::load(folder.path()) {
            let line = error.to_string();
            prop_assert!(!line.contains('\n') && line.len() < 1000, "{line}");
        }
    }
}

fn tool(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_missing-physics")).args(arguments).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

#[test]
fn a_bad_recording_leaves_with_2_one_line_and_no_report() {
    let bad = folder(HEADER, b"run,t_s,z_m\na,0,x\n");
    let report = bad.path().join("report.json");
    let (status, out, err) =
        tool(&["diagnose", bad.path().to_str().unwrap(), "--json", report.to_str().unwrap()]);
    assert_eq!((status, out.as_str()), (2, ""));
    assert_eq!(err.lines().count(), 1, "{err}");
    assert!(!report.exists());
    let good = folder(HEADER, good().as_bytes());
    let (status, _, err) =
        tool(&["diagnose", good.path().to_str().unwrap(), "--json", "/nowhere/at/all.json"]);
    assert_eq!((status, err.lines().count()), (2, 1));
    let (status, _, err) = tool(&["diagnose", good.path().to_str().unwrap(), "--alpha", "0.7"]);
    assert_eq!((status, err.trim()), (2, "missing-physics: alpha is 0.7, expected above 0 and below 0.5"));
}

#[test]
fn a_template_is_a_sound_recording() {
    let parent = tempfile::tempdir().unwrap();
    let fresh = parent.path().join("mine");
    let fresh = fresh.to_str().unwrap();
    assert_eq!(tool(&["new", "trajectory", fresh]).0, 0);
    let (status, out, _) = tool(&["check", fresh]);
    assert_eq!(status, 0);
    assert!(out.contains("2 runs, 24 rows"), "{out}");
    assert_eq!(tool(&["diagnose", fresh]).0, 0);
    let (status, _, err) = tool(&["new", "trajectory", fresh]);
    assert_eq!((status, err.contains("exists, expected a new or empty folder")), (2, true));
    assert_eq!(tool(&["new", "weather", fresh]).0, 2);
}

/// A camera and a rig of the bundled pours.
const RIG: &str = "format = 1\ndomain = \"grain-pour\"\ndata = \"data.csv\"\n[camera]\nfx_px = 50\nfy_px = 50\ncx_px = 19.5\n\
                  cy_px = 19.5\nheight_m = 0.35\ndepth_unit_m = 0.0001\n[rig]\ngrain_diameter_m = 0.004\n\
                  grain_mass_kg = 4.356e-5\ngrain_count = 1000\n\
                  funnel = { outlet_radius_m = 0.014, cone_half_angle_rad = 0.7854, tube_radius_m = 0.04 }\n";

fn png_of(depth: png::BitDepth, counts: &[u16]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 40, 40);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(depth);
    let wide = depth == png::BitDepth::Sixteen;
    let data: Vec<u8> = counts.iter().flat_map(|c| c.to_be_bytes()[usize::from(!wide)..].to_vec()).collect();
    encoder.write_header().unwrap().write_image_data(&data).unwrap();
    bytes
}

/// Each kind of picture that shows no grains on a ground, or is no picture of depths, has its line.
#[test]
fn every_rule_of_a_depth_picture_has_its_line() {
    let csv = "run,funnel_height_m,depth_image\n1,0.06,a.png\n";
    let said = |csv: &str, bytes: Option<&[u8]>| {
        let folder = folder(RIG, csv.as_bytes());
        if let Some(bytes) = bytes {
            std::fs::write(folder.path().join("a.png"), bytes).unwrap();
        }
        let error = domains::load(folder.path()).err().unwrap().to_string();
        error.replace(&format!("{}/", folder.path().display()), "")
    };
    let sixteen = |counts: &[u16]| png_of(png::BitDepth::Sixteen, counts);
    let wild: Vec<u16> = (0..1600).map(|i| 2800 + ((i * 7919) % 1400) as u16).collect();
    let cases: Vec<(Option<Vec<u8>>, &str)> = vec![
        (None, "a.png: no such file"),
        (Some(b"not a picture".to_vec()), "a.png: not a sound PNG: "),
        (
            Some(sixteen(&[3500; 1600])[..200.min(sixteen(&[3500; 1600]).len() - 20)].to_vec()),
            "a.png: not a sound PNG: ",
        ),
        (
            Some(png_of(png::BitDepth::Eight, &[7; 1600])),
            "a.png: Eight bits, Grayscale, expected 16-bit greyscale",
        ),
        (Some(sixteen(&[0; 1600])), "a.png: 100 % of the pixels are missing, expected at most 60 %"),
        (Some(sixteen(&[u16::MAX; 1600])), "a.png: 100 % of the pixels are at the limit of 65535 counts"),
        (
            Some(sixteen(&[350; 1600])),
            "a.png: the middle depth is 0.0350 m and the camera stands 0.35 m high",
        ),
        (Some(sixteen(&[3500; 1600])), "a.png: 0.00e0 m3 stand above the ground, expected about 3.35e-5 m3"),
        (Some(sixteen(&wild)), "a.png: "),
    ];
    for (bytes, expected) in cases {
        let got = said(csv, bytes.as_deref());
        assert!(got.starts_with(expected) && got.lines().count() == 1, "{got}, expected {expected}");
    }
    let twice = format!("{csv}1,0.08,a.png\n");
    assert!(said(&twice, Some(&sixteen(&[3500; 1600]))).contains("expected one row a run"));
    let outside = csv.replace("a.png", "../a.png");
    assert!(said(&outside, None).contains("a file in the recording's folder"));
    let low = csv.replace("0.06", "-0.06");
    assert!(said(&low, None).contains("expected above 0 and below 10"));
}

/// `check` of a rig that nobody has poured before says what is there at once: it pours nothing, and leaves no pours for later.
#[test]
fn a_check_pours_nothing() {
    let header = RIG.replace("grain_count = 1000", "grain_count = 700");
    let folder = folder(&header, b"run,funnel_height_m,depth_image\n1,0.06,a.png\n");
    // A cone of about the volume of the grains, from above.
    let depth = |at: usize| {
        let [u, v] = [at % 40, at / 40].map(|p| (p as f64 - 19.5) * 0.35 / 50.0);
        let height = 0.03 * (1.0 - u.hypot(v) / 0.03).max(0.0);
        ((0.35 - height) / 1e-4).round() as u16
    };
    let heap: Vec<u16> = (0..1600).map(depth).collect();
    std::fs::write(folder.path().join("a.png"), png_of(png::BitDepth::Sixteen, &heap)).unwrap();
    let cache = tempfile::tempdir().unwrap();
    let begin = std::time::Instant::now();
    let output = Command::new(env!("CARGO_BIN_EXE_missing-physics"))
        .arg("check")
        .arg(folder.path())
        .env("XDG_CACHE_HOME", cache.path())
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(
        said.contains("1 runs, 1 rows; measured: ") && said.contains("run 1: 1 rows, 0.06 to 0.06 m"),
        "{said}"
    );
    assert!(said.contains("mechanisms that can show: cohesion, "), "{said}");
    // 500 heaps take minutes.
    assert!(begin.elapsed() < std::time::Duration::from_secs(10), "{:?}", begin.elapsed());
    assert_eq!(std::fs::read_dir(cache.path()).unwrap().count(), 0);
}
