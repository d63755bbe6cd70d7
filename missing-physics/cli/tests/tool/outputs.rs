//! Outputs lose nothing: neither what is read, nor what was there, nor what stands behind a link.
#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use std::io::Read as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const RECORDING: &str = "../../recordings/dropped-ball";

fn tool(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_missing-physics"));
    command.args(arguments).current_dir(env!("CARGO_MANIFEST_DIR"));
    command
}

fn run(arguments: &[&str]) -> Output {
    tool(arguments).output().unwrap()
}

fn said(output: &Output) -> (String, String) {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (text(&output.stdout), text(&output.stderr))
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_dash_is_standard_output_and_the_text_steps_aside() {
    for name in ["-", "/dev/stdout", "/dev/fd/1"] {
        let output = run(&["diagnose", RECORDING, "--json", name]);
        let (out, err) = said(&output);
        assert!(output.status.success(), "{name}: {err}");
        let answer: serde_json::Value = serde_json::from_str(&out).unwrap();
        assert_eq!(answer["verdict"], "explained", "{name}");
        assert!(err.starts_with("The simulation does not explain"), "{name}: {err}");
    }
    assert!(std::fs::symlink_metadata("/dev/stdout").unwrap().is_symlink());
}

#[test]
fn standard_output_that_is_a_file_keeps_both() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out");
    let file = std::fs::File::create(&path).unwrap();
    let status =
        tool(&["diagnose", RECORDING, "--svg", "/dev/stdout"]).stdout(file).stderr(Stdio::null()).status();
    assert!(status.unwrap().success());
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"), "{text}");
}

#[test]
fn a_full_disk_is_an_error_that_leaves_what_was_there() {
    let output = run(&["diagnose", RECORDING, "--json", "/dev/full"]);
    let (out, err) = said(&output);
    assert_eq!(output.status.code(), Some(2));
    assert!(out.starts_with("The simulation does not explain"), "the text comes before the files: {out}");
    assert!(err.contains("/dev/full: ") && err.lines().count() == 1, "{err}");
    assert!(!std::fs::metadata("/dev/full").unwrap().is_file());
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let output = tool(&["domains"]).stdout(full).stderr(Stdio::piped()).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).1.contains("standard output: "), "{output:?}");
}

#[test]
fn inputs_and_other_outputs_are_not_written_over() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["recording.toml", "data.csv"] {
        let from = Path::new(env!("CARGO_MANIFEST_DIR")).join(RECORDING).join(name);
        std::fs::copy(from, folder.path().join(name)).unwrap();
    }
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    std::os::unix::fs::symlink("data.csv", at("link.json")).unwrap();
    let here = at("");
    for (arguments, why) in [
        (vec!["--json".to_owned(), at("data.csv")], "is read, and cannot be an output"),
        (vec!["--json".to_owned(), at("link.json")], "is read, and cannot be an output"),
        (vec!["--html".to_owned(), at("recording.toml")], "is read, and cannot be an output"),
        (vec!["--json".to_owned(), at("a"), "--svg".to_owned(), at("a")], "two outputs of one name"),
        (
            vec!["--json".to_owned(), "-".into(), "--svg".to_owned(), "/dev/stdout".into()],
            "two outputs of one name",
        ),
    ] {
        let before = std::fs::read(at("data.csv")).unwrap();
        let all: Vec<&str> =
            ["diagnose", &here].into_iter().chain(arguments.iter().map(String::as_str)).collect();
        let output = run(&all);
        let (out, err) = said(&output);
        assert_eq!((output.status.code(), out.as_str()), (Some(2), ""), "{arguments:?}");
        assert!(err.contains(why) && err.lines().count() == 1, "{arguments:?}: {err}");
        assert_eq!(std::fs::read(at("data.csv")).unwrap(), before);
    }
    // Beside them there is room, again and again.
    for _ in 0..2 {
        assert!(run(&["diagnose", &here, "--json", &at("answer.json")]).status.success());
    }
    assert_eq!(names(folder.path()), ["answer.json", "data.csv", "link.json", "recording.toml"]);
}

#[test]
fn a_pipe_is_written_to_and_stays_a_pipe() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("pipe");
    assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
    let mut child = tool(&["diagnose", RECORDING, "--json", path.to_str().unwrap()])
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let mut text = String::new();
    std::fs::File::open(&path).unwrap().read_to_string(&mut text).unwrap();
    assert!(child.wait().unwrap().success());
    assert!(serde_json::from_str::<serde_json::Value>(&text).is_ok(), "{text}");
    assert_eq!(names(folder.path()), ["pipe"]);
}

#[test]
fn quiet_says_nothing_and_verbose_says_each_step() {
    let quiet = run(&["--quiet", "diagnose", RECORDING]);
    assert_eq!((quiet.status.success(), said(&quiet)), (true, (String::new(), String::new())));
    let (out, err) = said(&run(&["diagnose", RECORDING, "--verbose"]));
    assert!(out.starts_with("The simulation does not explain"), "{out}");
    assert!(err.lines().count() > 2 && err.contains(" s in all"), "{err}");
    assert!(err.contains("tried quadratic-drag: probability"), "{err}");
    let many = run(&["diagnose", RECORDING, "--threads", "100000"]);
    assert_eq!(said(&many).0, out);
}

/// Nine is no descriptor that is open: that is said before the work, not after it.
#[test]
fn a_descriptor_that_is_not_open_is_refused_before_the_work() {
    let (out, err) = said(&run(&["diagnose", RECORDING, "--json", "/dev/fd/9"]));
    assert_eq!(out, "");
    assert!(err.contains("/dev/fd/9: ") && err.lines().count() == 1, "{err}");
}

/// `--html - | head` is as good as without `--html -`.
#[test]
fn a_reader_that_goes_away_is_no_failure() {
    for arguments in [&["domains"][..], &["diagnose", RECORDING, "--html", "-"]] {
        let mut child = tool(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut first = [0];
        let mut stdout = child.stdout.take().unwrap();
        stdout.read_exact(&mut first).unwrap();
        drop(stdout);
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success() && !said(&output).1.contains("ipe"), "{arguments:?}: {output:?}");
    }
}

/// A file may not grow beyond some kilobytes, as on a disk that fills up while it is written.
#[test]
fn a_disk_that_fills_up_leaves_the_old_file_and_no_part() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("report.html");
    std::fs::write(&path, "old").unwrap();
    let limited = "trap '' XFSZ; ulimit -f 8; exec \"$0\" diagnose \"$1\" --html \"$2\"";
    let output = Command::new("sh")
        .args(["-c", limited, env!("CARGO_BIN_EXE_missing-physics"), RECORDING])
        .arg(&path)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    let (out, err) = said(&output);
    assert_eq!(output.status.code(), Some(2), "{err}");
    assert!(out.starts_with("The simulation does not explain"), "{out}");
    assert!(err.contains("report.html: ") && err.lines().count() == 1, "{err}");
    assert_eq!(std::fs::read(&path).unwrap(), b"old");
    assert_eq!(names(folder.path()), ["report.html"]);
}

/// What is said of a folder moves no cursor, wherever standard error leads: it is quoted in errors by whoever reads them.
#[test]
fn control_characters_of_names_are_escaped() {
    let (_, err) = said(&run(&["check", "no\u{1b}[2Jsuch"]));
    assert!(err.contains("no\\u{1b}[2Jsuch") && !err.contains('\u{1b}'), "{err}");
}
